"""The normal force of a contact is that of the last physics step of a control step, not the largest one."""

from __future__ import annotations

import numpy as np

from frobs_sim_mujoco.contacts import ContactReader
from frobs_sim_mujoco.simulation import MujocoSimulation

EXACT = (
    "determinism snapshot teleport pause batched drive contacts rays wrench force_torque attachments cameras "
    "randomize_mass randomize_friction randomize_gains randomize_joint_damping randomize_gravity randomize_size"
)
APPROXIMATE = ""


class _Reader(ContactReader):
    def read(self, data, contacts):
        super().read(data, contacts)
        if self._totals:
            contacts.normal_force[:] = np.abs(data[:, -1, self._forces])


class Faulty(MujocoSimulation):
    def __init__(self, robots, scene, **options):
        super().__init__(robots, scene, **options)
        self._contact_reader = _Reader(self.model, scene)
