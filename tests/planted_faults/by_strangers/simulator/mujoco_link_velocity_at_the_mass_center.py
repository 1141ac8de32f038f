"""The linear velocity of a link is that of its center of mass, not that of its origin."""

from __future__ import annotations

from frobs_core.util.rotations import cross
from frobs_sim_mujoco.robot import MujocoRobot
from frobs_sim_mujoco.simulation import MujocoSimulation

EXACT = (
    "determinism snapshot teleport pause batched drive contacts rays wrench force_torque attachments cameras "
    "randomize_mass randomize_friction randomize_gains randomize_joint_damping randomize_gravity randomize_size"
)
APPROXIMATE = ""


class _Robot(MujocoRobot):
    def frame_velocity(self, frame):
        body = self._simulation.model.body(f"{self.name}/{self.frame_name(frame)}").id
        twist = self._simulation.derived("cvel")[:, body]
        arm = self._simulation.derived("xipos")[:, body] - self._simulation.derived("subtree_com")[:, self._tree]
        return twist[:, 3:] + cross(twist[:, :3], arm), twist[:, :3]


class Faulty(MujocoSimulation):
    def __init__(self, robots, scene, **options):
        super().__init__(robots, scene, **options)
        for robot in self.robots.values():
            robot.__class__ = _Robot
