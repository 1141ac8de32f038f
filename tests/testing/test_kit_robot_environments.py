"""Faults in environments of our own: the real one with one thing broken."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.env import RobotEnv
from frobs_core.testing import Check, CheckFailure, Hollow, check_env
from frobs_core.vector_env import RobotVectorEnv

KEYWORDS = {"task": "reach", "robot": "irb120", "controller": "joint_delta_position"}


class SlowClock(RobotEnv):
    def __init__(self, **keywords: Any) -> None:
        super().__init__(**keywords)
        self.control_timestep *= 1.001


class StepsTwice(RobotEnv):
    def step(self, action: Any) -> Any:
        self.simulation.step(1)
        return super().step(action)


class StepsWithoutReset(RobotEnv):
    def __init__(self, **keywords: Any) -> None:
        super().__init__(**keywords)
        self._running = True


class TakesAnything(RobotEnv):
    def __init__(self, *, no_such_parameter: int = 0, **keywords: Any) -> None:
        super().__init__(**keywords)


class NanPasses(RobotEnv):
    def step(self, action: Any) -> Any:
        return super().step(np.nan_to_num(action))


class AnyShapePasses(RobotEnv):
    def step(self, action: Any) -> Any:
        return super().step(np.resize(action, 6))


class RefusalMoves(RobotEnv):
    def _check(self, action: Any) -> Any:
        self.simulation.step(1)
        return super()._check(action)


class OptionIgnored(RobotEnv):
    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        return super().reset(seed=seed, options={k: v for k, v in (options or {}).items() if k != "joint_positions"})


class UnknownOptionPasses(RobotEnv):
    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        return super().reset(seed=seed, options={k: v for k, v in (options or {}).items() if k != "no_such_option"})


class SuccessMissing(RobotEnv):
    def step(self, action: Any) -> Any:
        *result, info = super().step(action)
        return *result, {key: value for key, value in info.items() if key != "is_success"}


class RewardOffTerms(RobotEnv):
    def step(self, action: Any) -> Any:
        observation, reward, *result = super().step(action)
        return observation, reward + 1e-4, *result


class DrawsSmall(RobotEnv):
    def render(self) -> Any:
        return super().render()[::2]


class StepsAfterEnd(RobotVectorEnv):
    def step(self, actions: Any) -> Any:
        self._ended[:] = False
        return super().step(actions)


class ForgetsElapsed(RobotVectorEnv):
    def snapshot(self) -> Any:
        return {**super().snapshot(), "elapsed": np.zeros(self.num_envs, np.int64)}


class ForgetsRandomState(RobotVectorEnv):
    def restore(self, snapshot: Any) -> None:
        episodes = self._loop.rng.snapshot()["episodes"]
        super().restore({**snapshot, "random/episodes": episodes})


class ThreadsMatter(RobotVectorEnv):
    def __init__(self, num_envs: int = 1, *, num_threads: int = 0, **keywords: Any) -> None:
        super().__init__(num_envs, num_threads=num_threads, **keywords)
        self.noise = 1e-7 * (num_threads - 1)

    def step(self, actions: Any) -> Any:
        return super().step(actions + np.float32(self.noise))


class StatisticOverTheBatch(RobotVectorEnv):
    def step(self, actions: Any) -> Any:
        observation, reward, *result = super().step(actions)
        return observation, reward - reward.mean() + reward.mean(), *result


FAULTS = {
    "time_advances": [SlowClock, StepsTwice],
    "step_needs_reset": [StepsWithoutReset, StepsAfterEnd],
    "unknown_keyword_refused": [TakesAnything],
    "bad_actions_refused": [NanPasses, AnyShapePasses, RefusalMoves],
    "reset_options_hold": [OptionIgnored, UnknownOptionPasses],
    "success_in_every_step": [SuccessMissing],
    "terms_sum_to_reward": [RewardOffTerms],
    "render_draws": [DrawsSmall],
    "snapshot_continues": [ForgetsElapsed, ForgetsRandomState],
    "threads_agree": [ThreadsMatter],
    "same_step_equals_single": [StatisticOverTheBatch],
}


@pytest.fixture
def find() -> Iterator[Any]:
    registered = []

    def register(faulty: type, check: str) -> Check:
        single, batch = (faulty, RobotVectorEnv) if issubclass(faulty, RobotEnv) else (RobotEnv, faulty)
        id = f"kit/{faulty.__name__}-v0"
        gym.register(id, single, vector_entry_point=batch, max_episode_steps=20, kwargs=KEYWORDS)
        registered.append(id)
        return next(c for c in check_env(id) if c.name == check)

    yield register
    for id in registered:
        del gym.registry[id]


@pytest.mark.parametrize(
    ("check", "faulty"),
    [pytest.param(check, faulty, id=faulty.__name__) for check, faults in FAULTS.items() for faulty in faults],
)
def test_the_kit_catches(find: Any, check: str, faulty: type) -> None:
    found = find(faulty, check)
    try:
        outcome = found.run()
    except CheckFailure:
        return
    if isinstance(outcome, Hollow) and "no picture can be drawn" in outcome.reason:
        pytest.skip(outcome.reason)
    pytest.fail(f"not caught: {outcome}")


def test_a_message_says_what_there_is_and_what_should_be(find: Any) -> None:
    with pytest.raises(
        CheckFailure, match=r"a step of the batch before the first reset passes; it must raise ResetNeeded"
    ):
        find(StepsAfterEnd, "step_needs_reset").run()
