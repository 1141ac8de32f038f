from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from frobs_sim_pybullet import constraints


def problem(rng: np.random.Generator, n: int) -> tuple[np.ndarray, ...]:
    root = rng.normal(size=(n, n))
    limit = rng.uniform(0.1, 3.0, n)
    rubs = rng.random(n) < 0.7
    low, high = np.where(rubs, -limit, 0.0), np.where(rubs, limit, np.inf)
    return root @ root.T / n + np.diag(rng.uniform(0.01, 0.1, n)), 10.0 * rng.normal(size=n), low, high


@pytest.mark.parametrize("n", [1, 2, 5, 8, 16, 40])
def test_efforts_minimise_within_their_bounds(n: int) -> None:
    rng = np.random.default_rng(n)
    for _ in range(20):
        matrix, slope, low, high = problem(rng, n)
        efforts = constraints._minimise(matrix, slope, low, high)
        assert ((low <= efforts) & (efforts <= high)).all()
        gradient = matrix @ efforts + slope
        assert gradient[(low < efforts) & (efforts < high)] == pytest.approx(0.0, abs=1e-8)
        assert (gradient[efforts == low] >= -1e-8).all()
        assert (gradient[efforts == high] <= 1e-8).all()


def test_an_effort_that_is_tiny_beside_others_does_not_keep_the_sweeps_going(monkeypatch: pytest.MonkeyPatch) -> None:
    rounds: list[Any] = []
    sweep = constraints._sweep

    def counted(*given: Any) -> Any:
        rounds.append(given[-1])
        return sweep(*given)

    monkeypatch.setattr(constraints, "_sweep", counted)
    rng = np.random.default_rng(0)
    root = rng.normal(size=(40, 40))
    matrix = root @ root.T + np.diag(rng.uniform(1.0, 100.0, 40))
    wanted = np.concatenate([[1e-8], rng.uniform(50.0, 150.0, 39)])  # its rounding is that of the others
    efforts = constraints._minimise(matrix, -matrix @ wanted, np.full(40, -1e3), np.full(40, 1e3))
    assert efforts == pytest.approx(wanted, abs=1e-9)
    assert 1 < len(rounds) <= 5
