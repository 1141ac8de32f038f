"""Faults in environments of our own: the real one with one thing broken."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_devkit.testing import Check, CheckFailure, Inconclusive, check_env, run_checks
from frobs_devkit.testing.environment import vector

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
    def _check_box(self, action: Any) -> Any:
        self.simulation.step(1)
        return super()._check_box(action)


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
        self.noise = 1e-7 * (num_threads == 2)

    def step(self, actions: Any) -> Any:
        return super().step(actions + np.float32(self.noise))


class StatisticOverTheBatch(RobotVectorEnv):
    def step(self, actions: Any) -> Any:
        observation, reward, *result = super().step(actions)
        return observation, reward - reward.mean() + reward.mean(), *result


class EndsAtRandom(RobotEnv):
    """Says 'terminated' where it means 'truncated'."""

    def step(self, action: Any) -> Any:
        observation, reward, terminated, truncated, info = super().step(action)
        return observation, reward, terminated or self.simulation.time[0] > 0.75, truncated, info


class RewardOfTheStepBefore(RobotEnv):
    before = 0.0

    def step(self, action: Any) -> Any:
        observation, reward, *result = super().step(action)
        self.before, reward = reward, self.before
        return observation, reward, *result


class ObservationOfTheStepBefore(RobotEnv):
    def reset(self, **keywords: Any) -> Any:
        self.before, info = super().reset(**keywords)
        return self.before.copy(), info

    def step(self, action: Any) -> Any:
        observation, *result = super().step(action)
        self.before, observation = observation, self.before
        return observation, *result


class SuccessOfTheStepBefore(RobotEnv):
    before = 0.0

    def step(self, action: Any) -> Any:
        *result, info = super().step(action)
        late, self.before = self.before, info["is_success"]
        return *result, {**info, "is_success": late}


class KeysOfAnybody(RobotEnv):
    def step(self, action: Any) -> Any:
        *result, info = super().step(action)
        return *result, {**info, "distance": 0.5}


FAULTS = {
    "ends_have_their_reason": [EndsAtRandom],
    "step_shows_its_action": [RewardOfTheStepBefore, ObservationOfTheStepBefore],
    "info_keys_have_their_prefix": [KeysOfAnybody],
    "time_advances": [SlowClock, StepsTwice],
    "step_needs_reset": [StepsWithoutReset, StepsAfterEnd],
    "unknown_keyword_refused": [TakesAnything],
    "bad_actions_refused": [NanPasses, AnyShapePasses, RefusalMoves],
    "reset_options_hold": [OptionIgnored, UnknownOptionPasses],
    "success_in_every_step": [SuccessMissing],
    "success_belongs_to_its_step": [SuccessOfTheStepBefore],
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
        found.run()
    except CheckFailure:
        return
    except Inconclusive as reason:
        if "cannot render" in str(reason):
            pytest.skip(f"not applicable: {reason}")
        raise
    pytest.fail("not caught")


def test_a_message_says_what_there_is_and_what_should_be(find: Any) -> None:
    with pytest.raises(
        CheckFailure,
        match=r"a step of a batch before the first reset does not raise an error; it must raise ResetNeeded",
    ):
        find(StepsAfterEnd, "step_needs_reset").run()


class SlowPictureClock(RobotEnv):
    """Its time runs at another pace than it says."""

    def __init__(self, **keywords: Any) -> None:
        super().__init__(**keywords)
        self.metadata = {**self.metadata, "render_fps": 60}


class StepsAfterEndUnasked(RobotVectorEnv):
    def step(self, actions: Any) -> Any:
        if self.autoreset_mode is AutoresetMode.DISABLED:
            self._ended[:] = False
        return super().step(actions)


class RandomizedRowsMix(RobotVectorEnv):
    def step(self, actions: Any) -> Any:
        observation, reward, *result = super().step(actions)
        if self.randomization is not None and self.metadata["autoreset_mode"] is AutoresetMode.DISABLED:
            reward = reward + 1e-9 * np.arange(len(reward))
        return observation, reward, *result


SEPARATE = {
    "time_advances": SlowPictureClock,
    "step_needs_reset": StepsAfterEndUnasked,
    "unknown_keyword_refused": TakesAnything,
    "bad_actions_refused": NanPasses,
    "reset_options_hold": UnknownOptionPasses,
    "threads_agree": ThreadsMatter,
    "randomized_equals_single": RandomizedRowsMix,
}
"""Faults that one check catches, and no other."""
INSEPARABLE = {
    "step_shows_its_action": "what is of the step before is, in a batch, not what the single environment says",
    "ends_have_their_reason": "an end for no reason is one that the batch, whose task is asked, does not have",
    "info_keys_have_their_prefix": "a key of one environment is not in the batch's info",
    "terms_sum_to_reward": "a term of one environment is not that of the batch",
    "snapshot_continues": "what a snapshot lacks, it lacks with randomisation too",
    "randomized_state_is_complete": "with snapshot_continues, which it is with more in the state",
}


@pytest.mark.slow
@pytest.mark.parametrize(("check", "faulty"), SEPARATE.items(), ids=SEPARATE)
def test_no_other_check_catches(find: Any, monkeypatch: pytest.MonkeyPatch, check: str, faulty: type) -> None:
    find(faulty, check)
    monkeypatch.setattr(vector, "STEPS", 45)
    # No other process knows an ID of this file: fresh_process has its own fault, on an environment that it can import.
    checks = [one for one in check_env(f"kit/{faulty.__name__}-v0") if one.name != "fresh_process"]
    assert [result.name for result in run_checks(checks).failed] == [check]


def test_every_check_has_a_fault_that_no_other_catches() -> None:
    from test_kit_environments import SEPARATE as OF_OTHERS

    elsewhere = {"sensors_may_be_bad"}  # see tests/sensors
    elsewhere |= {"expert_passes_the_checks_of_policies"}  # see test_kit_policies
    elsewhere |= {
        "success_comes_and_goes",
        "options_hold_by_row",
        "approaching_pays",
        "success_belongs_to_its_step",
    }  # see test_kit_tasks
    elsewhere |= {"actions_move_their_joints", "terms_fill_their_columns"}  # see tests/planted_faults
    caught = {check for _, check in OF_OTHERS} | SEPARATE.keys() | elsewhere
    assert not caught & INSEPARABLE.keys()
    assert caught | INSEPARABLE.keys() == {check.name for check in check_env("CartPole-v1")}
