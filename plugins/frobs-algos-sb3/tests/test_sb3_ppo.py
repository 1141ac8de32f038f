from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch as th
from test_sb3_exact import assert_same

from frobs_algos import storage
from frobs_algos.settings import schedule
from frobs_algos_sb3 import state
from frobs_algos_sb3_fixtures import Family
from frobs_core.util.errors import (
    CheckpointError,
    ConfigurationError,
    RunError,
    UnknownParameterError,
    UntrustedFileError,
)

FAST = {"n_steps": 8, "batch_size": 16, "n_epochs": 2, "policy_kwargs": {"net_arch": [8]}}
NORMAL = {**FAST, "normalize_observation": True, "normalize_reward": True, "learning_rate": "lin_1e-3"}


@pytest.mark.parametrize(
    ("config", "error", "message"),
    [
        ({"n_step": 3}, UnknownParameterError, "Did you mean 'n_steps'"),
        ({"policy_kwargs": {"net_ark": [3]}}, UnknownParameterError, "Did you mean 'net_arch'"),
        ({"learning_rate": "exp_3"}, ConfigurationError, "'lin_'"),
        ({"learning_rate": "lin_"}, ConfigurationError, "'lin_'"),
        ({"learning_rate": 0}, ConfigurationError, "must be positive"),
        ({"gamma": 1.5}, ConfigurationError, r"gamma is 1\.5; .* less than or equal to 1"),
        ({"policy_kwargs": {"net_arch": [0]}}, ConfigurationError, "greater than 0"),
        ({"policy_kwargs": {"activation_fn": "step"}}, ConfigurationError, "'relu'"),
        ({"n_steps": "many"}, ConfigurationError, "n_steps is 'many'"),
    ],
)
def test_a_bad_setting_is_named(family: Family, config: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        family("ppo").resolve_config(config)


def test_settings_resolve_to_the_same_again(family: Family) -> None:
    resolved = family("ppo").resolve_config({**NORMAL, "clip_range": "lin_0.2"})
    assert family("ppo").resolve_config(resolved) == resolved
    assert resolved.learning_rate == "lin_1e-3"


def test_a_linear_schedule_falls_to_zero() -> None:
    rate = schedule("lin_3e-4")
    assert callable(rate)
    assert [rate(1.0), rate(0.5), rate(0.0)] == [3e-4, 1.5e-4, 0.0]
    assert schedule(0.1) == 0.1


@pytest.mark.parametrize(
    ("space", "message"),
    [(gym.spaces.Box(-np.inf, np.inf, (1,)), "finite bounds"), (gym.spaces.Text(3), "cannot learn from")],
)
def test_spaces_that_cannot_be_used_are_refused(family: Family, space: Any, message: str, make: Any) -> None:
    env = make("Pendulum-v1", 1)
    env.single_action_space = space
    if isinstance(space, gym.spaces.Text):
        env.single_action_space, env.single_observation_space = gym.spaces.Discrete(2), space
    with pytest.raises(ConfigurationError, match=message):
        family("ppo")(env, FAST, 0)


def test_rows_and_offers_come_at_the_start_of_each_rollout(family: Family, make: Any, monitor: Any) -> None:
    family("ppo")(make(num_envs=2), FAST, 0).train(48, monitor)
    assert [steps for steps, _ in monitor.rows] == [16, 32, 48]
    assert monitor.offers == [16, 32]
    for _, metrics in monitor.rows:
        assert {family.prefix + name for name in ("ppo/value_loss", "ppo/learning_rate", "ppo/approx_kl")} <= set(
            metrics
        )
        assert all(name.startswith(f"{family.prefix}ppo/") for name in metrics)


def test_the_monitor_can_end_it(family: Family, make: Any, stopping_monitor: Any) -> None:
    algorithm = family("ppo")(make(num_envs=2), FAST, 0)
    algorithm.train(1000, stopping_monitor)
    assert algorithm.model.num_timesteps == 16


def test_one_thread_by_default(family: Family, make: Any) -> None:
    before = th.get_num_threads()
    try:
        family("ppo")(make(num_envs=1), FAST, 0)
        assert th.get_num_threads() == 1
    finally:
        th.set_num_threads(before)


def test_the_algorithm_leaves_the_environment_its_seed(family: Family, make: Any, monitor: Any) -> None:
    first = [family("ppo")(make(seed=5), FAST, seed).venv.reset() for seed in (0, 1)]
    np.testing.assert_array_equal(first[0], first[1])


def test_the_scale_that_a_task_suggests_is_part_of_the_policy(family: Family, make: Any, tmp_path: Path) -> None:
    env = make()
    scaled, plain = family("ppo")(env, FAST, 0), family("ppo")(env, {**FAST, "scale_observation": False}, 0)
    scale = env.unwrapped.observations.scale
    observation = env.single_observation_space.sample()[None] * 0.1
    np.testing.assert_allclose(scaled.predict(observation)[0], plain.predict(observation * scale)[0], atol=1e-6)
    scaled.save(tmp_path)
    np.testing.assert_array_equal(family("ppo").load(tmp_path).predict(observation)[0], scaled.predict(observation)[0])


@pytest.mark.parametrize("name", ["frobs/Irb120Reach-v0", "frobs/Irb120ReachGoal-v0", "CartPole-v1"])
@pytest.mark.parametrize("config", [FAST, NORMAL], ids=["plain", "normalized"])
def test_what_is_loaded_predicts_the_same(
    family: Family, name: str, config: dict[str, Any], make: Any, monitor: Any, tmp_path: Path
) -> None:
    env = make(name)
    algorithm = family("ppo")(env, config, 0)
    algorithm.train(64, monitor)
    algorithm.save(tmp_path)
    loaded = family("ppo").load(tmp_path)
    assert loaded.observation_space == env.single_observation_space
    assert loaded.action_space == env.single_action_space
    observation, _ = env.reset(seed=9)
    for deterministic in (True, False) if family == Family() else (True,):  # JAX draws from keys of its own
        th.manual_seed(0)
        expected, _ = algorithm.predict(observation, deterministic=deterministic)
        th.manual_seed(0)
        np.testing.assert_array_equal(loaded.predict(observation, deterministic=deterministic)[0], expected)
    with pytest.raises(RunError, match="prediction only"):
        loaded.train(100, monitor)


@pytest.mark.parametrize("config", [FAST, NORMAL], ids=["plain", "normalized"])
def test_continuing_equals_never_having_stopped(
    family: Family, config: dict[str, Any], make: Any, monitor: Any, tmp_path: Path
) -> None:
    snapshots = {}
    env = make()
    algorithm = family("ppo")(env, config, 0)
    monitor.save_at = {160: tmp_path / "half"}
    monitor.on_offer = lambda steps: snapshots.setdefault(steps, env.unwrapped.snapshot())
    algorithm.train(288, monitor)
    rows = dict(monitor.rows)

    other = make(seed=77)
    other.unwrapped.restore(snapshots[160])
    resumed = family("ppo").load(tmp_path / "half", other)
    monitor.rows, monitor.save_at = [], {}
    resumed.train(288, monitor)
    assert [steps for steps, _ in monitor.rows] == [192, 224, 256, 288]  # episodes end at 200
    assert dict(monitor.rows) == {steps: rows[steps] for steps, _ in monitor.rows}
    assert_same(algorithm, resumed, tmp_path)


def test_another_environment_is_refused(family: Family, make: Any, tmp_path: Path) -> None:
    family("ppo")(make(), FAST, 0).save(tmp_path)
    with pytest.raises(ConfigurationError, match="trained with observation_space"):
        family("ppo").load(tmp_path, make("Pendulum-v1"))


@pytest.mark.parametrize("name", ["algorithm.json", "policy", "normalizer.npz"])
@pytest.mark.parametrize("damage", ["missing", "cut", "empty", "text"])
def test_a_damaged_file_is_named(family: Family, name: str, damage: str, make: Any, tmp_path: Path) -> None:
    family("ppo")(make("Pendulum-v1", 1), NORMAL, 0).save(tmp_path)
    name = family.weights if name == "policy" else name
    path = tmp_path / name
    data = path.read_bytes()
    path.unlink()
    if damage != "missing":
        path.write_bytes({"cut": data[: len(data) // 2], "empty": b"", "text": b"hello"}[damage])
    with pytest.raises(CheckpointError, match=name):
        family("ppo").load(tmp_path)


def test_a_file_that_would_execute_code_is_refused(family: Family, make: Any, tmp_path: Path) -> None:
    witness = tmp_path / "witness"

    class Bomb:
        def __reduce__(self) -> Any:
            return (Path.touch, (witness,))

    family("ppo")(make("Pendulum-v1", 1), NORMAL, 0).save(tmp_path)
    np.savez(tmp_path / "normalizer.npz", bomb=np.array([Bomb()], object))
    with pytest.raises(UntrustedFileError, match=r"normalizer\.npz: the file contains arrays of Python objects"):
        storage.read_arrays(tmp_path / "normalizer.npz")
    weights = tmp_path / family.weights
    if weights.suffix == ".pt":
        th.save({"weights": Bomb()}, weights)
    else:
        np.savez(weights, bomb=np.array([Bomb()], object))
    with pytest.raises(UntrustedFileError, match=f"{family.weights}: the file contains"):
        family("ppo").load(tmp_path)
    weights.write_bytes(pickle.dumps(Bomb()))
    with pytest.raises(CheckpointError, match=f"{family.weights} is damaged"):
        family("ppo").load(tmp_path)
    assert not witness.exists()


def test_generators_continue_where_they_were() -> None:
    import random

    saved = state.generators()
    expected = [random.gauss(0, 1), np.random.normal(), th.rand(1).item()]  # noqa: NPY002
    state.restore_generators(saved)
    assert [random.gauss(0, 1), np.random.normal(), th.rand(1).item()] == expected  # noqa: NPY002
