"""Statistics of features, in double precision, as LeRobot computes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

Stats: TypeAlias = dict[str, np.ndarray[Any, Any]]
"""``min``, ``max``, ``mean``, ``std`` and quantiles ``q01`` … ``q99`` of a feature, and ``count`` of its frames.

The arrays have the shape of the feature, or (3, 1, 1) for pictures, whose values are scaled to [0, 1].
"""

_QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
NAMES = ("min", "max", "mean", "std", "count", *_QUANTILES)


def vector_stats(columns: Mapping[str, np.ndarray[Any, Any]]) -> dict[str, Stats]:
    """Return the statistics of one episode's columns, each (n, k) or (n,). One pass over all columns is faster."""
    blocks = [values.reshape(len(values), -1) for values in columns.values()]
    flat = np.concatenate(blocks, axis=1, dtype=np.float64)
    found = {"min": flat.min(0), "max": flat.max(0), "mean": flat.mean(0), "std": flat.std(0)}
    found |= zip(_QUANTILES, np.quantile(flat, list(_QUANTILES.values()), axis=0), strict=True)
    ends = np.cumsum([block.shape[1] for block in blocks])
    return {
        name: {
            **{
                key: value[end - block.shape[1] : end].reshape(columns[name].shape[1:] or 1)
                for key, value in found.items()
            },
            "count": np.array([len(flat)]),
        }
        for name, block, end in zip(columns, blocks, ends, strict=True)
    }


class PictureStats:
    """Exact statistics of the pictures of one episode, from a histogram of each color.

    Large pictures are subsampled as LeRobot does.
    """

    def __init__(self) -> None:
        self._counts = np.zeros((3, 256), np.int64)
        self._pictures = 0

    def add(self, picture: np.ndarray[Any, Any]) -> None:
        """Add a picture, (height, width, 3) uint8."""
        step = max(1, min(picture.shape[:2]) // 150)
        for color in range(3):
            self._counts[color] += np.bincount(picture[::step, ::step, color].ravel(), minlength=256)
        self._pictures += 1

    def result(self) -> Stats:
        """Return the statistics of the pictures."""
        levels, total = np.arange(256), int(self._counts[0].sum())
        mean = self._counts @ levels / total
        variance = self._counts @ (levels * levels) / total - mean**2
        sums = self._counts.cumsum(axis=1)

        def at(position: int) -> np.ndarray[Any, Any]:
            return np.array([np.searchsorted(row, position, side="right") for row in sums], float)

        found = {"min": at(0), "max": at(total - 1), "mean": mean, "std": np.sqrt(np.maximum(variance, 0.0))}
        for name, share in _QUANTILES.items():
            position = share * (total - 1)
            low, part = int(position), position % 1
            found[name] = at(low) * (1 - part) + at(min(low + 1, total - 1)) * part
        scaled = {name: value.reshape(3, 1, 1) / 255 for name, value in found.items()}
        return {**scaled, "count": np.array([self._pictures])}


def merge_stats(parts: Sequence[Stats]) -> Stats:
    """Combine the statistics of several episodes. Quantiles are weighted means, as in LeRobot."""
    counts = np.array([float(part["count"][0]) for part in parts])
    weights = (counts / counts.sum()).reshape(-1, *[1] * parts[0]["mean"].ndim)
    stacked = {name: np.stack([part[name] for part in parts]) for name in NAMES if name != "count"}
    mean = (weights * stacked["mean"]).sum(0)
    return {
        "min": stacked["min"].min(0),
        "max": stacked["max"].max(0),
        "mean": mean,
        "std": np.sqrt((weights * (stacked["std"] ** 2 + (stacked["mean"] - mean) ** 2)).sum(0)),
        "count": np.array([int(counts.sum())]),
        **{name: (weights * stacked[name]).sum(0) for name in _QUANTILES},
    }
