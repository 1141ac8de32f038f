"""Which files a step runs code of: few enough to read them all."""

from __future__ import annotations

import sys
from contextlib import closing
from pathlib import Path

import gymnasium as gym

STEP = {"env.py", "joint_delta_position.py", "robot.py", "simulation.py", "reach.py"}


def test_a_step_runs_code_of_five_files():
    files: set[Path] = set()

    def note(frame, event, argument):
        module = frame.f_globals.get("__name__", "")
        if event == "call" and module.startswith("frobs_"):
            files.add(Path(frame.f_code.co_filename))

    with closing(gym.make("frobs_core:frobs/Irb120Reach-v0")) as env:
        env.reset(seed=0)
        action = env.action_space.sample()
        env.step(action)
        sys.setprofile(note)
        try:
            env.step(action)
        finally:
            sys.setprofile(None)
    assert {file.name for file in files} == STEP
    assert len(files) == len(STEP)
