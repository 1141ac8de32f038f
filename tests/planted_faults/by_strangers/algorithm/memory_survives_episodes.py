"""The recurrent policy ignores the starts of episodes when it predicts, so that its memory continues into the next one."""

from __future__ import annotations

from typing import Any

import numpy as np

from frobs_algos_sb3.recurrent_ppo import RecurrentPPO
from frobs_core.description import Observation
from frobs_core.util.arrays import Action, Mask


class Faulty(RecurrentPPO):
    def predict(
        self,
        observation: Observation,
        state: tuple[np.ndarray[Any, Any], ...] | None = None,
        episode_start: Mask | None = None,
        deterministic: bool = True,
    ) -> tuple[Action, tuple[np.ndarray[Any, Any], ...] | None]:
        return super().predict(observation, state, deterministic=deterministic)
