"""Statistics for few seeds, following Agarwal et al. (2021), "Deep RL at the edge of the statistical precipice"."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from frobs_core.util.arrays import Floats

RESAMPLES = 10_000
"""Number of bootstrap samples per interval. Changing the random seed moves the bounds by less than 1 % of the interval
width.
"""

LEAST_RUNS = 3
"""Number of runs below which no interval is given."""

_SEED = 0
_BLOCK = 2_000_000  # random numbers drawn at once
_LEVELS = (2.5, 97.5)  # percentiles that bound a 95 % interval


@dataclass(frozen=True)
class Estimate:
    """A value with its 95 % confidence interval.

    The bounds are None if there is no interval: if a group or stratum has fewer than three runs, or if all runs have the
    same result.
    """

    value: float
    low: float | None
    high: float | None


def interquartile_mean(values: Floats, axis: int = -1) -> Floats:
    """Return the mean of the middle half of the values along an axis, as float64.

    The lowest and the highest quarter, rounded down as in SciPy's ``trim_mean`` and in rliable, are dropped.
    """
    ordered = np.sort(np.moveaxis(np.asarray(values, np.float64), axis, -1), axis=-1)
    count = ordered.shape[-1]
    cut = count // 4
    return np.asarray(ordered[..., cut : count - cut].mean(axis=-1))


def estimate(strata: Sequence[Floats]) -> Estimate:
    """Estimate the interquartile mean over all strata, with a stratified bootstrap interval."""
    return _bootstrap(strata, lambda drawn: interquartile_mean(np.concatenate(drawn, axis=-1)))


def probability_of_improvement(first: Floats, second: Floats) -> Estimate:
    """Estimate the probability that a run of the first group beats a run of the second: P(X > Y) + P(X = Y) / 2."""
    return _bootstrap([first, second], lambda drawn: _wins(*drawn))


def band(curves: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the interquartile mean of curves (seeds, points), and the bounds of its 95 % interval, (points,) each."""
    curves = np.asarray(curves, np.float64)
    rng = np.random.default_rng(_SEED)
    # Resample whole curves, because the points of a curve are correlated.
    rows = rng.integers(len(curves), size=(RESAMPLES // 5, len(curves)))
    middles = np.stack([interquartile_mean(curves[:, point][rows]) for point in range(curves.shape[1])], axis=-1)
    low, high = np.percentile(middles, _LEVELS, axis=0)
    return interquartile_mean(curves, axis=0), low, high


def profile(strata: Sequence[Floats], thresholds: Floats) -> tuple[Floats, Floats, Floats]:
    """Return a performance profile: the fraction of runs whose result is above each of the thresholds (points,).

    Each stratum contains the results in one environment. The fraction is followed by the bounds of its 95 % stratified
    bootstrap interval, (points,) each.
    """
    arrays = [np.asarray(stratum, np.float64) for stratum in strata]
    above = [(array[:, None] > thresholds).astype(np.float64) for array in arrays]
    rng = np.random.default_rng(_SEED)
    count = sum(map(len, arrays))
    total = np.zeros((RESAMPLES // 5, len(thresholds)))
    for rows in above:
        drawn = rng.integers(len(rows), size=(len(total), len(rows)))
        for column in range(len(rows)):
            total += rows[drawn[:, column]]
    low, high = np.percentile(total / count, _LEVELS, axis=0)
    return np.concatenate(above).mean(axis=0), low, high


def _bootstrap(groups: Sequence[Floats], statistic: Callable[[list[Floats]], Floats]) -> Estimate:
    arrays = [np.asarray(group, np.float64) for group in groups]
    value = float(statistic(arrays))
    if min(len(array) for array in arrays) < LEAST_RUNS:
        return Estimate(value, None, None)
    drawn = np.concatenate([statistic(resampled) for resampled in _resamples(arrays)])
    low, high = np.percentile(drawn, _LEVELS)
    return Estimate(value, float(low), float(high)) if low < high else Estimate(value, None, None)


def _resamples(arrays: Sequence[Floats]) -> Iterator[list[Floats]]:
    """Yield blocks of bootstrap samples, with one (samples, values) array for each input array."""
    rng = np.random.default_rng(_SEED)
    sizes = [len(array) for array in arrays]
    block = max(1, min(RESAMPLES, _BLOCK // (sum(sizes) * max(sizes))))
    for start in range(0, RESAMPLES, block):
        count = min(block, RESAMPLES - start)
        yield [array[rng.integers(len(array), size=(count, len(array)))] for array in arrays]


def _wins(first: Floats, second: Floats) -> Floats:
    """Return the fraction of value pairs in which the first value is larger, counting ties as one half."""
    difference = first[..., :, None] - second[..., None, :]
    return np.asarray(((difference > 0) + 0.5 * (difference == 0)).mean(axis=(-2, -1)))
