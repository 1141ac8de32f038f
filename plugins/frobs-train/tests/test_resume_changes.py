"""Resuming a run with other settings, by ``--set`` or by an edit of its ``config.yaml``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from frobs_core.util.errors import ConfigurationError, RunError
from frobs_train import Run, RunConfig, evaluate, resume, train

FAST = {"n_steps": 8, "batch_size": 16, "n_epochs": 1, "policy_kwargs": {"net_arch": [8]}, "learning_rate": 1e-3}
SETTINGS: dict[str, Any] = {"num_envs": 2, "steps": 32, "seed": 0, "algorithm_config": FAST, "log_every": 1}
REACH = "frobs/Irb120Reach-v0"


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """A complete run of 32 steps."""
    return train(RunConfig(environment=REACH, environment_kwargs={"tolerance": 0.05}, **SETTINGS), tmp_path / "run")


def edit(run: Run, old: str, new: str) -> None:
    path = run.path / "config.yaml"
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


@pytest.mark.parametrize(
    ("old", "new", "key", "reason"),
    [
        ("learning_rate: 0.001", "learning_rate: 0.5", r"algorithm_config\.learning_rate", "an optimizer"),
        ("- 8\n", "- 9\n", r"algorithm_config\.policy_kwargs\.net_arch", "networks"),
        ("seed: 0", "seed: 1", "seed", "random numbers"),
        ("stagger: false", "stagger: true", "stagger", "episodes that began"),
        ("num_envs: 2", "num_envs: 3", "num_envs", "number of environments"),
        ("tolerance: 0.05", "simulator: pybullet", r"environment_kwargs\.simulator", "the checkpoints depend"),
        ("algorithm: ppo", "algorithm: a2c", "algorithm", "networks"),
    ],
)
def test_an_edit_of_what_a_run_keeps_is_rejected(run: Run, old: str, new: str, key: str, reason: str) -> None:
    edit(run, old, new)
    with pytest.raises(RunError, match=rf"config\.yaml: {key} cannot change from .* to .*, because .*{reason}"):
        resume(run.path, steps=64)
    assert Run.open(run.path).config == run.config


def test_an_edited_file_is_reported_and_the_configuration_that_was_used_counts(
    run: Run, caplog: pytest.LogCaptureFixture
) -> None:
    edit(run, "tolerance: 0.05", "tolerance: 0.5")
    edited = Run.open(run.path)
    assert edited.config.environment_kwargs["tolerance"] == 0.05
    evaluate(edited, 1)
    assert "config.yaml was edited: environment_kwargs.tolerance" in caplog.text


def test_an_edit_of_what_may_change_is_applied_reported_and_recorded(
    run: Run, caplog: pytest.LogCaptureFixture
) -> None:
    edit(run, "tolerance: 0.05", "tolerance: 0.5")
    longer = resume(run.path, steps=64)
    assert "environment_kwargs.tolerance is 0.5 from step 32 on; the previous value was 0.05" in caplog.text
    assert longer.config.environment_kwargs["tolerance"] == 0.5
    [change] = Run.open(run.path).changes
    assert change["steps"] == 32
    assert change["settings"]["environment_kwargs.tolerance"] == {"from": 0.05, "to": 0.5}
    assert change["settings"]["steps"] == {"from": 32, "to": 64}


def test_settings_change_what_may_change(run: Run) -> None:
    resume(run, settings=["steps=48", "keep_checkpoints=9", "threads.simulator=1"])
    longer = resume(run.path, steps=64, settings=["environment_kwargs.tolerance=0.02"])
    assert Run.open(run.path).config == longer.config
    assert "tolerance: 0.02" in (run.path / "config.yaml").read_text("utf-8")
    assert [list(change["settings"]) for change in longer.changes] == [
        ["steps", "keep_checkpoints", "threads.simulator"],
        ["environment_kwargs.tolerance", "steps"],
    ]
    assert [change["steps"] for change in longer.changes] == [32, 48]


@pytest.mark.parametrize(
    ("setting", "key"),
    [
        ("algorithm_config.learning_rate=0.5", "learning_rate"),
        ("num_envs=4", "num_envs"),
        ("environment_kwargs.simulator=pybullet", "simulator"),
        ("environment_kwargs.controller=tcp_delta_position", "controller"),
        ("threads.torch=2", "torch"),
        ("randomize.mass.scale=[0.9, 1.1]", "randomize"),
    ],
)
def test_settings_that_a_run_keeps_are_rejected(run: Run, setting: str, key: str) -> None:
    with pytest.raises(RunError, match=rf"--set: \S*{key}\S* cannot change from .* to"):
        resume(run, steps=64, settings=[setting])
    assert resume(run.path).changes == ()


@pytest.mark.parametrize("setting", ["log_evry=1", "steps=many", "environment_kwargs.tolerance=-1", "steps=16"])
def test_bad_settings_change_nothing(run: Run, setting: str) -> None:
    before = {path.name: path.read_bytes() for path in run.path.iterdir() if path.is_file()}
    with pytest.raises(ConfigurationError):
        resume(run, settings=["steps=64", setting])
    assert {path.name: path.read_bytes() for path in run.path.iterdir() if path.is_file()} == before


def test_a_run_of_an_older_version_records_its_configuration_when_it_is_resumed(run: Run) -> None:
    (run.path / "history.json").unlink()
    assert Run.open(run.path).config == run.config
    resume(run.path, steps=64)
    edit(run, "seed: 0", "seed: 1")
    with pytest.raises(RunError, match="seed cannot change from 0 to 1"):
        resume(run.path, steps=80)


def test_a_damaged_record_is_an_error(run: Run) -> None:
    (run.path / "history.json").write_text(json.dumps({"config": 1}))
    with pytest.raises(RunError, match=r"history\.json cannot be read"):
        Run.open(run.path)
