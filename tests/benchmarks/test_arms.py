from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import arms


@pytest.mark.slow
def test_the_page_says_what_was_measured() -> None:
    row = arms.measure("tcp_delta_position", "KUKA iiwa", episodes=4, steps=1024)
    known = {**row, "seconds": 30.0, "success_rate": 0.9, "success_interval": (0.8, 0.95)}
    page = arms.report([known], episodes=4)
    assert "| KUKA iiwa | `pybullet_data/kuka_iiwa/model.urdf` | – | `tcp_delta_position` | 1,024 |" in page
    assert "| 30 s | 90.0% | 80.0% to 95.0% |" in page
