"""Environments of both manners, and the way from each to the other."""

from __future__ import annotations

import sys
import textwrap

import gymnasium
import numpy as np
import pytest

from frobs_core.errors import ConfigurationError
from frobs_rl_compat.manner import Manner, manner_of, to_gymnasium
from frobs_rl_compat.named_imports import imported_names, manner_by_imports, manner_of_gym
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


def test_an_environment_of_the_other_manner_is_wrapped_and_one_of_the_same_is_not():
    old, new = OldCounter(), NewCounter()
    assert to_gym(old) is old
    assert to_gymnasium(new) is new
    assert manner_of(to_gymnasium(old)) is Manner.GYMNASIUM
    assert manner_of(to_gym(new)) is Manner.GYM
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


def test_an_environment_that_answers_in_neither_manner_is_named():
    class Broken(OldCounter):
        def step(self, action):
            return None, 0.0, False

    env = to_gymnasium(Broken())
    env.reset()
    with pytest.raises(ConfigurationError, match=r"Broken.*3 values"):
        env.step(None)


MODULES = {
    "old": ("from gym import spaces\nclass Made: pass", Manner.GYM),
    "old_register": ("from gym.envs.registration import register\nclass Made: pass", Manner.GYM),
    "old_inside": ("def f():\n    import gym.spaces\nclass Made: pass", Manner.GYM),
    "new": ("import gymnasium as gym\nclass Made: pass", Manner.GYMNASIUM),
    "both": (
        "try:\n    import gymnasium as gym\nexcept ImportError:\n    import gym\nclass Made: pass",
        Manner.GYMNASIUM,
    ),
    "neither": ("class Made: pass", Manner.GYMNASIUM),
}


@pytest.fixture
def make_module(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    made = []

    def make(name: str, text: str):
        (tmp_path / f"{name}.py").write_text(textwrap.dedent(text))
        made.append(name)
        return __import__(name)

    yield make
    for name in made:
        sys.modules.pop(name, None)


@pytest.mark.parametrize("name", MODULES)
def test_the_manner_goes_by_the_name_that_a_file_imports(make_module, name):
    text, manner = MODULES[name]
    assert manner_by_imports(make_module(f"manner_{name}", text).Made) is manner


def test_a_file_that_imports_neither_leaves_it_to_the_class_that_it_inherits(make_module):
    make_module("manner_robot", "from gym import spaces\nclass Robot: pass")
    task = make_module("manner_task", "from manner_robot import Robot\nclass Task(Robot): pass")
    assert manner_by_imports(task.Task) is Manner.GYM
    newer = make_module("manner_newer", "import gymnasium\nfrom manner_robot import Robot\nclass Task(Robot): pass")
    assert manner_by_imports(newer.Task) is Manner.GYMNASIUM


def test_a_module_without_a_file_is_judged_by_what_it_holds():
    module = type(sys)("typed_in")
    exec("from gym.envs.registration import make\nimport gym", vars(module))
    assert "gym" in imported_names(module)


def test_a_real_gym_of_0_26_has_five_values():
    module = type(sys)("gym")
    for version, manner in (("0.21.0", Manner.GYM), ("0.25.2", Manner.GYM), ("0.26.2", Manner.GYMNASIUM)):
        module.__version__ = version
        assert manner_of_gym(module) is manner


def test_environments_of_a_real_gym_are_refused_with_the_way_out():
    real = type("TimeLimit", (), {"__module__": "gym.wrappers.time_limit"})()
    with pytest.raises(ConfigurationError, match=r"TimeLimit.*pip uninstall gym"):
        to_gymnasium(real)
    mixed = NewCounter()
    mixed.action_space = type("Box", (), {"__module__": "gym.spaces.box"})()
    with pytest.raises(ConfigurationError, match=r"NewCounter.*pip uninstall gym"):
        to_gymnasium(mixed)
