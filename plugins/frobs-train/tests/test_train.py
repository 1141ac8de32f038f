from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.util.errors import ConfigurationError, RunError, UnknownNameError, UnknownParameterError
from frobs_core.util.yaml import load_yaml
from frobs_train import Progress, Run, RunConfig, default_run_dir, resolve_config, train
from frobs_train.environments import check_environment, make_vector_env
from frobs_train.errors import RunExistsError
from frobs_train.logs.progress import STEPS, read_progress

FAST = {"n_steps": 10, "batch_size": 20, "n_epochs": 1}


def config(**changes: Any) -> RunConfig:
    values: dict[str, Any] = {"environment": "FrobsTests/Line-v0", "num_envs": 2, "steps": 60, "seed": 0}
    return RunConfig(**{**values, "algorithm_config": FAST, **changes})


def test_a_run_folder_holds_everything(trained: Run) -> None:
    assert {path.name for path in trained.path.iterdir()} == {
        "config.yaml",
        "history.json",
        "versions.json",
        "progress.csv",
        "tensorboard",
        "checkpoints",
        ".lock",
    }
    resolved = load_yaml(trained.path / "config.yaml")
    assert resolved["seed"] == 1
    assert resolved["algorithm_config"]["n_epochs"] == 10
    versions = json.loads((trained.path / "versions.json").read_text())
    assert {"python", "frobs-core", "plugins", "libraries", "platform"} <= set(versions)
    assert versions["plugins"]["frobs-algos-sb3"]
    assert [checkpoint.steps for checkpoint in trained.checkpoints] == [1600, 2000]


def test_the_log_has_the_columns_of_all_who_speak(trained: Run) -> None:
    columns = read_progress(trained.path / "progress.csv")
    assert {"time/elapsed", "time/steps_per_second", "episode/count", "episode/length"} <= set(columns)
    assert {"ppo/value_loss", "ppo/learning_rate"} <= set(columns)
    assert columns[STEPS] == list(range(200, 2001, 200))
    np.testing.assert_allclose(
        np.add(columns["reward/distance"], columns["reward/effort"]), columns["episode/reward"], rtol=1e-6
    )
    assert columns["episode/success"][-1] > columns["episode/success"][0]


def test_a_run_opens_as_it_was_made(trained: Run) -> None:
    assert Run.open(trained.path).config == trained.config


def test_the_same_seed_trains_the_same_and_another_does_not(tmp_path: Path) -> None:
    rows = []
    for name, seed in (("a", 0), ("b", 0), ("c", 1)):
        run = train(config(seed=seed), tmp_path / name)
        columns = read_progress(run.path / "progress.csv")
        rows.append({key: values for key, values in columns.items() if not key.startswith("time/")})
    assert rows[0] == rows[1]
    assert rows[0] != rows[2]


def test_progress_is_told(tmp_path: Path) -> None:
    told: list[Progress] = []
    train(config(), tmp_path / "run", told.append)
    assert [item.steps for item in told] == [20, 40, 60]
    assert told[-1].total_steps == 60
    assert told[-1].seconds_left == 0
    assert told[-1].length == 10
    assert told[-1].success is not None


def test_who_is_told_may_end_the_training_which_leaves_a_checkpoint(tmp_path: Path) -> None:
    run = train(config(), tmp_path / "run", lambda progress: progress.steps < 40)
    assert [checkpoint.steps for checkpoint in run.checkpoints][-1] == 40


def test_an_id_without_success_or_terms_trains_too(tmp_path: Path) -> None:
    run = train(config(environment="CartPole-v1", steps=200, algorithm_config={"n_steps": 50}), tmp_path / "run")
    columns = read_progress(run.path / "progress.csv")
    assert np.isnan(columns["episode/success"]).all()
    assert not [name for name in columns if name.startswith("reward/")]


def test_an_existing_folder_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(RunExistsError, match="exists; choose another"):
        train(config(), tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        pytest.param(
            {"environment": "FrobsTests/Lime-v0"}, UnknownNameError, "Did you mean 'FrobsTests/Line-v0'", id="ID"
        ),
        pytest.param(
            {"environment": "nowhere:X-v0"}, ConfigurationError, "module 'nowhere' cannot be imported", id="module"
        ),
        pytest.param(
            {"environment_kwargs": {"wdth": 2}},
            ConfigurationError,
            "wdth=2: it does not accept the keyword 'wdth'; remove it",
            id="keyword",
        ),
        pytest.param({"algorithm": "pppo"}, UnknownNameError, "Did you mean 'ppo'", id="algorithm"),
        pytest.param(
            {"algorithm_config": {"n_step": 2}}, UnknownParameterError, "Did you mean 'n_steps'", id="setting"
        ),
        pytest.param(
            {"environment": "FrobsTests/Tuple-v0"}, ConfigurationError, "action space is Tuple", id="action space"
        ),
        pytest.param(
            {"num_envs": 1, "algorithm_config": {"n_steps": 1}}, ConfigurationError, "num_envs × n_steps", id="one step"
        ),
    ],
)
def test_bad_input_leaves_nothing(
    changes: dict[str, Any], error: type[Exception], message: str, tmp_path: Path
) -> None:
    class TupleEnv(gym.Env[Any, Any]):
        observation_space = gym.spaces.Box(-1, 1, (1,))
        action_space = gym.spaces.Tuple([gym.spaces.Discrete(2)])

    if "FrobsTests/Tuple-v0" not in gym.registry:
        gym.register("FrobsTests/Tuple-v0", lambda **_: TupleEnv(), disable_env_checker=True)
    with pytest.raises(error, match=message):
        train(config(**changes), tmp_path / "run")
    assert not list(tmp_path.iterdir())


def test_the_time_limit_is_a_keyword_of_each_environment() -> None:
    check_environment("frobs/Irb120Reach-v0", {"max_episode_steps": 7})
    env = make_vector_env("frobs/Irb120Reach-v0", 1, {"max_episode_steps": 7})
    assert getattr(env.unwrapped, "max_episode_steps", None) == 7
    env.close()
    with pytest.raises(UnknownParameterError, match="max_steps"):
        check_environment("frobs/Irb120Reach-v0", {"max_steps": 7})


def test_negative_steps_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="steps is -3"):
        resolve_config("CartPole-v1", flags={"steps": -3})


def test_the_folder_is_named_after_the_seed_or_the_time() -> None:
    assert default_run_dir(config(environment="frobs_core:frobs/X-v0")) == Path("runs/frobs/X-v0/ppo_seed0")
    assert default_run_dir(config(seed=None)).name.startswith("ppo_2")


def test_a_folder_that_is_no_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"contains no config\.yaml"):
        Run.open(tmp_path)
    with pytest.raises(RunError, match="is not a folder"):
        Run.open(tmp_path / "nowhere")
