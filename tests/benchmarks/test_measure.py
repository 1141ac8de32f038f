from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import measure


@pytest.mark.needs("pybullet")
@pytest.mark.slow
def test_the_page_says_what_was_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measure, "STEPS", {1: 20, 8: 10})
    small = {case: {1: budgets[1], 8: 1.08} for case, budgets in measure.BUDGETS.items()}
    monkeypatch.setattr(measure, "BUDGETS", small)
    monkeypatch.setattr(measure, "PYBULLET_STEPS", 20)
    octants = {"+x+y+z": {"success_rate": 0.9, "episodes": 10}}
    trained = {
        "seed": 3,
        "steps": 1000,
        "seconds": 2.0,
        "success_rate": 0.95,
        "success_interval": [0.9, 1.0],
        "success_by_octant": octants,
    }
    page = measure.report(
        measure.step_costs(),
        [{"controller": controller, **trained} for controller in measure.CONTROLLERS],
        [{"algorithm": "ppo", "parts": {"simulation": 0.045, "updates": 0.09}, "steps_per_second": 7407.0}],
        measure.import_seconds(repeats=1),
        11e6,
        measure.pybullet_cost(),
        measure.worker_times(rounds=1),
    )
    assert page.count("| frobs/KobukiMaze-v0 | differential_drive | ") == 2
    assert page.count("| arm, gripper and cube | ") == 2
    assert "| 3 | 1,000 | 2.0 s | 95.0% | 90.0% to 100.0% | 90.0% |" in page
    assert "times as fast (goal: at least 1.5)" in page
    assert "median 2.0 s (at most 5 s)" in page
    assert "| `ppo` | 45.0 ms | 90.0 ms | 7,407 |" in page
