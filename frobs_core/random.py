"""Random numbers that depend on nothing but an environment's seed, its episode, its step and a stream's name.

The source is counter-based: Philox 4×32 with 10 rounds (Salmon, Moraes, Dror, Shaw: "Parallel random numbers:
as easy as 1, 2, 3", SC 2011). So one call serves all environments, and neither their number nor how often another
stream is drawn changes what an environment gets.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import lru_cache
from math import prod

import numpy as np
import numpy.typing as npt

from frobs_core.arrays import Floats, Mask

_MULTIPLIERS = (np.uint64(0xD2511F53), np.uint64(0xCD9E8D57))
_WEYL = (0x9E3779B9, 0xBB67AE85)
_LOW = np.uint64(0xFFFFFFFF)
_HALF = np.uint64(32)

Words = npt.NDArray[np.uint64]
"""Unsigned 32-bit words, held in 64 bits so that products fit."""


def philox4x32(counter: Sequence[Words], key: Sequence[Words]) -> list[Words]:
    """Return Philox 4×32-10 of broadcastable arrays.

    Args:
        counter: Four arrays of 32-bit words.
        key: Two arrays of 32-bit words.

    Returns:
        Four arrays of 32-bit words.
    """
    c0, c1, c2, c3 = counter
    k0, k1 = key
    for i in range(10):
        p0 = _MULTIPLIERS[0] * c0
        p1 = _MULTIPLIERS[1] * c2
        bump0, bump1 = np.uint64(i * _WEYL[0] & 0xFFFFFFFF), np.uint64(i * _WEYL[1] & 0xFFFFFFFF)
        c0, c2 = (p1 >> _HALF) ^ c1 ^ ((k0 + bump0) & _LOW), (p0 >> _HALF) ^ c3 ^ ((k1 + bump1) & _LOW)
        c1, c3 = p1 & _LOW, p0 & _LOW
    return [c0, c1, c2, c3]


@lru_cache(maxsize=1024)
def _stream_number(stream: str) -> int:
    return int.from_bytes(hashlib.blake2b(stream.encode(), digest_size=8).digest(), "little")


def _mix(x: Words) -> Words:
    """Spread neighbouring numbers over 64 bits (the finaliser of SplitMix64, Steele, Lea, Flood 2014)."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


class RandomSource:
    """Streams of random numbers for ``num_envs`` environments.

    What a stream gives depends on the environment's seed, its episode, its step, the stream's name, and how often that
    stream was drawn in this step.

    Args:
        num_envs: ≥ 1.
    """

    def __init__(self, num_envs: int) -> None:
        self.num_envs = num_envs
        self._seeds: Words = np.zeros(num_envs, np.uint64)
        self._episodes: Words = np.zeros(num_envs, np.uint64)
        self._steps: Words = np.zeros(num_envs, np.uint64)
        self._draws: dict[str, Words] = {}

    def seed(self, seeds: Sequence[int] | Words, mask: Mask | None = None) -> None:
        """Give the environments of ``mask`` seeds (taken modulo 2⁶⁴); their next episode is number 0."""
        rows = slice(None) if mask is None else mask
        self._seeds[rows] = [int(seed) & 0xFFFFFFFFFFFFFFFF for seed in seeds]
        self._episodes[rows] = np.uint64(0xFFFFFFFF)  # begin_episode counts up to 0

    def begin_episode(self, mask: Mask | None = None) -> None:
        """Count an episode, and start at step 0 of it."""
        rows = slice(None) if mask is None else mask
        self._episodes[rows] = (self._episodes[rows] + np.uint64(1)) & _LOW
        self._steps[rows] = 0
        for draws in self._draws.values():
            draws[rows] = 0

    def begin_step(self) -> None:
        """Count a step of every environment."""
        self._steps += np.uint64(1)
        if self._draws:
            self._draws.clear()

    def uniform(
        self,
        stream: str,
        low: float | Floats = 0.0,
        high: float | Floats = 1.0,
        shape: tuple[int, ...] = (),
        mask: Mask | None = None,
    ) -> Floats:
        """Draw from [low, high).

        Args:
            stream: Name of what is drawn: ``"goal"``.
            low: Broadcasts to (n, …shape).
            high: Broadcasts to (n, …shape).
            shape: Of one environment's numbers.
            mask: The n environments.

        Returns:
            (n, …shape) float64, in the order of the environments.
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
        """Draw from a normal distribution; the arguments are those of :meth:`uniform`."""
        pairs = self._unit(stream, (2, *shape), mask)  # Box and Muller 1958
        return mean + std * np.sqrt(-2.0 * np.log1p(-pairs[:, 0])) * np.cos(2.0 * np.pi * pairs[:, 1])

    def integers(
        self, stream: str, low: int, high: int, shape: tuple[int, ...] = (), mask: Mask | None = None
    ) -> npt.NDArray[np.int64]:
        """Draw whole numbers from [low, high); (n, …shape) int64."""
        return low + np.floor((high - low) * self._unit(stream, shape, mask)).astype(np.int64)

    def snapshot(self) -> dict[str, npt.NDArray[np.uint64]]:
        """Return the complete state between two steps."""
        return {"seeds": self._seeds.copy(), "episodes": self._episodes.copy(), "steps": self._steps.copy()}

    def restore(self, snapshot: dict[str, npt.NDArray[np.uint64]]) -> None:
        """Return to a snapshot."""
        self._seeds[:], self._episodes[:] = snapshot["seeds"], snapshot["episodes"]
        self._steps[:] = snapshot["steps"]
        self._draws.clear()

    def _unit(self, stream: str, shape: tuple[int, ...], mask: Mask | None) -> Floats:
        """Draw from [0, 1) with 53 bits; (n, *shape)."""
        rows = slice(None) if mask is None else mask
        seeds, steps, episodes = self._seeds[rows], self._steps[rows], self._episodes[rows]
        draws = self._draws.setdefault(stream, np.zeros(self.num_envs, np.uint64))
        size = prod(shape)
        blocks = np.arange((size + 1) // 2, dtype=np.uint64)
        key = _mix(seeds + np.uint64(_stream_number(stream)))[:, None]
        words = philox4x32(
            (blocks[None, :], draws[rows][:, None], steps[:, None], episodes[:, None]), (key & _LOW, key >> _HALF)
        )
        draws[rows] += np.uint64(1)
        halves = [(words[i] >> np.uint64(5)) * 67108864.0 + (words[i + 1] >> np.uint64(6)) for i in (0, 2)]
        numbers = np.stack(halves, axis=-1).reshape(len(seeds), -1)[:, :size]  # (n, size)
        return (numbers * (1.0 / 9007199254740992.0)).reshape(len(seeds), *shape)
