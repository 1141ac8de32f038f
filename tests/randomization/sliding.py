"""A task for tests: a box that lies on the floor, and slides where gravity is tilted and friction is low."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from frobs_core.contracts import Control, Simulation, StepContext, Task
from frobs_core.description import Body, ObservationTerm, Scene
from frobs_core.models import Box, Pose
from frobs_core.plugins.records import TaskRecord
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.random import RandomSource


class Sliding(Task):
    def scene(self) -> Scene:
        return Scene(bodies={"box": Body(geometry=Box((0.2, 0.2, 0.1)), pose=Pose(pos=(0.0, 2.0, 0.05)), mass=1.0)})

    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        self._box = simulation.bodies["box"]

    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        """Let everything be where the scene has it."""

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        far = np.full(3, np.inf)
        return {"box": ObservationTerm(read=lambda: self._box.pose[0], low=-far, high=far, unit="m")}

    def reward(self, context: StepContext) -> Floats:
        return self._box.pose[0][:, 0].copy()

    def is_success(self) -> Mask:
        return np.zeros(len(self._box.pose[0]), np.bool_)


RECORD = TaskRecord(name="sliding", summary="a box slides", entry_point="sliding:Sliding")
