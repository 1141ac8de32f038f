from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import algorithms
from tasks import Case, measure

from frobs_core import plugins


@pytest.mark.slow
def test_the_page_says_what_each_seed_came_to(tmp_path: Path) -> None:
    case = Case("frobs/Irb120Reach-v0", "td3", controller="tcp_delta_position")
    row = measure(case, 0, episodes=4, steps=256, kept=tmp_path, other_simulator=None)
    assert row["steps"] == 256
    assert row["pybullet"] is None
    rows = [
        {**row, "seconds": seconds, "mujoco": {"success_rate": success}}
        for seconds, success in ((30, 0.97), (40, 0.94), (50, 0.99))
    ]
    page = algorithms.report({case: rows}, episodes=4)
    assert "`tcp_delta_position` | 3 | 256 | 40 s | 94.0% (missed) | 97.0% | 99.0% |" in page


def test_what_is_measured_is_tuned() -> None:
    for case in algorithms.CASES:
        assert case.id in plugins.get_record("algorithm", case.algorithm).tuned  # type: ignore[attr-defined]
