from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import ros


def test_the_page_says_where_the_policy_succeeds_and_what_a_step_costs() -> None:
    cost = {"rate": 250.0, "median": 0.004, "late": 0.006}
    difference = {"title": "Step", "simulator": "gazebo", "quantity": "angle", "error": 0.012, "unit": "rad"}
    page = ros.report(
        {"gazebo": {"episodes": 200, "success_rate": 0.97}},
        {"episodes": 100, "success_rate": 0.95, "late": 0.01},
        [difference],
        cost,
        {"an environment step": cost},
    )
    assert "| gazebo | 200 | 97.0% |" in page
    assert "| ROS topics, on the bridge | 100 | 95.0% |" in page
    assert "| Step | gazebo | angle | 0.012 rad |" in page
    assert "| an environment step on real Gazebo | 250 (≥ 300: missed) | 4.00 ms | 6.00 ms |" in page
    assert "| the bridge: an environment step | 250 (≥ 100) | 4.00 ms | 6.00 ms |" in page


def test_times_are_taken() -> None:
    found = ros.timed(lambda: None, 50)
    assert 0.0 <= found["median"] <= found["late"]
