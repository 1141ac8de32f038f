"""Pictures begin with their lowest row, as OpenGL stores them: they are upside down."""

from __future__ import annotations

import numpy as np

from frobs_sim_mujoco.simulation import MujocoSimulation

EXACT = "determinism snapshot teleport pause batched drive contacts rays wrench force_torque attachments cameras"
APPROXIMATE = ""


class Faulty(MujocoSimulation):
    def render(self, *arguments, **options):
        return np.ascontiguousarray(super().render(*arguments, **options)[:, ::-1])
