from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import algorithms

from frobs_core import plugins


def test_the_page_says_what_each_seed_came_to() -> None:
    case = ("td3", "frobs/Irb120Reach-v0", "tcp_delta_position")
    row = algorithms.measure(*case, seed=0, episodes=4, steps=256)
    assert row["steps"] == 256
    rows = [
        {**row, "seconds": seconds, "success": success} for seconds, success in ((30, 0.97), (40, 0.94), (50, 0.99))
    ]
    page = algorithms.report({case: rows}, seeds=[0, 1, 2], episodes=4)
    assert "`tcp_delta_position` | 32 | 256 | 40 s | 94.0% (missed) | 97.0% | 99.0% |" in page


def test_what_is_measured_is_tuned() -> None:
    for algorithm, environment, _ in algorithms.CASES:
        assert environment in plugins.get_record("algorithm", algorithm).tuned  # type: ignore[attr-defined]
