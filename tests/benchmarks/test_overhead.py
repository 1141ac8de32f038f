from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import overhead


def test_both_are_measured() -> None:
    row = overhead.measure("td3", num_envs=2, gradient_steps=0, steps=200, rounds=1)
    assert row["ratio"] == row["ours"] / row["plain"] > 0.0
