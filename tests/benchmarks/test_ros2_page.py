"""The page of the measurements with ROS 2."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import ros2


def test_the_page_has_latencies_losses_and_successes() -> None:
    trip = {"sent": 2_000, "arrived": 1_998, "median": 0.8, "late": 3.0, "cpu": 0.6}
    success = {"success_rate": 0.98, "success_interval": (0.96, 0.99)}
    page = ros2.report({"the policy node": trip}, [("frobs/Irb120Reach-v0", success, success)], 500)
    assert "| the policy node | 0.80 ms | 3.00 ms | 2 of 2,000 | 0.60 ms |" in page
    assert "| `frobs/Irb120Reach-v0` | 98.0% (96.0% to 99.0%) | 98.0% (96.0% to 99.0%) |" in page
