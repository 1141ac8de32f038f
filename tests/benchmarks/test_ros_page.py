from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import ros

COST = {"rate": 250.0, "median": 0.004, "late": 0.006}


def test_the_page_says_where_the_policy_succeeds_and_what_a_step_costs() -> None:
    difference = {"title": "Step", "simulator": "gazebo", "quantity": "angle", "error": 0.012, "unit": "rad"}
    difference |= {"allowed": 0.02, "where": "jump of elbow"}
    through = difference | {"simulator": ros.TOPICS, "allowed": None}
    success = {"episodes": 200, "success_rate": 0.8, "success_interval": (0.74, 0.85)}
    page = ros.report(
        {"mujoco": success | {"success_rate": 1.0}, "gazebo": success, ros.TOPICS: success | {"late": 0.01}},
        [difference, through],
        {"an environment step": COST, "physics": COST},
        {"Gazebo": 0.0015, "Python": 0.0005},
        {"an environment step": COST},
        1.25,
    )
    assert "| gazebo | 200 | 80.0% | 74.0% to 85.0% | 80.0% |" in page
    assert f"| {ros.TOPICS} | 200 | 80.0% |" in page
    assert "1.0% of the policy's steps were late" in page
    assert "| Step | gazebo | angle | 0.012 rad | 0.02 | jump of elbow |" in page
    assert f"| Step | {ros.TOPICS} | angle | 0.012 rad | – | jump of elbow |" in page
    assert "| an environment step | 250 (≥ 300: missed) | 4,000 µs | 6,000 µs |" in page
    assert "| an environment step | 250 (≥ 100) | 4,000 µs | 6,000 µs |" in page
    assert "| physics | 250 | 4,000 µs | 6,000 µs |" in page
    assert "1,500 µs in Gazebo and 500 µs in Python" in page
    assert "at most 500 steps per second" in page
    assert "1.2 other processes" in page


def test_times_are_taken() -> None:
    found = ros.timed(lambda: None, 50)
    assert 0.0 <= found["median"] <= found["late"]
