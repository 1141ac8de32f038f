"""The ``gym`` of ``frobs legacy run``: its names and its API."""

from __future__ import annotations

import gym
import gymnasium
import numpy as np
import pytest
from gym import spaces
from gym.envs.registration import register
from gym.utils import seeding


class Walk(gym.Env):
    """A walk on a line, written for gym 0.21."""

    metadata = {"render.modes": ["human"]}  # noqa: RUF012 - as they were

    def __init__(self, length=3):
        self.length = length
        self.action_space = spaces.Discrete(2)
        self.observation_space = spaces.Box(low=-10.0, high=10.0, shape=(1,), dtype=np.float32)
        self.seed()

    def seed(self, seed=None):
        self.np_random, seed = seeding.np_random(seed)
        return [seed]

    def reset(self):
        self.at = float(self.np_random.randint(0, 2))
        return np.array([self.at], np.float32)

    def step(self, action):
        self.at += 1.0 if action else -1.0
        return np.array([self.at], np.float32), self.at, self.at >= self.length, {}


ID = "FrobsTestWalk-v0"
register(id=ID, entry_point=Walk, max_episode_steps=5, kwargs={"length": 100})


def test_make_returns_an_environment_of_four_values():
    env = gym.make(ID)
    assert env.reset().shape == (1,)
    steps = [env.step(1) for _ in range(5)]
    assert all(len(step) == 4 for step in steps)
    assert [step[2] for step in steps] == [False, False, False, False, True]
    assert steps[-1][3]["TimeLimit.truncated"] is True
    assert isinstance(env.unwrapped, Walk)
    assert env.length == 100
    env.close()


def test_gymnasium_makes_the_same_id_with_five_values():
    env = gymnasium.make(ID, length=2)
    observation, info = env.reset(seed=0)
    assert observation.shape == (1,)
    assert info == {}
    while True:
        _, _, terminated, truncated, _ = env.step(1)
        if terminated:
            break
    assert not truncated
    env.close()


def test_gymnasiums_own_ids_have_four_values_too():
    env = gym.make("CartPole-v1")
    env.seed(1)
    first = env.reset()
    assert np.array_equal(first, gym.make("CartPole-v1").reset(seed=1))
    assert len(env.step(0)) == 4


def test_an_id_that_is_registered_twice_alike_stays_as_it_is():
    before = gymnasium.registry[ID]
    register(id=ID, entry_point=Walk, max_episode_steps=5, kwargs={"length": 100})
    assert gymnasium.registry[ID] is before
    assert ID in gym.envs.registry.env_specs
    assert any(spec.id == ID for spec in gym.envs.registry.all())
    assert gym.spec(ID).max_episode_steps == 5


def test_wrappers_of_a_package_see_four_values():
    class Doubled(gym.RewardWrapper):
        def reward(self, reward):
            return 2 * reward

    class Shifted(gym.ObservationWrapper):
        def observation(self, observation):
            return observation + 1

    class Flipped(gym.ActionWrapper):
        def action(self, action):
            return 1 - action

    env = Flipped(Shifted(Doubled(gym.make("CartPole-v1"))))
    env.reset()
    observation, reward, _, _ = env.step(0)
    assert reward == 2.0
    assert observation[0] > 0.5
    assert isinstance(env, gymnasium.Env)


def test_gymnasiums_wrappers_are_there_by_name():
    env = gym.wrappers.TimeLimit(Walk(), max_episode_steps=2)
    env.reset()
    env.step(0)
    assert env.step(0)[2:] == (True, {"TimeLimit.truncated": True})
    with pytest.raises(AttributeError, match="Monitored"):
        _ = gym.wrappers.Monitored


def test_a_missing_name_is_reported():
    with pytest.raises(AttributeError, match=r"frobs legacy run.*'vector_of_things'"):
        _ = gym.vector_of_things


def test_classes_of_spaces_are_found_in_the_modules_that_old_model_files_name():
    from gym.spaces.box import Box

    assert Box is gym.spaces.Box is gym.spaces.box.Box
