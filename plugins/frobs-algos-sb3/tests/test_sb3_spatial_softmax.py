"""Pictures that are reduced to points, with every algorithm that has such a features extractor."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch as th
from gymnasium import spaces

from frobs_algos.encoder import Encoder
from frobs_algos.spaces import NoEnvironment
from frobs_core import plugins
from frobs_core.util.errors import IncompatibleSpaceError
from frobs_train.environments import make_vector_env

POINTS = {"features_extractor_class": "SpatialSoftmax", "net_arch": [32]}


class Dot(gym.Env[Any, Any]):
    """A bright dot in a dark picture. The action shall be its column, from −1 (left) to 1 (right)."""

    def __init__(self, size: int = 24, channels_first: bool = False) -> None:
        self.size, self.channels_first = size, channels_first
        shape = (3, size, size) if channels_first else (size, size, 3)
        picture = spaces.Box(0, 255, shape, np.uint8)
        self.observation_space = spaces.Dict({"camera": picture, "noise": spaces.Box(-1.0, 1.0, (2,), np.float32)})
        self.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        picture = np.zeros((self.size, self.size, 3), np.uint8)
        row, self.column = self.np_random.integers(1, self.size - 1, 2)
        picture[row - 1 : row + 2, self.column - 1 : self.column + 2] = 255
        camera = picture.transpose(2, 0, 1) if self.channels_first else picture
        return {"camera": camera, "noise": self.np_random.uniform(-1.0, 1.0, 2).astype(np.float32)}, {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        error = float(action[0]) - (2.0 * self.column / (self.size - 1) - 1.0)
        return self.reset()[0], -(error**2), True, False, {}


@pytest.fixture(autouse=True)
def registered() -> Any:
    for first in (False, True):
        gym.register(f"test/Dot{int(first)}-v0", Dot, kwargs={"channels_first": first}, max_episode_steps=5)
    yield
    for first in (False, True):
        del gym.registry[f"test/Dot{int(first)}-v0"]


@pytest.mark.slow
@pytest.mark.parametrize("id", ["test/Dot0-v0", "test/Dot1-v0"], ids=["channels last", "channels first"])
def test_ppo_learns_where_something_is(id: str, monitor: Any) -> None:
    env = make_vector_env(id, 16, {})
    config = {"n_steps": 64, "batch_size": 256, "n_epochs": 5, "gamma": 0.0, "learning_rate": 1e-3}
    algorithm = plugins.get_record("algorithm", "ppo").load()(env, {**config, "policy_kwargs": POINTS}, 0)
    algorithm.train(20_480, monitor)
    observation, _ = env.reset(seed=0)
    rewards = []
    for _ in range(20):
        action, _ = algorithm.predict(observation)
        observation, reward, *_ = env.step(action)
        rewards.append(reward)
    assert np.mean(rewards) > -0.15  # −0.33 for a policy that does not see


@pytest.mark.parametrize(
    ("space", "message"),
    [
        (spaces.Box(-1.0, 1.0, (4,), np.float32), "no pictures for the features extractor SpatialSoftmax"),
        (spaces.Box(0, 255, (19, 40, 3), np.uint8), "at least 20 × 20 pixels"),
    ],
)
def test_pictures_that_it_cannot_process_are_refused(space: Any, message: str, make: Any) -> None:
    env = NoEnvironment(1, space, make().single_action_space)
    with pytest.raises(IncompatibleSpaceError, match=message):
        plugins.get_record("algorithm", "ppo").load()(env, {"policy_kwargs": POINTS}, 0)


def test_the_encoder_computes_on_the_device_of_its_weights() -> None:
    encoder = Encoder(3).to("meta")  # a device of its own that every machine has
    assert encoder(th.zeros((2, 3, 24, 32), device="meta")).device.type == "meta"


def test_vectors_are_normalized_and_pictures_are_not(monitor: Any, tmp_path: Path) -> None:
    env, cls = make_vector_env("test/Dot0-v0", 2, {}), plugins.get_record("algorithm", "ppo").load()
    space = deepcopy(env.single_observation_space)
    config = {"policy_kwargs": POINTS, "n_steps": 8, "batch_size": 8, "normalize_observation": True}
    algorithm = cls(env, config, 0)
    algorithm.train(16, monitor)
    assert env.single_observation_space == algorithm.observation_space == space
    assert list(algorithm.normalizer.obs_rms) == ["noise"]
    algorithm.save(tmp_path)
    cls.load(tmp_path, make_vector_env("test/Dot0-v0", 2, {}))


@pytest.mark.parametrize("name", ["sac", "td3"])
def test_off_policy_algorithms_take_it_too(name: str, monitor: Any) -> None:
    env = make_vector_env("test/Dot0-v0", 2, {})
    config = {"policy_kwargs": POINTS, "buffer_size": 50, "learning_starts": 4, "batch_size": 4}
    algorithm = plugins.get_record("algorithm", name).load()(env, config, 0)
    algorithm.train(12, monitor)
    observation, _ = env.reset(seed=0)
    action, _ = algorithm.predict(observation)
    assert np.isfinite(action).all()
