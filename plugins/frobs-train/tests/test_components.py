"""Wrappers and callbacks by name, and threads."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import pytest
from components_to_name import Diary

from frobs_core.util.errors import ConfigFileError, ConfigurationError
from frobs_train import ComponentConfig, RunConfig, decide_threads, record_video, resolve_config, train
from frobs_train.configuration.config import algorithm_record
from frobs_train.environments import make_vector_env
from frobs_train.logs.progress import read_progress
from frobs_train.training.exactness import why_not_exact

FAST = {"n_steps": 8, "batch_size": 16, "n_epochs": 1, "policy_kwargs": {"net_arch": [8]}}
REACH = "frobs/Irb120Reach-v0"


def config(**changes: Any) -> RunConfig:
    values: dict[str, Any] = {"environment": "FrobsTests/Line-v0", "num_envs": 2, "steps": 160, "seed": 0}
    return RunConfig(**{**values, "algorithm_config": FAST, "log_every": 1, **changes})


@pytest.mark.parametrize(
    "wrappers",
    [
        pytest.param([{"name": "components_to_name:Doubled", "factor": 2.0}], id="single"),
        pytest.param([{"name": "components_to_name:DoubledVector"}], id="vector"),
    ],
)
def test_wrappers_are_put_around_the_environment(wrappers: list[dict[str, Any]], tmp_path: Path) -> None:
    plain, wrapped = (
        read_progress(train(config(steps=16, wrappers=given), tmp_path / name).path / "progress.csv")
        for name, given in (("plain", []), ("wrapped", wrappers))
    )
    assert wrapped["ppo/value_loss"][0] > 1.5 * plain["ppo/value_loss"][0]


def test_a_wrapper_of_single_environments_makes_ours_stepped_one_by_one() -> None:
    for name, native in (("Doubled", False), ("DoubledVector", True)):
        env = make_vector_env(REACH, 2, {}, [ComponentConfig(name=f"components_to_name:{name}")])
        assert isinstance(env.unwrapped, gym.vector.SyncVectorEnv) is not native
        env.close()


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("components_to_name:Counting", None),
        ("gymnasium.wrappers.vector:ClipAction", None),
        ("components_to_name:DoubledVector", "the state of DoubledVector is not saved"),
        ("components_to_name:Doubled", "stepped one by one, does not support snapshots"),
    ],
)
def test_what_a_wrapper_remembers_decides_whether_a_run_continues_exactly(name: str, why: str | None) -> None:
    given = config(environment=REACH, wrappers=[{"name": name}])
    env = make_vector_env(REACH, 2, {}, given.wrappers)
    found = why_not_exact(given, env)
    env.close()
    assert found is None if why is None else why in (found or "")


def test_a_wrapper_whose_statistics_are_lost_is_reported(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    train(config(steps=16, wrappers=[{"name": "gymnasium.wrappers:NormalizeObservation"}]), tmp_path / "run")
    assert "use algorithm_config.normalize_observation instead" in caplog.text


def test_an_algorithm_can_declare_that_it_does_not_resume_exactly(monkeypatch: pytest.MonkeyPatch) -> None:
    env = make_vector_env(REACH, 2, {})
    given = config(environment=REACH)
    assert why_not_exact(given, env) is None
    record = replace(algorithm_record("ppo"), exact_resume=False)
    monkeypatch.setattr("frobs_train.training.exactness.algorithm_record", lambda name: record)
    assert "the algorithm ppo does not save its episodes" in (why_not_exact(given, env) or "")
    env.close()


def test_a_video_takes_wrappers_of_single_environments_alone(tmp_path: Path) -> None:
    run = train(config(steps=16, wrappers=[{"name": "components_to_name:DoubledVector"}]), tmp_path / "run")
    with pytest.raises(ConfigurationError, match="wraps a vector environment"):
        record_video(run, tmp_path / "x.mp4")


def test_callbacks_are_told_and_may_end_a_training(tmp_path: Path) -> None:
    Diary.entries.clear()
    given = [{"name": "components_to_name:Diary", "stop_at": 48}]
    run = train(config(checkpoint_every=32, callbacks=given), tmp_path / "run")
    assert Diary.entries == [
        "start 0", "row 16", "row 32", "checkpoint 32", "row 48", "checkpoint 48", "end 48"
    ]  # fmt: skip
    assert run.checkpoints[-1].steps == 48


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("wrappers: [{name: components_to_name:Dubled}]", ConfigFileError, r"bad\.yaml:1: .*Did you mean 'Doubled'"),
        (
            "wrappers:\n- name: components_to_name:Doubled\n  facto: 3",
            ConfigFileError,
            r"bad\.yaml:3: .*'facto'.*'factor'",
        ),
        ("wrappers:\n- name: nowhere:Doubled", ConfigFileError, r"bad\.yaml:2: .*cannot be imported from 'nowhere'"),
        (
            "wrappers:\n- name: components_to_name",
            ConfigFileError,
            r"bad\.yaml:2: .*is not of the form package\.module:Name",
        ),
        ("wrappers:\n- name: pathlib:Path", ConfigFileError, r"bad\.yaml:2: .*neither a gymnasium\.Wrapper"),
        ("wrappers:\n- factor: 2", ConfigurationError, r"needs wrappers\.0\.name"),
        ("callbacks:\n- {name: components_to_name:Diary, stopp_at: 3}", ConfigFileError, r"bad\.yaml:2: .*'stop_at'"),
        ("threads:\n  simulators: 3", ConfigFileError, r"bad\.yaml:2: .*'simulators'.*Did you mean 'simulator'"),
        ("threads:\n  torch: 0", ConfigFileError, r"bad\.yaml:2: .*threads\.torch is 0"),
        ("evaluate_evry: 3", ConfigFileError, r"bad\.yaml:1: .*Did you mean 'evaluate_every'"),
    ],
)
def test_a_mistake_is_named_with_its_line(text: str, error: type[Exception], message: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(text + "\n")
    with pytest.raises(error, match=message):
        resolve_config("CartPole-v1", file=path)


def test_a_mistake_in_a_setting_is_named() -> None:
    with pytest.raises(ConfigurationError, match=r"--set wrappers=.* has no parameter 'facto'"):
        resolve_config("CartPole-v1", settings=["wrappers=[{name: 'components_to_name:Doubled', facto: 3}]"])


def test_what_is_no_callback_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"derive its class from frobs_train\.TrainingCallback"):
        train(config(callbacks=[{"name": "components_to_name:no_callback"}]), tmp_path / "run")
    assert not list(tmp_path.iterdir())


def test_threads_are_decided_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("frobs_train.training.threads.usable_processors", lambda: 8)
    plain = resolve_config(REACH)
    assert str(decide_threads(plain)) == "8 processors: simulator 8 threads, torch 1 thread"
    assert decide_threads(plain.model_copy(update={"num_envs": 3})).simulator == 3
    chosen = resolve_config(REACH, settings=["threads={simulator: 2, torch: 4}"])
    assert chosen.algorithm_config["torch_threads"] == 4
    assert str(decide_threads(chosen)) == "8 processors: simulator 2 threads, torch 4 threads"
    assert decide_threads(resolve_config("CartPole-v1", settings=["threads=null"])).simulator is None
    with pytest.raises(ConfigurationError, match="cannot be combined"):
        resolve_config(REACH, settings=["threads.torch=2", "algorithm_config.torch_threads=3"])
