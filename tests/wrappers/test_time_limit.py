import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from frobs_core.util.errors import ConfigurationError, ResetNeededError
from frobs_rl_compat.wrappers import NormalizeActionWrapper, NormalizeObservationWrapper, TimeLimitWrapper


class Reach(gym.Env):
    """Terminates with success in step ``goal``; says ``is_success`` only then, as FRobs_RL's tasks do."""

    observation_space = action_space = gym.spaces.Box(-1.0, 1.0, (1,))

    def __init__(self, goal=10**6):
        self._goal = goal

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._steps = 0
        return np.zeros(1, np.float32), {"seed": seed}

    def step(self, action):
        self._steps += 1
        done = self._steps >= self._goal
        return np.zeros(1, np.float32), 0.0, done, False, {"is_success": 1.0} if done else {}


def run(env, steps):
    env.reset()
    return [env.step(np.zeros(1))[2:] for _ in range(steps)]


def test_the_limit_truncates_and_does_not_terminate():
    *before, last = run(TimeLimitWrapper(Reach(), max_steps=5), 5)
    assert all(step == (False, False, {}) for step in before)
    assert last == (False, True, {"time_limit_reached": True, "is_success": 0.0})


def test_the_default_is_a_hundred_steps():
    steps = run(TimeLimitWrapper(Reach()), 100)
    assert [truncated for _, truncated, _ in steps] == [False] * 99 + [True]


def test_success_on_the_last_step_stays_a_success():
    last = run(TimeLimitWrapper(Reach(goal=5), max_steps=5), 5)[-1]
    assert last == (True, True, {"time_limit_reached": True, "is_success": 1.0})


def test_an_episode_that_ends_before_the_limit_says_so():
    last = run(TimeLimitWrapper(Reach(goal=3), max_steps=5), 3)[-1]
    assert last == (True, False, {"time_limit_reached": False, "is_success": 1.0})


def test_legacy_terminates_too_and_keeps_success():
    assert run(TimeLimitWrapper(Reach(), max_steps=5, legacy=True), 5)[-1][:2] == (True, True)
    last = run(TimeLimitWrapper(Reach(goal=5), max_steps=5, legacy=True), 5)[-1]
    assert last[2]["is_success"] == 1.0


def test_a_reset_starts_counting_anew_and_keeps_the_inner_info():
    env = TimeLimitWrapper(Reach(), max_steps=3)
    run(env, 2)
    assert env.reset(seed=4)[1] == {"seed": 4}
    assert [env.step(np.zeros(1))[3] for _ in range(3)] == [False, False, True]


def test_a_step_before_the_first_reset_is_refused():
    with pytest.raises(ResetNeededError, match="call reset"):
        TimeLimitWrapper(Reach()).step(np.zeros(1))


@pytest.mark.parametrize("value", [0, -1, 2.5, "100", True, None], ids=repr)
def test_the_limit_must_be_a_whole_number(value):
    with pytest.raises(ConfigurationError, match="it must be a whole number of at least 1"):
        TimeLimitWrapper(Reach(), max_steps=value)


def test_the_spec_rebuilds_the_wrapper():
    again = gym.make(TimeLimitWrapper(gym.make("Pendulum-v1"), max_steps=7, legacy=True).spec)
    assert isinstance(again, TimeLimitWrapper)
    assert (again.max_steps, again.legacy) == (7, True)


@pytest.mark.filterwarnings("ignore:.*is different from the unwrapped version:UserWarning")
def test_gymnasiums_checker_passes_on_all_three_in_frobs_rls_order():
    env = NormalizeActionWrapper(gym.make("Pendulum-v1"))
    env = TimeLimitWrapper(NormalizeObservationWrapper(env), max_steps=15)
    check_env(env, skip_render_check=True)
    env.reset(seed=0)
    steps = [env.step(env.action_space.sample()) for _ in range(15)]
    assert all(observation in env.observation_space for observation, *_ in steps)
    assert steps[-1][4]["time_limit_reached"] is True
