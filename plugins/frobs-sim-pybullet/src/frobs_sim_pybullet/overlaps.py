"""Detection of overlapping links."""

from __future__ import annotations

from dataclasses import replace

from frobs_core.description import Overlap, Placement
from frobs_core.util.arrays import Floats
from frobs_sim_pybullet.articulation import Articulation
from frobs_sim_pybullet.bullet import pybullet as p
from frobs_sim_pybullet.engine import Dynamics, connect
from frobs_sim_pybullet.meshes import MeshFiles


def find_overlaps(placement: Placement, joint_positions: Floats) -> list[Overlap]:
    """Return a robot's overlapping link pairs, except neighbors, with the deepest overlap first."""
    client, dynamics, meshes = connect(), Dynamics(), MeshFiles()
    try:
        touching = replace(placement, robot=replace(placement.robot, self_collision=True))
        robot = Articulation(client, "robot", touching, dynamics, meshes, 1)
        robot.write_joints(joint_positions.tolist(), [0.0] * len(joint_positions))
        overlaps = [Overlap(first=a, second=b, depth=depth) for (a, b), depth in robot.overlaps().items()]
        return sorted(overlaps, key=lambda overlap: -overlap.depth)
    finally:
        meshes.clear()
        p.disconnect(client)
        dynamics.close()
