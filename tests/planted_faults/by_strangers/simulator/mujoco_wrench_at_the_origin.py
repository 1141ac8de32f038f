"""A force that is applied to a body acts at the origin of the body instead of its center of mass."""

from __future__ import annotations

import numpy as np

from frobs_core.util.arrays import rows_of
from frobs_sim_mujoco.simulation import MujocoSimulation

EXACT = (
    "determinism snapshot teleport pause batched drive contacts rays wrench force_torque attachments cameras "
    "randomize_mass randomize_friction randomize_gains randomize_joint_damping randomize_gravity randomize_size"
)
APPROXIMATE = ""


class Faulty(MujocoSimulation):
    def apply_wrench(self, body, force_world, torque_world, mask=None):
        if body in self.body_ids:
            number, rows = self.body_ids[body], rows_of(mask)
            arm = (self.derived("xpos")[:, number] - self.derived("xipos")[:, number])[rows]
            torque_world = torque_world + np.cross(arm, np.broadcast_to(force_world, arm.shape))
        super().apply_wrench(body, force_world, torque_world, mask)
