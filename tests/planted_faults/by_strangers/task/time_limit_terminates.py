"""The task ends its episodes after a number of steps itself, as terminal states instead of by truncation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from frobs_core.contracts import Control, Simulation, Snapshot, StepContext
from frobs_core.util.arrays import Mask, rows_of
from frobs_core.util.random import RandomSource
from templates.my_reach import MyReach


class Faulty(MyReach):
    def __init__(self, *, episode_steps: int = 100, **keywords: Any) -> None:
        super().__init__(**keywords)
        self.episode_steps = episode_steps

    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        super().bind(simulation, control, control_timestep)
        self._steps = np.zeros(simulation.num_envs, np.int64)

    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        super().reset(mask, rng, options)
        self._steps[rows_of(mask)] = 0

    def advance(self, context: StepContext) -> None:
        super().advance(context)
        self._steps += 1

    def is_terminated(self) -> Mask:
        return self._steps >= self.episode_steps

    def snapshot(self) -> Snapshot:
        return {**super().snapshot(), "steps": self._steps.copy()}

    def restore(self, snapshot: Snapshot) -> None:
        super().restore(snapshot)
        self._steps[:] = snapshot["steps"]
