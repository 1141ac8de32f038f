"""What a number is drawn from."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from frobs_core.arrays import Floats, Mask
from frobs_core.random import RandomSource


class Shape(StrEnum):
    """The shapes that a distribution can have."""

    CONSTANT = "constant"
    UNIFORM = "uniform"
    LOG_UNIFORM = "log_uniform"
    NORMAL = "normal"


@dataclass(frozen=True, kw_only=True, eq=False)
class Distribution:
    """What a number is drawn from. Each bound is one number, or (k,) for one of each component.

    Attributes:
        shape: Its shape.
        low: Nothing below comes out; the value itself of a constant.
        high: Nothing above comes out.
        mean: Of the normal distribution, before it is held within the bounds.
        std: Of the normal distribution, before it is held within the bounds.
    """

    shape: Shape
    low: Floats
    high: Floats
    mean: Floats = field(default_factory=lambda: np.zeros(()))
    std: Floats = field(default_factory=lambda: np.zeros(()))

    @property
    def width(self) -> int:
        """How many components its numbers have; 1 where they are single numbers."""
        return max(array.size for array in (self.low, self.high, self.mean, self.std))

    def draw(self, rng: RandomSource, stream: str, width: int, mask: Mask | None) -> Floats:
        """Draw for the n environments of the mask.

        Args:
            rng: The environment's source.
            stream: Name of the stream.
            width: Numbers for each environment.
            mask: The environments.

        Returns:
            (n, width)
        """
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
