"""Statistics against SciPy's and rliable's own."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import trim_mean

from frobs_train.comparison.confidence import (
    Estimate,
    band,
    estimate,
    interquartile_mean,
    probability_of_improvement,
    profile,
)

values = st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=30).map(np.array)


@given(values)
@settings(max_examples=50, deadline=None)
def test_the_interquartile_mean_is_scipys(numbers: np.ndarray) -> None:
    np.testing.assert_allclose(interquartile_mean(numbers), trim_mean(numbers, 0.25), atol=1e-9)


def test_the_interquartile_mean_leaves_out_what_lies_far() -> None:
    assert interquartile_mean(np.array([0.0, 0.9, 1.0, 100.0])) == pytest.approx(0.95)
    assert interquartile_mean(np.array([[1.0, 2.0], [3.0, 4.0]]), axis=0).tolist() == [2.0, 3.0]


@pytest.mark.filterwarnings("ignore::FutureWarning", "ignore::DeprecationWarning")  # of its own libraries
def test_the_interval_is_rliables() -> None:
    from rliable import library, metrics

    rng = np.random.default_rng(1)
    scores = rng.normal([0.2, 0.5, 0.9], 0.1, (8, 3))  # (runs, environments)
    ours = estimate(list(scores.T))
    theirs, intervals = library.get_interval_estimates(
        {"a": scores}, lambda x: np.array([metrics.aggregate_iqm(x)]), reps=1000, random_state=np.random.RandomState(0)
    )
    assert ours.value == pytest.approx(theirs["a"][0])
    assert ours.low == pytest.approx(intervals["a"][0, 0], abs=0.015)
    assert ours.high == pytest.approx(intervals["a"][1, 0], abs=0.015)


def test_strata_are_drawn_apart() -> None:
    assert estimate([np.zeros(5), np.ones(5)]) == Estimate(0.5, None, None)  # mixed strata would have an interval


def test_the_profile_is_rliables() -> None:
    from rliable import library

    scores = np.random.default_rng(2).uniform(size=(8, 3))  # (runs, environments)
    thresholds = np.linspace(0.0, 1.0, 11)
    middle, low, high = profile(list(scores.T), thresholds)
    theirs, intervals = library.create_performance_profile({"a": scores}, thresholds, reps=1000)
    np.testing.assert_allclose(middle, theirs["a"])
    np.testing.assert_allclose([low, high], intervals["a"], atol=0.05)


@given(values, values)
@settings(max_examples=20, deadline=None)
def test_the_probability_of_improvement_counts_pairs(first: np.ndarray, second: np.ndarray) -> None:
    pairs = [(x > y) + 0.5 * (x == y) for x in first for y in second]
    found = probability_of_improvement(first[:5], second[:5])
    assert probability_of_improvement(first, second).value == pytest.approx(np.mean(pairs))
    assert found.value + probability_of_improvement(second[:5], first[:5]).value == pytest.approx(1.0)


def test_intervals_repeat_and_hold_the_estimate() -> None:
    scores = np.random.default_rng(0).uniform(size=9)
    first = estimate([scores])
    assert first == estimate([scores])
    assert first.low is not None
    assert first.high is not None
    assert first.low < first.value < first.high


def test_of_one_value_no_interval_is_told() -> None:
    found = estimate([np.array([0.7])])
    assert (found.value, found.low, found.high) == (0.7, None, None)


def test_a_single_run_beside_many_has_no_interval() -> None:
    many = np.linspace(0.0, 1.0, 10)
    assert probability_of_improvement(np.array([0.6]), many) == Estimate(0.6, None, None)
    assert estimate([many, np.array([0.6, 0.7])]).low is None
    assert probability_of_improvement(np.array([0.6, 0.7, 0.8]), many).low is not None


def test_a_band_holds_its_middle_and_closes_where_seeds_agree() -> None:
    curves = np.random.default_rng(0).normal(size=(6, 20)).cumsum(axis=1)
    curves[:, 0] = 3.0
    middle, low, high = band(curves)
    assert (low <= middle).all()
    assert (middle <= high).all()
    assert low[0] == high[0] == 3.0
