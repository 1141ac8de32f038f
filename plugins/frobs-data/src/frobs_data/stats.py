"""Statistics of features, in double precision, as LeRobot computes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from frobs_core.util.arrays import Floats
from frobs_data.errors import DataError
from frobs_data.layout import Feature, nested_lists
from frobs_data.tables import column_array

NAMES = ("min", "max", "mean", "std", "count", "q01", "q10", "q50", "q90", "q99")
"""Rows of an array of statistics, (10, k). Its columns are the elements of the features, see :func:`spans`."""

_MIN, _MAX, _MEAN, _STD, _COUNT, _QUANTILES = 0, 1, 2, 3, 4, slice(5, None)
_SHARES = np.array([0.01, 0.1, 0.5, 0.9, 0.99])


def shape_of(feature: Feature) -> tuple[int, ...]:
    """Return the shape of a feature's statistics: pictures have one number for each color, scaled to [0, 1]."""
    return (3, 1, 1) if feature.is_video else feature.shape


def spans(features: Mapping[str, Feature]) -> dict[str, slice]:
    """Return the columns of each number and camera in an array of statistics."""
    found, end = {}, 0
    for name, feature in features.items():
        if feature.is_video or feature.is_numeric:
            begin, end = end, end + int(np.prod(shape_of(feature)))
            found[name] = slice(begin, end)
    return found


def vector_stats(values: Floats) -> Floats:
    """Return the statistics, (10, k), of one episode's numbers, (n, k) float64."""
    last, ordered = len(values) - 1, np.sort(values, axis=0)
    low = (_SHARES * last).astype(np.int64)
    part = (_SHARES * last - low)[:, None]
    stats = np.empty((len(NAMES), values.shape[1]))
    stats[_MIN], stats[_MAX], stats[_COUNT] = ordered[0], ordered[-1], len(values)
    with np.errstate(invalid="ignore"):  # numbers that are not finite
        stats[_MEAN], stats[_STD] = values.mean(axis=0), values.std(axis=0)
        stats[_QUANTILES] = ordered[low] * (1 - part) + ordered[np.minimum(low + 1, last)] * part
    return stats


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

    def result(self) -> Floats:
        """Return the statistics of the pictures, (10, 3)."""
        levels, last = np.arange(256), int(self._counts[0].sum()) - 1
        sums = self._counts.cumsum(axis=1)

        def at(positions: np.ndarray[Any, Any]) -> Floats:
            return np.stack([np.searchsorted(row, positions, side="right") for row in sums], axis=-1).astype(float)

        stats = np.empty((len(NAMES), 3))
        stats[[_MIN, _MAX]] = at(np.array([0, last]))
        stats[_MEAN] = self._counts @ levels / (last + 1)
        variance = self._counts @ (levels * levels) / (last + 1) - stats[_MEAN] ** 2
        stats[_STD] = np.sqrt(np.maximum(variance, 0.0))
        low = (_SHARES * last).astype(np.int64)
        part = (_SHARES * last - low)[:, None]
        stats[_QUANTILES] = at(low) * (1 - part) + at(np.minimum(low + 1, last)) * part
        stats /= 255
        stats[_COUNT] = self._pictures
        return stats


def merge_stats(parts: Floats) -> Floats:
    """Combine the statistics of episodes, (n, 10, k). Quantiles are weighted means, as in LeRobot."""
    count = parts[:, _COUNT].sum(axis=0)
    weights = parts[:, _COUNT] / count
    merged: Floats = (weights[:, None] * parts).sum(axis=0)
    variance = parts[:, _STD] ** 2 + (parts[:, _MEAN] - merged[_MEAN]) ** 2
    merged[_MIN], merged[_MAX] = parts[:, _MIN].min(axis=0), parts[:, _MAX].max(axis=0)
    merged[_STD], merged[_COUNT] = np.sqrt((weights * variance).sum(axis=0)), count
    return merged


def stats_columns(features: Mapping[str, Feature], parts: Floats) -> dict[str, pa.Array]:
    """Return the columns of ``meta/episodes`` for the statistics of episodes, (n, 10, k).

    Features whose statistics are not known, which are NaN, have no columns.
    """
    columns = {}
    for name, span in spans(features).items():
        if np.isfinite(parts[:, :, span]).all():
            for row, key in enumerate(NAMES):
                values = parts[:, row, span]
                if row == _COUNT:
                    columns[f"stats/{name}/{key}"] = nested_lists(values[:, 0].astype(np.int64), (1,), fixed=False)
                else:
                    columns[f"stats/{name}/{key}"] = nested_lists(values.ravel(), shape_of(features[name]), fixed=False)
    return columns


def table_stats(features: Mapping[str, Feature], table: pa.Table, path: Path) -> Floats:
    """Return the statistics, (n, 10, k), in a table of ``meta/episodes``. Missing and invalid ones are NaN."""
    columns = spans(features)
    stats = np.full((len(table), len(NAMES), sum(span.stop - span.start for span in columns.values())), np.nan)
    for name, span in columns.items():
        for row, key in enumerate(NAMES):
            kind = Feature("float64", (1,) if row == _COUNT else shape_of(features[name]))
            with suppress(DataError, KeyError):
                values = column_array(table[f"stats/{name}/{key}"], kind, path, key)
                stats[:, row, span] = values.reshape(len(table), -1)
    stats.swapaxes(1, 2)[~(np.isfinite(stats).all(axis=1) & (stats[:, _COUNT] > 0))] = np.nan
    return stats


def stats_dict(stats: Floats, shape: Sequence[int]) -> dict[str, np.ndarray[Any, Any]]:
    """Return a feature's statistics, (10, k), by name: arrays of a shape, and ``count`` with one whole number."""
    found: dict[str, np.ndarray[Any, Any]] = {
        key: values.reshape(shape) for key, values in zip(NAMES, stats, strict=True)
    }
    return {**found, "count": stats[_COUNT, :1].astype(np.int64)}


def stats_json(features: Mapping[str, Feature], stats: Floats) -> dict[str, Any]:
    """Return the content of ``meta/stats.json`` for statistics, (10, k). Features that are NaN are left out."""
    return {
        name: stats_dict(stats[:, span], shape_of(features[name]))
        for name, span in spans(features).items()
        if np.isfinite(stats[:, span]).all()
    }
