"""A written mass scales the inertia that the body has at that moment by the ratio to the nominal mass, so that the inertia drifts away if the mass is written again and again."""

from __future__ import annotations

import numpy as np

from frobs_core.util.arrays import rows_of
from frobs_sim_mujoco import parameters
from frobs_sim_mujoco.simulation import MujocoSimulation

EXACT, APPROXIMATE = (
    "determinism snapshot teleport pause batched drive contacts rays wrench force_torque attachments cameras "
    "randomize_mass randomize_friction randomize_gains randomize_joint_damping randomize_gravity randomize_size",
    "",
)


class Faulty(MujocoSimulation):
    def write_parameter(self, name, target, values, mask=None):
        if name != "mass":
            super().write_parameter(name, target, values, mask)
            return
        body, rows = parameters.body_id(self, target), rows_of(mask)
        inertia = self.batch.expand("body_inertia")[rows, body].copy()
        super().write_parameter(name, target, values, mask)
        factor = self.batch.expand("body_mass")[rows, body] / self.model.body_mass[body]
        self.batch.expand("body_inertia")[rows, body] = np.asarray(factor)[:, None] * inertia
