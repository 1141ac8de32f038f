"""The resultant of a contact is the force on its second side."""

from __future__ import annotations

import numpy as np

from frobs_sim_mujoco.simulation import MujocoSimulation

EXACT, APPROXIMATE = (
    "determinism snapshot teleport pause batched drive contacts rays wrench force_torque attachments cameras "
    "randomize_mass randomize_friction randomize_gains randomize_joint_damping randomize_gravity randomize_size",
    "",
)


class Faulty(MujocoSimulation):
    def step(self, decimation: int) -> None:
        super().step(decimation)
        np.negative(self.contacts.resultant, out=self.contacts.resultant)
