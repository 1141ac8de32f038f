"""Environments of old gym's API and of Gymnasium's, and the wrappers from each to the other."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from frobs_core.util.errors import ConfigurationError
from frobs_rl_compat.gym_api import has_gym_api, to_gymnasium
from frobs_rl_compat.old_gym.core import Env, to_gym

BOX = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)


class OldCounter(Env):
    """Counts to three, as environments of old gym did."""

    observation_space = BOX
    action_space = BOX

    def reset(self):
        self.count = 0
        return np.zeros(2, np.float32)

    def step(self, action):
        self.count += 1
        return np.zeros(2, np.float32), 1.0, self.count == 3, {"count": self.count}


class NewCounter(gymnasium.Env):
    """Counts without an end, as environments of Gymnasium do."""

    observation_space = BOX
    action_space = BOX
    truncates_at = 2

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.count = 0
        return self.np_random.random(2).astype(np.float32), {"seed": seed}

    def step(self, action):
        self.count += 1
        return np.zeros(2, np.float32), 1.0, False, self.count == self.truncates_at, {}


def test_only_an_environment_of_the_other_api_is_wrapped():
    old, new = OldCounter(), NewCounter()
    assert to_gym(old) is old
    assert to_gymnasium(new) is new
    assert not has_gym_api(to_gymnasium(old))
    assert has_gym_api(to_gym(new))
    assert to_gym(new).unwrapped is new


def test_four_values_become_five():
    env = to_gymnasium(OldCounter())
    observation, info = env.reset()
    assert observation.shape == (2,)
    assert info == {}
    assert [env.step(None)[2:4] for _ in range(3)] == [(False, False), (False, False), (True, False)]


def test_five_values_become_four_and_tell_a_time_limit_from_an_end():
    env = to_gym(NewCounter())
    assert env.reset().shape == (2,)
    assert env.step(None)[2:] == (False, {})
    assert env.step(None)[2:] == (True, {"TimeLimit.truncated": True})


def test_a_time_limit_survives_the_way_there_and_back():
    env = to_gymnasium(to_gym(NewCounter()))
    env.reset()
    env.step(None)
    assert env.step(None)[2:4] == (False, True)


def test_a_seed_reaches_environments_that_take_it_in_reset_and_those_that_have_a_method():
    first, again = (to_gym(NewCounter()) for _ in range(2))
    first.seed(3)
    assert np.array_equal(first.reset(), again.reset(seed=3))
    old = OldCounter()
    to_gymnasium(old).reset(seed=4)
    drawn = old.np_random.rand(3)
    to_gymnasium(old).reset(seed=4)
    assert np.array_equal(old.np_random.rand(3), drawn)


def test_attributes_can_be_read_through_wrappers():
    old = OldCounter()
    env = to_gym(to_gymnasium(old))
    env.reset()
    assert env.count == 0
    with pytest.raises(AttributeError):
        _ = env.nothing


def test_an_environment_of_neither_api_is_named():
    class Broken(OldCounter):
        def step(self, action):
            return None, 0.0, False

    env = to_gymnasium(Broken())
    env.reset()
    with pytest.raises(ConfigurationError, match=r"Broken.*3 values"):
        env.step(None)


def test_an_environment_of_a_real_gym_is_rejected_with_advice():
    real = type("TimeLimit", (), {"__module__": "gym.wrappers.time_limit"})()
    with pytest.raises(ConfigurationError, match=r"TimeLimit.*frobs legacy run"):
        to_gymnasium(real)
    mixed = NewCounter()
    mixed.action_space = type("Box", (), {"__module__": "gym.spaces.box"})()
    with pytest.raises(ConfigurationError, match=r"NewCounter.*frobs legacy run"):
        to_gymnasium(mixed)
