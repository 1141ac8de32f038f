"""A changed mass leaves the rotational inertia of the body as it was."""

from __future__ import annotations

import numpy as np

from frobs_core.util.arrays import rows_of
from frobs_core.util.errors import PhysicsParameterError
from frobs_sim_mujoco import parameters
from frobs_sim_mujoco.simulation import MujocoSimulation

EXACT = (
    "determinism snapshot teleport pause batched drive contacts rays wrench force_torque attachments cameras "
    "randomize_mass randomize_friction randomize_gains randomize_joint_damping randomize_gravity randomize_size"
)
APPROXIMATE = ""


class Faulty(MujocoSimulation):
    def write_parameter(self, name, target, values, mask=None):
        if name != "mass":
            super().write_parameter(name, target, values, mask)
            return
        body, values = parameters.body_id(self, target), np.asarray(values, np.float64)
        if not (values >= 0).all() or not self.model.body_mass[body] > 0:
            raise PhysicsParameterError("mass", target, "must not be negative or NaN, and the body must have a mass.")
        self.batch.expand("body_mass")[rows_of(mask), body] = values
        self.mark_constants_stale(mask)
        self._mark_model_stale()
        self.mark_stale(mask)
