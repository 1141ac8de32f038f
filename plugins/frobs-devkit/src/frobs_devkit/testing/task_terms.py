"""Checks of what a task offers beside its reward: named columns, and terms that can be read as often as one likes."""

from __future__ import annotations

from contextlib import closing
from copy import deepcopy
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode

from frobs_devkit.testing.checks import NotApplicable, Outcome, expect
from frobs_devkit.testing.compare import expect_same
from frobs_devkit.testing.environment.rollout import draw_actions
from frobs_devkit.testing.environment.subject import EnvUnderTest, inside


def columns_fit_the_observation(subject: EnvUnderTest) -> Outcome:
    """Named columns of the observation lie inside of it, none twice, none left out."""
    with closing(subject.make()) as env:
        columns = dict(inside(env).task.observation_columns())
        if not columns:
            return NotApplicable("the task names no columns")
        space = env.observation_space
        box = space["observation"] if isinstance(space, gym.spaces.Dict) else space
        assert box.shape is not None
        width = box.shape[-1]
        count = np.zeros(width, np.int64)
        for name, part in columns.items():
            expect(isinstance(part, slice), f"observation_columns()['{name}'] is {part!r}, no slice.")
            expect(
                0 <= (part.start or 0) < (width if part.stop is None else part.stop) <= width,
                f"observation_columns()['{name}'] is {part}, and the observation has {width} columns.",
            )
            count[part] += 1
        expect(
            (count == 1).all(),
            f"columns {np.flatnonzero(count != 1).tolist()} of the observation have no name, or two.",
        )
    return None


def reading_changes_nothing(subject: EnvUnderTest) -> Outcome:
    """Reward, terms, ends, success and marks can be read again: the same numbers, and the episode goes on the same."""
    plays = []
    for curious in (False, True):
        with closing(subject.make_vec(3, AutoresetMode.SAME_STEP)) as env:
            trace: list[Any] = [deepcopy(env.reset(seed=4)[0])]
            for action in draw_actions(env.action_space, 12, seed=4):
                trace.append(deepcopy(env.step(action)[:4]))
                if curious and not (trace[-1][2] | trace[-1][3]).any():
                    _read_twice(inside(env).task, trace[-1][1])
            plays.append(trace)
    for k, (quiet, read) in enumerate(zip(*plays, strict=True)):
        expect_same(quiet, read, f"step {k} where reward, ends and terms were read once more")
    return None


def _read_twice(task: Any, reward: Any) -> None:
    for what, read in {"reward()": task.reward, "is_success()": task.is_success}.items():
        expect_same(np.array(read()), np.array(read()), f"{what}, read again")
    expect_same(
        np.asarray(reward, np.float64), np.array(task.reward()), "reward() after the step, against the step's reward"
    )
    task.reward_terms()
    task.is_terminated()
    task.markers()
    task.snapshot()
