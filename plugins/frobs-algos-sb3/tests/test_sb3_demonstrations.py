"""Learning from demonstrations: half of each batch, an initial policy, exact continuation, and errors."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import test_sb3_exact as exact

from frobs_algos import demonstrations
from frobs_algos.spaces import NoEnvironment
from frobs_algos_sb3_fixtures import Family
from frobs_core.util.errors import (
    CheckpointError,
    ConfigurationError,
    FrobsError,
    IncompatibleSpaceError,
    MissingDependencyError,
    NonFiniteValueError,
)
from frobs_train.configuration.config import ComponentConfig
from frobs_train.environments import EnvironmentRecipe

REACH, GOAL, LIFT = "frobs/Irb120Reach-v0", "frobs/Irb120ReachGoal-v0", "frobs/PandaLift-v0"
SMALL = {"policy_kwargs": {"net_arch": [8]}}
FROM_RANDOM = {**exact.REPLAY, "demonstrations": "random", "demonstration_episodes": 3}
WARM = {**exact.EPOCHS, **exact.NORMAL, "initial_policy": "random", "initial_episodes": 3, "initial_updates": 5}
MARK = 1000.0


@pytest.fixture
def run_env(make: Any) -> Any:
    """Makes environments that know how to make more of their kind, as those of a training run do."""

    def run_env(name: str = REACH, num_envs: int = 2, seed: int = 0, **kwargs: Any) -> Any:
        env = make(name, num_envs, seed, **kwargs)
        env.recipe = EnvironmentRecipe(name, kwargs)
        return env

    return run_env


class DataSets(ModuleType):
    """Stands in for frobs_data, and has a data set with two episodes of three steps; only the first is terminated."""

    def __init__(self) -> None:
        super().__init__("frobs_data")
        self.reward = np.arange(6.0) + MARK

    def training_arrays(
        self, folder: Path, env: gym.vector.VectorEnv[Any, Any, Any], mapping: str | None = None
    ) -> dict[str, Any]:
        width, actions = env.single_observation_space.shape, env.single_action_space.shape
        assert width
        assert actions
        return {
            "observation": np.arange(6.0)[:, None] * np.ones(width),
            "action": np.full((6, *actions), 0.5),
            "reward": self.reward,
            "terminated": np.array([0, 0, 1, 0, 0, 0], bool),
            "episode_start": np.array([1, 0, 0, 1, 0, 0], bool),
            "intervention": np.ones(6, bool),
            "success": np.ones(2, bool),
        }


@pytest.fixture
def data_set(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> tuple[DataSets, str]:
    module = DataSets()
    monkeypatch.setitem(sys.modules, "frobs_data", module)
    (tmp_path / "data").mkdir()
    return module, str(tmp_path / "data")


def test_a_policy_plays_whole_episodes_in_environments_of_its_own(run_env: Any) -> None:
    env = run_env(LIFT, 2)
    before = env.unwrapped.snapshot()
    first, again, other = (demonstrations.collect(env, "expert", 3, seed) for seed in (1, 1, 2))
    np.testing.assert_equal(env.unwrapped.snapshot(), before)
    assert first.episode_start.sum() == 3
    assert first.reward[first.episode_end].min() > first.reward[first.episode_start].max()  # the cube was lifted
    inside = ~first.episode_end[:-1]
    np.testing.assert_array_equal(first.next_observation[:-1][inside], first.observation[1:][inside])  # type: ignore[index]
    assert not np.array_equal(first.next_observation[:-1][~inside], first.observation[1:][~inside])  # type: ignore[index]
    np.testing.assert_array_equal(first.action, again.action)
    assert not np.array_equal(first.observation, other.observation)
    assert np.abs(first.action).max() <= 1.0
    alone = demonstrations.collect(env, "expert", 3, 1, following=False)
    np.testing.assert_equal(vars(alone), {**vars(first), "next_observation": None})


def test_noise_changes_what_happens_but_not_the_actions_to_imitate(
    run_env: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    env = run_env()
    actions = np.full(env.action_space.shape, 0.5, np.float32)
    monkeypatch.setattr("frobs_core.kernel.policies.RandomPolicy.act", lambda *_: actions)
    still, again, disturbed = (demonstrations.collect(env, "random", 2, 0, noise) for noise in (0.0, 0.3, 0.3))
    np.testing.assert_array_equal(again.observation, disturbed.observation)
    assert not np.array_equal(still.observation, disturbed.observation)
    np.testing.assert_array_equal(disturbed.action, still.action)


def test_the_last_step_of_a_truncated_episode_has_no_successor(run_env: Any, data_set: tuple[DataSets, str]) -> None:
    found = demonstrations.load(data_set[1], run_env(), 5, 0).transitions()
    assert found.reward.tolist() == [MARK + row for row in (0, 1, 2, 3, 4)]
    assert found.next_observation[:, 0].tolist() == [1, 2, 2, 4, 5]  # type: ignore[index]
    assert found.episode_end.tolist() == [False, False, True, False, True]


@pytest.mark.parametrize("batch_size", [8, 7])
def test_half_of_each_batch_are_demonstrations(
    family: Family, batch_size: int, run_env: Any, data_set: tuple[DataSets, str], monitor: Any
) -> None:
    config = {**exact.REPLAY, "batch_size": batch_size, "gradient_steps": 2, "demonstrations": data_set[1]}
    algorithm = family("sac")(run_env(), config, 0)
    buffer, batches = algorithm.model.replay_buffer, []
    sample = buffer.sample

    def listen(count: int, env: Any = None) -> Any:
        drawn = sample(count, env=env)
        batches.extend(np.split(drawn.rewards.numpy()[:, 0] >= MARK, count // batch_size))
        return drawn

    buffer.sample = listen
    algorithm.train(60, monitor)
    assert len(batches) == algorithm.model._n_updates >= 6
    assert {int(batch.sum()) for batch in batches} <= {batch_size // 2, batch_size - batch_size // 2}


def test_demonstrations_are_scaled_and_normalized_as_replayed_steps_are(
    family: Family, make: Any, run_env: Any
) -> None:
    config = {**FROM_RANDOM, **exact.NORMAL, "batch_size": 2, "demonstration_episodes": 20, "n_steps": 3, "gamma": 0.5}
    algorithm = family("td3")(run_env("Pendulum-v1"), config, 0)
    normalizer = algorithm.normalizer
    normalizer.obs_rms.mean[:], normalizer.ret_rms.var = 3.0, 4.0
    drawn = algorithm._demonstrations.sample(500, env=normalizer)
    assert 0.9 < drawn.actions.abs().max() <= 1.0  # torques in [−2, 2] N m
    np.testing.assert_allclose(drawn.observations[:, 0].mean(), -3.0, atol=0.4)
    raw = algorithm._demonstrations.sample(500).rewards
    np.testing.assert_allclose(drawn.rewards.mean(), raw.mean() / 2.0, rtol=0.2)
    assert not drawn.dones.any()  # a pendulum is only stopped by its time limit
    assert set(drawn.discounts.unique().tolist()) <= {0.5, 0.25, 0.125}


def test_hindsight_replay_can_be_combined_with_demonstrations(family: Family, run_env: Any, monitor: Any) -> None:
    algorithm = family("sac")(run_env(GOAL), {**exact.HINDSIGHT, **SMALL, "demonstrations": "random"}, 0)
    algorithm.train(240, monitor)
    assert algorithm.model._n_updates > 0


@pytest.mark.parametrize(
    ("name", "environment", "config"),
    [
        pytest.param("sac", REACH, {**FROM_RANDOM, **exact.NORMAL}, id="sac"),
        pytest.param("ppo", REACH, WARM, id="ppo"),
        pytest.param(
            "dqn", REACH, FROM_RANDOM | {"policy_kwargs": {"net_arch": [8, 8]}}, id="dqn", marks=pytest.mark.slow
        ),
        pytest.param("td3", GOAL, {**FROM_RANDOM, "buffer_size": 200}, id="td3-hindsight", marks=pytest.mark.slow),
    ],
)
def test_continuing_changes_no_bit(
    family: Family, name: str, environment: str, config: dict[str, Any], run_env: Any, monitor: Any, tmp_path: Path
) -> None:
    exact.test_continuing_changes_no_bit(family.prefix + name, environment, config, run_env, monitor, tmp_path)


def test_checkpoints_share_the_file_of_the_demonstrations(family: Family, run_env: Any, tmp_path: Path) -> None:
    env = run_env()
    algorithm = family("sac")(env, FROM_RANDOM, 0)
    first, second = tmp_path / "first", tmp_path / "second"
    first.mkdir()
    second.mkdir()
    algorithm.save(first)
    algorithm.save(second, first)
    name = "demonstrations/block_00000.npz"
    assert os.path.samefile(first / name, second / name)
    (second / name).unlink()
    with pytest.raises(CheckpointError, match=name):
        type(algorithm).load(second, env)
    type(algorithm).load(second)  # predictions need no demonstrations
    index = first / "demonstrations" / "index.json"
    for text in ("{}", index.read_text().replace('"rows": ', '"rows": 1000000000000')):
        index.write_text(text)
        with pytest.raises(CheckpointError, match=r"index\.json is damaged"):
            type(algorithm).load(first, env)


@pytest.mark.parametrize(("name", "kwargs"), [("ppo", {}), ("a2c", {"controller": "discrete"})])
def test_the_networks_start_from_the_initial_policy(
    family: Family, name: str, kwargs: dict[str, Any], run_env: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    if family.prefix and name == "a2c":
        name = "ppo"
    env = run_env(**kwargs)
    constant = np.zeros_like(env.action_space.sample()) + (1 if kwargs else 0.5)
    monkeypatch.setattr(
        "frobs_core.kernel.policies.RandomPolicy.act", lambda *_: constant.astype(env.action_space.dtype)
    )
    settings = {"initial_policy": "random", "initial_episodes": 2, "initial_updates": 300, "n_steps": 8, "gamma": 0.5}
    algorithm = family(name)(env, {**settings, "normalize_observation": True, "normalize_reward": True}, 0)
    played = demonstrations.collect(env, "random", 2, 0, noise=1.0)  # the exploration of the first rollout
    action, _ = algorithm.predict(played.observation)
    np.testing.assert_allclose(action, np.resize(constant[0], action.shape), atol=0.05)
    assert algorithm.normalizer.obs_rms.count > 90
    np.testing.assert_allclose(algorithm.normalizer.obs_rms.mean, played.observation.mean(0), atol=1e-3)  # type: ignore[union-attr]
    targets = algorithm._targets(played)
    reward, end = algorithm.normalizer.normalize_reward(played.reward), len(played.reward) - 1
    np.testing.assert_allclose(targets.returns[-2:], [reward[-2] + 0.5 * reward[-1], reward[-1]], rtol=1e-5)
    assert targets.bootstrap[end - 1 :].tolist() == [0.25, 0.5]


def test_the_initial_policy_leaves_the_random_numbers_of_training_alone(family: Family, run_env: Any) -> None:
    env = run_env()
    with_policy, without = (
        family("ppo")(env, {**exact.EPOCHS, "initial_policy": name, "initial_episodes": 1, "initial_updates": 1}, 0)
        for name in ("random", None)
    )
    np.testing.assert_equal(with_policy._draws(), without._draws())


def test_sources_that_cannot_be_used_are_refused(run_env: Any, data_set: tuple[DataSets, str], tmp_path: Path) -> None:
    env, (module, folder) = run_env(), data_set
    with pytest.raises(ConfigurationError, match="missing does not exist"):
        demonstrations.load(str(tmp_path / "missing"), env, 1, 0)
    module.reward[0] = np.nan
    with pytest.raises(NonFiniteValueError, match="contains a reward that is not finite"):
        demonstrations.load(folder, env, 1, 0)
    module.training_arrays = lambda *_: dict.fromkeys(  # type: ignore[method-assign]
        ("observation", "action", "reward", "terminated", "episode_start"), np.zeros(0, bool)
    )
    with pytest.raises(ConfigurationError, match="contains no steps"):
        demonstrations.load(folder, env, 1, 0)
    with pytest.raises(FrobsError, match="no scripted expert"):
        demonstrations.load("expert", env, 1, 0)
    env.recipe = EnvironmentRecipe(REACH, {}, (ComponentConfig(name="gymnasium.wrappers.vector:NormalizeObservation"),))
    with pytest.raises(ConfigurationError, match="statistics would differ"):
        demonstrations.collect(env, "random", 1, 0)
    with pytest.raises(ConfigurationError, match="statistics would differ"):
        demonstrations.load(folder, env, 1, 0)
    del env.recipe
    with pytest.raises(ConfigurationError, match="only in a training run"):
        demonstrations.collect(env, "random", 1, 0)


def test_without_frobs_data_one_error_says_how_to_install_it(
    run_env: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "frobs_data", None)
    with pytest.raises(MissingDependencyError, match=r"reading a data set needs frobs-data; install with: pip install"):
        demonstrations.load(str(tmp_path), run_env(), 1, 0)


@pytest.mark.parametrize(
    ("name", "config", "message"),
    [
        ("sac", {"demonstrations": "expert", "batch_size": 1}, "batch_size of at least 2"),
        ("sac", {"demonstrations": "expert", "demonstration_episodes": 0}, "demonstration_episodes"),
        ("recurrent_ppo", {"initial_policy": "expert"}, "recurrent_ppo does not support initial_policy"),
        ("ppo", {"demonstrations": "expert"}, "no parameter 'demonstrations'"),
    ],
)
def test_settings_that_do_not_fit_are_refused(name: str, config: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        Family()(name).resolve_config(config)


def test_images_are_refused(make: Any) -> None:
    images = NoEnvironment(1, gym.spaces.Box(0, 255, (84, 84, 3), np.uint8), make().single_action_space)
    with pytest.raises(IncompatibleSpaceError, match="demonstrations with images"):
        Family()("ppo")(images, {"initial_policy": "expert"}, 0)


class Endless(gym.Env[Any, Any]):
    """Never ends an episode, and returns rewards of a value."""

    observation_space = gym.spaces.Box(-1.0, 1.0, (1,), np.float32)
    action_space = gym.spaces.Box(-1.0, 1.0, (1,), np.float32)

    def __init__(self, reward: float = 0.0) -> None:
        self.reward = reward

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        return np.zeros(1, np.float32), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        return np.zeros(1, np.float32), self.reward, False, False, {}


if "FrobsTests/Endless-v0" not in gym.registry:  # the tests of frobs-algos-sbx import this module, too
    gym.register("FrobsTests/Endless-v0", Endless)


def test_an_episode_of_a_policy_that_never_ends_is_an_error(run_env: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(demonstrations, "_LONGEST_EPISODE", 30)
    with pytest.raises(ConfigurationError, match="has not ended after 30 steps; add a time limit"):
        demonstrations.collect(run_env("FrobsTests/Endless-v0"), "random", 2, 0)


def test_numbers_of_a_played_episode_must_be_finite(run_env: Any) -> None:
    env = run_env("FrobsTests/Endless-v0", reward=math.nan, max_episode_steps=5)
    with pytest.raises(NonFiniteValueError, match="policy 'random' contains a reward that is not finite"):
        demonstrations.collect(env, "random", 2, 0)
