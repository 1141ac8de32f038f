"""Preprocessing of observations as part of an ONNX graph."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch as th
from gymnasium import spaces
from stable_baselines3.common.preprocessing import is_image_space
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

_TYPES = {
    np.dtype(np.float32): th.float32,
    np.dtype(np.float64): th.float64,
    np.dtype(np.float16): th.float16,
    np.dtype(np.uint8): th.uint8,
    np.dtype(np.int8): th.int8,
    np.dtype(np.int16): th.int16,
    np.dtype(np.int32): th.int32,
    np.dtype(np.int64): th.int64,
    np.dtype(np.bool_): th.bool,
}


class ObservationInput(nn.Module):
    """Module that normalizes one part of an observation and converts it to the floats that a network accepts.

    The module performs the operations of stable-baselines3's ``VecNormalize.normalize_obs``, ``obs_to_tensor`` and
    ``preprocess_obs`` in the same order and precision. The original code cannot be traced, because it depends on the
    values of the observations.

    Args:
        space: Space of this part in the environment.
        seen: Space that the policy sees: ``space``, with the channels of images moved to the front.
        normalizer: Normalizer of the observations, if any.
        key: Key of the part, or ``""`` if the observation is a single array.
    """

    def __init__(
        self, space: spaces.Space[Any], seen: spaces.Space[Any], normalizer: VecNormalize | None, key: str
    ) -> None:
        super().__init__()
        self.space = space
        self.image = isinstance(seen, spaces.Box) and is_image_space(seen)
        self.transposed = isinstance(seen, spaces.Box) and seen.shape != space.shape
        self.normalized = normalizer is not None and _normalizes(normalizer, key)
        if normalizer is not None and self.normalized:
            statistics = normalizer.obs_rms[key] if isinstance(normalizer.obs_rms, dict) else normalizer.obs_rms
            self.register_buffer("mean", th.as_tensor(np.asarray(statistics.mean, np.float64)))
            self.register_buffer("deviation", th.as_tensor(np.sqrt(statistics.var + normalizer.epsilon)))
            self.clip = float(normalizer.clip_obs)

    def example(self, batch: int) -> th.Tensor:
        """Return an example input of the correct shape and type, (batch, …)."""
        dtype = self.space.dtype
        assert dtype is not None
        return th.zeros((batch, *(self.space.shape or ())), dtype=_TYPES[np.dtype(dtype)])

    def forward(self, observation: th.Tensor) -> th.Tensor:
        """Return floats, (batch, …)."""
        if self.normalized:  # in double precision, because the mean may be large relative to the standard deviation
            assert isinstance(self.mean, th.Tensor)
            assert isinstance(self.deviation, th.Tensor)
            scaled = (observation.double() - self.mean) / self.deviation
            observation = th.clamp(scaled, -self.clip, self.clip).float()
        if self.transposed:
            observation = observation.movedim(-1, -3)
        if isinstance(self.space, spaces.Discrete):
            return one_hot(observation, int(self.space.n))
        if isinstance(self.space, spaces.MultiDiscrete):
            columns = enumerate(self.space.nvec.flatten().tolist())
            return th.cat([one_hot(observation[:, column], n) for column, n in columns], dim=-1)
        return observation.float() / 255.0 if self.image else observation.float()


def one_hot(index: th.Tensor, n: int) -> th.Tensor:
    """Return a one-hot encoding of the indices, (batch, n) floats."""
    return (index.long().unsqueeze(-1) == th.arange(n)).float()


def _normalizes(normalizer: VecNormalize, key: str) -> bool:
    if not normalizer.norm_obs:
        return False
    return not isinstance(normalizer.obs_rms, dict) or key in (normalizer.norm_obs_keys or ())
