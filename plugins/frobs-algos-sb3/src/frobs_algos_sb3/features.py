"""Feature extractors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import torch as th
from stable_baselines3.common.preprocessing import get_flattened_obs_dim, is_image_space
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor, FlattenExtractor
from torch import nn

from frobs_algos.encoder import Encoder
from frobs_algos.spaces import subspaces


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


class SpatialSoftmax(BaseFeaturesExtractor):
    """Features extractor that reduces each picture to points, and leaves the other parts of the observation as they are.

    Compared with the convolutions of Nature DQN, it has less than a tenth of the weights, and its outputs are positions in
    the picture.
    """

    def __init__(self, observation_space: gym.Space[Any]) -> None:
        parts = subspaces(observation_space)
        pictures = [key for key, part in parts.items() if is_image_space(part)]
        others = [key for key in parts if key not in pictures]
        size = len(pictures) * Encoder.size + sum(get_flattened_obs_dim(parts[key]) for key in others)
        super().__init__(observation_space, size)
        # Observations have their channels first here.
        self.encoders = nn.ModuleList(Encoder((parts[key].shape or ())[0]) for key in pictures)
        self._pictures, self._others = pictures, others

    def forward(self, observations: Any) -> th.Tensor:
        """Return the features, (batch, features_dim), for pictures in [0, 1]."""
        parts = observations if isinstance(observations, dict) else {"": observations}
        points = [encoder(parts[key] - 0.5) for encoder, key in zip(self.encoders, self._pictures, strict=True)]
        return th.cat([*points, *(parts[key].flatten(1) for key in self._others)], dim=1)
