"""What a step runs: few enough files and calls to read them all."""

from __future__ import annotations

import sys
from collections import Counter
from contextlib import closing
from pathlib import Path

import gymnasium as gym
import pytest

REACH = {"env.py", "joint_delta_position.py", "robot.py", "simulation.py", "reach.py", "task.py"}


def traced_calls(id: str) -> Counter[Path]:
    """Return the number of calls of FRobs's functions in one step without wrappers, by source file."""
    calls: Counter[Path] = Counter()

    def count(frame, event, argument):
        if event == "call" and frame.f_globals.get("__name__", "").startswith("frobs_"):
            calls[Path(frame.f_code.co_filename)] += 1

    with closing(gym.make(f"frobs_core:{id}").unwrapped) as env:
        env.reset(seed=0)
        action = env.action_space.sample()
        env.step(action)  # the first step binds what later steps read
        sys.setprofile(count)
        try:
            env.step(action)
        finally:
            sys.setprofile(None)
    return calls


def test_a_step_of_reaching_runs_code_of_six_files():
    calls = traced_calls("frobs/Irb120Reach-v0")
    assert {file.name for file in calls} == REACH
    assert len(calls) == len(REACH)
    assert calls.total() <= 28


@pytest.mark.parametrize(
    ("id", "most_calls", "most_files"),
    [("frobs/PandaPickAndPlace-v0", 62, 16), ("frobs/KobukiMaze-v0", 82, 22)],
    ids=["pick and place", "maze"],
)
def test_a_step_makes_few_calls(id, most_calls, most_files):
    calls = traced_calls(id)
    assert calls.total() <= most_calls, calls
    assert len(calls) <= most_files, calls
