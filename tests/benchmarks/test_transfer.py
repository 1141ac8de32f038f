from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import transfer


def test_the_page_says_what_was_measured() -> None:
    rows = transfer.measure(["tcp_delta_position"], ["mujoco"], episodes=4, steps=1024)
    home = {**rows[0], "success_rate": 0.8, "success_interval": (0.7, 0.9), "seconds": 12.0}
    page = transfer.report([home, {**home, "evaluated_on": "pybullet", "success_rate": 0.76}], episodes=4)
    assert "| `tcp_delta_position` | mujoco | 12 s | pybullet | 76.0% | 70.0% to 90.0% | 95.0% |" in page
