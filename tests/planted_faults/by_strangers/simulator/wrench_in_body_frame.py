"""An applied force and torque are taken to be in the body's own frame instead of the world's."""

from __future__ import annotations

import numpy as np

from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.rotations import quat_rotate
from frobs_sim_pybullet.simulation import PybulletSimulation

EXACT, APPROXIMATE = (
    "determinism snapshot teleport pause drive contacts rays wrench cameras randomize_mass "
    "randomize_gains randomize_joint_damping randomize_gravity randomize_size",
    "attachments force_torque batched randomize_friction",
)


class Faulty(PybulletSimulation):
    def apply_wrench(self, body: str, force_world: Floats, torque_world: Floats, mask: Mask | None = None) -> None:
        self.parameters.check_body(body)
        robot, _, link = body.partition("/")
        pose = self.bodies[body].pose if body in self.bodies else self.robots[robot].frame_pose(link)
        quat = pose[1][rows_of(mask)]
        force, torque = (
            quat_rotate(quat, np.broadcast_to(part, (len(quat), 3))) for part in (force_world, torque_world)
        )
        super().apply_wrench(body, force, torque, mask)
