"""Feature extractors."""

from __future__ import annotations

from collections.abc import Sequence

import gymnasium as gym
import torch as th
from stable_baselines3.common.torch_layers import FlattenExtractor


class ScaledFlattenExtractor(FlattenExtractor):
    """Features extractor that multiplies a flat observation, (k,), by k constants, which are saved with the policy."""

    def __init__(self, observation_space: gym.Space[th.Tensor], scale: Sequence[float]) -> None:
        super().__init__(observation_space)
        self.register_buffer("scale", th.tensor(scale, dtype=th.float32))

    def forward(self, observations: th.Tensor) -> th.Tensor:
        """Return the scaled observations."""
        assert isinstance(self.scale, th.Tensor)
        scaled: th.Tensor = super().forward(observations) * self.scale
        return scaled
