from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

pytest.importorskip("frobs_data")

import recording


def test_the_page_marks_figures_that_miss_their_goals() -> None:
    page = recording.report([(64, 512, (10.0, 12.0, 1.2)), (1, 40, (4.0, 4.4, 1.1))], 39.0, shared=True)
    assert "| 64 | 512 | 10.0 s | 12.0 s | 1.20 (missed) | 1.15 |" in page
    assert "| 1 | 40 | 4.0 s | 4.4 s | 1.10 | 1.15 |" in page
    assert "39 frames per second are recorded (missed)" in page
    assert "kept the machine busy" in page
