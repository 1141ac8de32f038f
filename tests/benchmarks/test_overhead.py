from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import overhead


def test_both_are_measured() -> None:
    row = overhead.measure("td3", num_envs=2, gradient_steps=0, steps=200, rounds=1)
    assert row["ratio"] == row["ours"] / row["plain"] > 0.0


@pytest.mark.slow
def test_a_race_ends_at_its_goal_and_the_page_tells_both_tables() -> None:
    found = overhead.race(num_envs=2, gradient_steps=1, seed=0, steps=2000)
    assert found["steps"] == 2000
    row = {"algorithm": "sac", "num_envs": 1, "gradient_steps": 1, "plain": 100.0, "ours": 90.0, "ratio": 0.9}
    page = overhead.report([row], [[found]])
    assert "| `sac` | 1 | 1 | 100 /s | 90 /s | 0.900 (missed) |" in page
    assert f"| 2 | 1 | 1 | {found['steps']:,} | {found['seconds']:.0f} |" in page
