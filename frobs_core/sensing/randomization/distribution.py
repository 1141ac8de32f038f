"""Distributions for random draws."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.random import RandomSource


class Shape(StrEnum):
    """Shapes of distributions."""

    CONSTANT = "constant"
    UNIFORM = "uniform"
    LOG_UNIFORM = "log_uniform"
    NORMAL = "normal"


@dataclass(frozen=True, kw_only=True, eq=False)
class Distribution:
    """A distribution for random draws.

    Each parameter is a single number, or an array (k,) with one number for each component.

    Attributes:
        shape: Shape of the distribution.
        low: Lower bound, or the value of a constant distribution.
        high: Upper bound, or the value of a constant distribution.
        mean: Mean of the normal distribution before clipping.
        std: Standard deviation of the normal distribution before clipping.
    """

    shape: Shape
    low: Floats
    high: Floats
    mean: Floats = field(default_factory=lambda: np.zeros(()))
    std: Floats = field(default_factory=lambda: np.zeros(()))

    @property
    def width(self) -> int:
        """Number of components, which is 1 for scalars."""
        return max(array.size for array in (self.low, self.high, self.mean, self.std))

    def draw(self, rng: RandomSource, stream: str, width: int, mask: Mask | None) -> Floats:
        """Draw numbers, (n, width), from a random stream for the n environments selected by ``mask``."""
        match self.shape:
            case Shape.CONSTANT:
                n = rng.num_envs if mask is None else int(np.count_nonzero(mask))
                return np.broadcast_to(self.low, (n, width)).copy()
            case Shape.UNIFORM:
                return rng.uniform(stream, self.low, self.high, (width,), mask)
            case Shape.LOG_UNIFORM:
                return np.exp(rng.uniform(stream, np.log(self.low), np.log(self.high), (width,), mask))
            case Shape.NORMAL:
                return np.clip(rng.normal(stream, self.mean, self.std, (width,), mask), self.low, self.high)
