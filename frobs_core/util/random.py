"""Random numbers that depend only on an environment's seed, episode and step, and on the name of a stream.

The generator is counter-based: Philox 4×32 with 10 rounds (Salmon, Moraes, Dror, Shaw: "Parallel random numbers: as
easy as 1, 2, 3", SC 2011). A single call can therefore draw numbers for all environments. The numbers of an environment
do not depend on the number of environments or on draws from other streams.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import lru_cache
from math import prod
from typing import Any

import numpy as np
import numpy.typing as npt

from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.errors import ConfigurationError, ParameterValueError

_LOW = 0xFFFFFFFF
_FULL = 0xFFFFFFFFFFFFFFFF
_FEW = 16  # up to this number of blocks, plain Python is faster than about 150 small NumPy calls

Words = npt.NDArray[np.uint64]
"""Unsigned 32-bit words, stored in 64-bit integers so that products do not overflow."""


def philox4x32(counter: Sequence[Any], key: Sequence[Any]) -> tuple[Any, Any, Any, Any]:
    """Return the four 32-bit words of Philox 4×32-10, given four words of a counter and two of a key.

    The words are integers or broadcastable arrays of :data:`Words`.
    """
    c0, c1, c2, c3 = counter
    k0, k1 = key
    for _ in range(10):
        p0 = 0xD2511F53 * c0
        p1 = 0xCD9E8D57 * c2
        c0, c1, c2, c3 = (p1 >> 32) ^ c1 ^ k0, p1 & _LOW, (p0 >> 32) ^ c3 ^ k1, p0 & _LOW
        k0, k1 = (k0 + 0x9E3779B9) & _LOW, (k1 + 0xBB67AE85) & _LOW
    return c0, c1, c2, c3


@lru_cache(maxsize=1024)
def _stream_number(stream: str) -> int:
    return int.from_bytes(hashlib.blake2b(stream.encode(), digest_size=8).digest(), "little")


def _mix(x: Words) -> Words:
    """Hash consecutive numbers to 64-bit values with the finalizer of SplitMix64 (Steele, Lea, Flood 2014)."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


class RandomSource:
    """Streams of random numbers for ``num_envs`` environments.

    A number depends on the environment's seed, episode and step, on the stream's name, and on the number of previous
    draws from this stream at the same step.

    Args:
        num_envs: ≥ 1.

    Attributes:
        clock: Total number of steps across all episodes. The environment increments the clock at the start of each
            step.
    """

    def __init__(self, num_envs: int) -> None:
        self.num_envs = num_envs
        self.clock = 0
        self._seeds: Words = np.zeros(num_envs, np.uint64)
        self._episodes: Words = np.zeros(num_envs, np.uint64)
        self._begun: Words = np.zeros(num_envs, np.uint64)  # value of the clock at the start of the episode
        self._draws: dict[str, Words] = {}  # number of draws from each stream at step ``_drawn_at``
        self._drawn_at = 0
        self._keys: dict[str, Words] = {}

    def seed(self, seeds: Sequence[int] | Words, mask: Mask | None = None) -> None:
        """Set the seeds (modulo 2⁶⁴) of the n environments selected by ``mask``.

        The episode numbers of these environments restart at 0.

        Raises:
            ConfigurationError: The number of seeds is not n.
        """
        rows = rows_of(mask)
        n = len(self._seeds[rows])
        if len(seeds) != n:
            raise ParameterValueError("number of seeds", len(seeds), f"{n}, one for each environment")
        self._seeds[rows] = np.array([int(seed) & _FULL for seed in seeds], np.uint64)
        self._episodes[rows] = _LOW  # begin_episode increments this to 0
        self._keys.clear()

    def begin_episode(self, mask: Mask | None = None) -> None:
        """Increment the episode number and reset the step to 0, in the environments selected by ``mask``."""
        rows = rows_of(mask)
        self._episodes[rows] = (self._episodes[rows] + 1) & _LOW
        self._begun[rows] = self.clock
        for draws in self._draws.values():
            draws[rows] = 0

    def uniform(
        self,
        stream: str,
        low: float | Floats = 0.0,
        high: float | Floats = 1.0,
        shape: tuple[int, ...] = (),
        mask: Mask | None = None,
    ) -> Floats:
        """Draw uniformly from [low, high). Due to rounding, about one in 10¹⁵ draws may return ``high``.

        Args:
            stream: Name of the stream, such as ``"goal"``.
            low: Broadcasts to (n, …shape).
            high: Broadcasts to (n, …shape).
            shape: Shape of the numbers for a single environment.
            mask: Mask of the n environments, or None for all environments.

        Returns:
            Random numbers, (n, …shape) float64, in the order of the environments.
        """
        return low + (high - low) * self._unit(stream, shape, mask)

    def normal(
        self,
        stream: str,
        mean: float | Floats = 0.0,
        std: float | Floats = 1.0,
        shape: tuple[int, ...] = (),
        mask: Mask | None = None,
    ) -> Floats:
        """Draw from normal distributions, (n, …shape) float64. ``mean`` and ``std`` broadcast to this shape.

        For the other arguments, see :meth:`uniform`.
        """
        pairs = self._unit(stream, (2, *shape), mask)  # Box and Muller, 1958
        return mean + std * np.sqrt(-2.0 * np.log1p(-pairs[:, 0])) * np.cos(2.0 * np.pi * pairs[:, 1])

    def integers(
        self, stream: str, low: int, high: int, shape: tuple[int, ...] = (), mask: Mask | None = None
    ) -> npt.NDArray[np.int64]:
        """Draw integers uniformly from [low, high), (n, …shape) int64. For the other arguments, see :meth:`uniform`.

        Raises:
            ConfigurationError: The interval [low, high) does not contain an integer.
        """
        if low >= high:
            raise ConfigurationError(f"stream '{stream}': the interval [{low}, {high}) does not contain an integer.")
        return low + np.floor((high - low) * self._unit(stream, shape, mask)).astype(np.int64)

    @property
    def episodes(self) -> Words:
        """Current episode of each environment, (num_envs,), counted from 0 after seeding."""
        return self._episodes

    @property
    def steps(self) -> Words:
        """Current step of each environment in its episode, (num_envs,), which is 0 after a reset."""
        return np.uint64(self.clock) - self._begun

    def snapshot(self) -> dict[str, npt.NDArray[np.uint64]]:
        """Return the complete state, which is valid only between steps."""
        return {"seeds": self._seeds.copy(), "episodes": self._episodes.copy(), "steps": self.steps}

    def restore(self, snapshot: dict[str, npt.NDArray[np.uint64]]) -> None:
        """Restore a snapshot."""
        self._seeds[:], self._episodes[:] = snapshot["seeds"], snapshot["episodes"]
        self.clock = int(snapshot["steps"].max(initial=0))
        self._begun[:] = np.uint64(self.clock) - snapshot["steps"]
        self._draws.clear()
        self._keys.clear()

    def _key(self, stream: str) -> Words:
        key = self._keys.get(stream)
        if key is None:
            mixed = _mix(self._seeds + np.uint64(_stream_number(stream)))
            key = self._keys[stream] = np.stack((mixed & _LOW, mixed >> 32))
        return key

    def _unit(self, stream: str, shape: tuple[int, ...], mask: Mask | None) -> Floats:
        """Draw from [0, 1) with 53 bits, (n, *shape)."""
        rows = rows_of(mask)
        if self._drawn_at != self.clock:
            self._draws.clear()
            self._drawn_at = self.clock
        if stream not in self._draws:
            self._draws[stream] = np.zeros(self.num_envs, np.uint64)
        draws, steps, episodes = self._draws[stream][rows], self.steps[rows], self._episodes[rows]
        key = self._key(stream)[:, rows]
        n, size = len(draws), prod(shape)
        blocks = (size + 1) // 2
        if n * blocks <= _FEW:
            counters = zip(draws.tolist(), steps.tolist(), episodes.tolist(), key.T.tolist(), strict=True)
            words = [philox4x32((i, *counter), k) for *counter, k in counters for i in range(blocks)]
            numbers = np.array([number for w in words for number in _fractions(w)])
        else:
            counter = (np.arange(blocks, dtype=np.uint64), draws[:, None], steps[:, None], episodes[:, None])
            numbers = np.stack(_fractions(philox4x32(counter, (key[0, :, None], key[1, :, None]))), axis=-1)
        self._draws[stream][rows] += np.uint64(1)
        return numbers.reshape(n, 2 * blocks)[:, :size].reshape(n, *shape)


def _fractions(words: Sequence[Any]) -> tuple[Any, Any]:
    """Convert four words into two numbers in [0, 1), with 53 bits each."""
    w0, w1, w2, w3 = words
    unit = 1.0 / 9007199254740992.0  # 2⁻⁵³
    return ((w0 >> 5) * 67108864 + (w1 >> 6)) * unit, ((w2 >> 5) * 67108864 + (w3 >> 6)) * unit
