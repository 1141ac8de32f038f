from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

pytest.importorskip("frobs_view")

import view


def test_the_page_marks_figures_that_miss_their_goals() -> None:
    cost = {"step": 0.7, "alone": 0.7, "update": 1.6, "rate": 29.5}
    load = {"after": 200.0, "growth": 19.0, "steps": 900.0, "part": 1}
    page = view.report(cost, [(100.0, 97.0), (100.0, 98.0), (100.0, 101.0)], load, shared=True)
    assert "| processor time of an update | 1.60 ms (missed) | ≤ 1.5 ms |" in page
    assert "| updates per second at a client | 29.5 | ≥ 25 |" in page
    assert "(median of 3 pairs) | 0.980 (missed) | ≥ 0.99 |" in page
    assert "| growth of the resident memory under load | 19.0 MB | ≤ 20 MB |" in page
    assert "kept the machine busy" in page
