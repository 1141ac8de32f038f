"""What holds for every algorithm of RLlib, with the environment of this process."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from rllib_fixtures import REACH, SHORT

from frobs_core import plugins
from frobs_core.util.errors import (
    CheckpointError,
    ConfigurationError,
    RunError,
    UnknownParameterError,
    UntrustedFileError,
)
from frobs_ray.rllib.spaces import FlatSpaces

NAMES = list(SHORT)

PREDICT = """
import sys
from pathlib import Path
import numpy as np
from frobs_core import plugins
algorithm = plugins.get_record("algorithm", sys.argv[1]).load().load(Path(sys.argv[2]))
np.save(sys.argv[4], algorithm.predict(np.load(sys.argv[3]))[0])
import ray
assert not ray.is_initialized()
"""


def of(name: str) -> Any:
    return plugins.get_record("algorithm", name).load()


@pytest.mark.parametrize(
    ("name", "config", "error", "message"),
    [
        ("rllib_ppo", {"n_step": 3}, UnknownParameterError, "Did you mean 'n_steps'"),
        ("rllib_ppo", {"target_kl": 0.1}, UnknownParameterError, "target_kl"),
        ("rllib_ppo", {"policy_kwargs": {"net_ark": [3]}}, UnknownParameterError, "Did you mean 'net_arch'"),
        ("rllib_ppo", {"learning_rate": "exp_3"}, ConfigurationError, "'lin_'"),
        ("rllib_ppo", {"gamma": 1.5}, ConfigurationError, r"gamma is 1\.5; .* less than or equal to 1"),
        ("rllib_ppo", {"num_env_runners": -1}, ConfigurationError, "num_env_runners is -1"),
        ("rllib_ppo", {"policy_kwargs": {"activation_fn": "step"}}, ConfigurationError, "'relu'"),
        ("rllib_sac", {"ent_coef": 0.0}, ConfigurationError, "ent_coef must be positive"),
        ("rllib_sac", {"gradient_steps": 0}, ConfigurationError, "positive or -1"),
        ("rllib_sac", {"n_steps": 3}, UnknownParameterError, "n_steps"),
        ("rllib_appo", {"n_epochs": 3}, UnknownParameterError, "n_epochs"),
    ],
)
def test_a_bad_setting_is_named(name: str, config: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        of(name).resolve_config(config)


@pytest.mark.parametrize("name", NAMES)
def test_settings_resolve_to_the_same_again(name: str) -> None:
    resolved = of(name).resolve_config({**SHORT[name], "learning_rate": "lin_1e-3"})
    assert of(name).resolve_config(resolved) == resolved
    assert resolved.learning_rate == "lin_1e-3"


def test_a_linear_schedule_ends_at_zero_where_the_training_ends(make: Any) -> None:
    algorithm = make("rllib_ppo", {"learning_rate": "lin_4e-3"})
    assert algorithm.settings.rates(0, 400) == [[0, 4e-3], [400, 0.0]]
    assert algorithm.settings.rates(100, 400) == [[0, 3e-3], [300, 0.0]]
    assert make("rllib_ppo").settings.rates(100, 400) == 3e-4


def test_environments_are_shared_out_evenly_or_not_at_all(make: Any) -> None:
    with pytest.raises(ConfigurationError, match=r"num_env_runners is 3; .* divisor of num_envs = 4"):
        make("rllib_ppo", {"num_env_runners": 3})


def test_spaces_that_cannot_be_used_are_refused() -> None:
    numbers, bounded = gym.spaces.Box(-1.0, 1.0, (3,)), gym.spaces.Box(-1.0, 1.0, (2,))
    with pytest.raises(ConfigurationError, match="needs actions with finite bounds"):
        FlatSpaces(numbers, gym.spaces.Box(-np.inf, np.inf, (1,)), "x")
    with pytest.raises(ConfigurationError, match="needs numeric observations"):
        FlatSpaces(gym.spaces.Discrete(3), bounded, "x")
    with pytest.raises(ConfigurationError, match="frobs-algos-sb3 for images"):
        FlatSpaces(gym.spaces.Box(0, 255, (8, 8, 3), np.uint8), bounded, "x")


def test_actions_fill_the_space_and_choices_keep_their_start() -> None:
    numbers = gym.spaces.Box(-1.0, 1.0, (3,))
    spaces = FlatSpaces(numbers, gym.spaces.Box(np.array([0, -4], np.float32), np.array([2, 0], np.float32)), "x")
    np.testing.assert_allclose(
        spaces.to_env(np.array([[-1.0, -1.0], [0.0, 0.5], [3.0, -9.0]])), [[0, -4], [1, -1], [2, -4]]
    )
    choices = FlatSpaces(numbers, gym.spaces.Discrete(3, start=5), "x")
    assert choices.to_env(np.array([0, 2])).tolist() == [5, 7]


def test_parts_of_an_observation_are_joined() -> None:
    space = gym.spaces.Dict({"b": gym.spaces.Box(-1, 1, (2, 2)), "a": gym.spaces.Box(-1, 1, (1,))})
    spaces = FlatSpaces(space, gym.spaces.Discrete(2), "x")
    batch = {"a": np.array([[9.0]]), "b": np.arange(4.0).reshape(1, 2, 2)}
    assert spaces.flatten(batch).tolist() == [[0, 1, 2, 3, 9]] or spaces.flatten(batch).tolist() == [[9, 0, 1, 2, 3]]
    np.testing.assert_array_equal(
        spaces.flatten(batch)[0], spaces.flatten_one({"a": batch["a"][0], "b": batch["b"][0]})
    )


@pytest.mark.parametrize("name", NAMES)
def test_the_scale_that_a_task_suggests_is_part_of_the_policy(name: str, make: Any) -> None:
    scaled, plain = make(name), make(name, {"scale_observation": False})
    scale = scaled.env.unwrapped.observations.scale
    observation = scaled.observation_space.sample()[None] * 0.1
    np.testing.assert_allclose(scaled.predict(observation)[0], plain.predict(observation * scale)[0], atol=1e-6)


@pytest.mark.slow
@pytest.mark.usefixtures("cluster")
@pytest.mark.parametrize("name", NAMES)
def test_a_saved_algorithm_predicts_the_same_without_ray(name: str, make: Any, monitor: Any, tmp_path: Path) -> None:
    algorithm = make(name)
    algorithm.train(128, monitor)
    (tmp_path / "saved").mkdir()
    algorithm.save(tmp_path / "saved")
    observation = algorithm.env.reset(seed=9)[0]
    np.save(tmp_path / "observation.npy", observation)
    arguments = [name, tmp_path / "saved", tmp_path / "observation.npy", tmp_path / "action.npy"]
    subprocess.run([sys.executable, "-c", PREDICT, *map(str, arguments)], check=True)
    np.testing.assert_array_equal(np.load(tmp_path / "action.npy"), algorithm.predict(observation)[0])
    with pytest.raises(RunError, match="prediction only"):
        type(algorithm).load(tmp_path / "saved").train(256, monitor)


@pytest.mark.slow
@pytest.mark.usefixtures("cluster")
@pytest.mark.parametrize("name", NAMES)
def test_a_loaded_algorithm_continues_with_its_optimizers_and_steps(
    name: str, make: Any, monitor: Any, tmp_path: Path
) -> None:
    algorithm = make(name)
    algorithm.train(128, monitor)
    algorithm.save(tmp_path)
    loaded = type(algorithm).load(tmp_path, make.env())
    assert loaded.steps == algorithm.steps >= 128
    assert set(loaded.learning) == set(algorithm.learning)
    counts = [key for key in loaded.learning if key.endswith("/step")]
    assert counts
    monitor.rows.clear()
    loaded.train(256, monitor)
    assert monitor.rows[-1][0] == loaded.steps >= 256
    assert all(loaded.learning[key] > algorithm.learning[key] for key in counts)
    if name == "rllib_sac":
        assert loaded.learning["coefficient/log_alpha"] != algorithm.learning["coefficient/log_alpha"]


@pytest.mark.slow
@pytest.mark.usefixtures("cluster")
@pytest.mark.parametrize("name", NAMES)
def test_the_monitor_can_end_it(name: str, make: Any, monitor: Any) -> None:
    monitor.is_enough = lambda steps: steps >= 64
    algorithm = make(name)
    algorithm.train(10_000, monitor)
    assert algorithm.steps == monitor.rows[-1][0] == monitor.offers[-1] == algorithm.env.steps < 1000


@pytest.mark.slow
@pytest.mark.usefixtures("cluster")
@pytest.mark.parametrize("id", ["frobs/Irb120ReachGoal-v0", "CartPole-v1"])
def test_dictionaries_and_choices_work(id: str, make: Any, monitor: Any) -> None:
    algorithm = make("rllib_ppo", id=id)
    algorithm.train(64, monitor)
    observation = algorithm.env.reset(seed=3)[0]
    for deterministic in (True, False):
        action, _ = algorithm.predict(observation, deterministic=deterministic)
        assert all(algorithm.action_space.contains(np.asarray(row, algorithm.action_space.dtype)) for row in action)


@pytest.mark.parametrize("name", ["algorithm.json", "policy.npz", "learning.npz"])
@pytest.mark.parametrize("damage", ["missing", "cut", "empty", "text"])
def test_a_damaged_file_is_named(name: str, damage: str, make: Any, tmp_path: Path) -> None:
    make("rllib_sac").save(tmp_path)
    path = tmp_path / name
    data = path.read_bytes()
    path.unlink()
    if damage != "missing":
        path.write_bytes({"cut": data[: len(data) // 2], "empty": b"", "text": b"hello"}[damage])
    with pytest.raises(CheckpointError, match=name):
        of("rllib_sac").load(tmp_path, make.env())


def test_networks_of_other_settings_are_refused(make: Any, tmp_path: Path) -> None:
    (tmp_path / "small").mkdir()
    (tmp_path / "large").mkdir()
    make("rllib_ppo").save(tmp_path / "small")
    make("rllib_ppo", {"policy_kwargs": {"net_arch": [9]}}).save(tmp_path / "large")
    (tmp_path / "small" / "policy.npz").write_bytes((tmp_path / "large" / "policy.npz").read_bytes())
    with pytest.raises(CheckpointError, match="does not match the settings"):
        of("rllib_ppo").load(tmp_path / "small")


def test_a_file_that_would_execute_code_is_refused(make: Any, tmp_path: Path) -> None:
    witness = tmp_path / "witness"

    class Bomb:
        def __reduce__(self) -> Any:
            return (Path.touch, (witness,))

    make("rllib_ppo").save(tmp_path)
    np.savez(tmp_path / "policy.npz", bomb=np.array([Bomb()], object))
    with pytest.raises(UntrustedFileError, match="Python objects"):
        of("rllib_ppo").load(tmp_path)
    assert not witness.exists()


def test_another_environment_is_refused(make: Any, tmp_path: Path) -> None:
    make("rllib_ppo").save(tmp_path)
    with pytest.raises(ConfigurationError, match="trained with num_envs"):
        of("rllib_ppo").load(tmp_path, make.env(REACH, 2))
    with pytest.raises(ConfigurationError, match="trained with observation_space"):
        of("rllib_ppo").load(tmp_path, make.env("Pendulum-v1"))
