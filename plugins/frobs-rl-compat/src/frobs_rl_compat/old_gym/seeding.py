"""Random number generators with the interface of old gym's generators."""

from __future__ import annotations

from typing import Any

import numpy as np


class RandomNumberGenerator(np.random.Generator):
    """NumPy's random number generator with the method names of old gym."""

    def rand(self, *size: int) -> Any:
        """Return random numbers in [0, 1)."""
        return self.random(size or None)

    def randn(self, *size: int) -> Any:
        """Return random numbers from the standard normal distribution."""
        return self.standard_normal(size or None)

    def randint(self, low: int, high: int | None = None, size: Any = None, dtype: Any = int) -> Any:
        """Return random integers in [low, high), or in [0, low) if ``high`` is None."""
        return self.integers(low, high, size, dtype)

    def random_sample(self, size: Any = None) -> Any:
        """Return random numbers in [0, 1)."""
        return self.random(size)


def np_random(seed: int | None = None) -> tuple[RandomNumberGenerator, int]:
    """Return a random number generator and its seed."""
    sequence = np.random.SeedSequence(seed)
    used: Any = sequence.entropy
    return RandomNumberGenerator(np.random.PCG64(sequence)), int(used)
