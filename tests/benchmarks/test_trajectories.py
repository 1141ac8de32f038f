from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("ompl")
pytest.importorskip("toppra")
pytest.importorskip("pinocchio")

sys.path.insert(0, str(Path(__file__).parent))

import trajectories


@pytest.mark.parametrize("target", ["joint", "tcp"])
def test_goals_among_boxes_are_reached_within_the_limits_and_without_a_touch(target: str) -> None:
    found = trajectories.measure(target, goals=15, seed=7)
    assert found["reached"] == 15
    assert found["collisions"] == 0
    assert found["velocity_share"] <= 1.0
    assert found["acceleration_share"] <= 1.0
    assert found["joint_error"] < 0.02
    assert found["straight"] < 15, "nothing was in the way"


def test_the_page_says_what_was_measured() -> None:
    found = trajectories.measure("joint", goals=1)
    known = {**found, "goals": 500, "reached": 499, "plan_times": [0.01, 0.02, 0.06], "processor_times": [0.01], "velocity_share": 0.995}
    known |= {"reasons": {"no_way_found": 1}, "durations": np.ones(499), "straight": 300}
    page = trajectories.report([known])
    assert '| | `target="joint"` |' in page
    assert "| reached | 499 (99.8%) |" in page
    assert "| no plan | 1 × no_way_found |" in page
    assert "| ways that are not one straight line | 199 |" in page
    assert "| planning, median | 20 ms |" in page
    assert "| largest velocity of the command, of the limit | 99.50% |" in page
