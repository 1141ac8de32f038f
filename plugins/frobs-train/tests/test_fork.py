from __future__ import annotations

from pathlib import Path

import pytest

from frobs_core.util.errors import ConfigurationError
from frobs_train import Run, RunConfig, resolve_config, resume, train
from frobs_train.logs.progress import read_progress
from frobs_train.runs.fork import fork_run


def half_trained(path: Path, algorithm: str = "ppo") -> tuple[Run, RunConfig]:
    settings = ["num_envs=4", "checkpoint_every=128", "log_every=1"]
    settings += ["algorithm_config.n_steps=16", "algorithm_config.batch_size=64"] if algorithm == "ppo" else []
    environment = "CartPole-v1" if algorithm == "ppo" else "Pendulum-v1"
    flags = {"algorithm": algorithm, "steps": 512, "seed": 5}
    config = resolve_config(environment, flags=flags, settings=settings)
    run = train(config, path, lambda progress: progress.steps < 256)
    return run, run.config


def changed(config: RunConfig, **settings: object) -> RunConfig:
    return config.model_copy(update={"algorithm_config": {**config.algorithm_config, **settings}})


def test_a_fork_continues_with_other_settings_and_records_them(tmp_path: Path) -> None:
    source, config = half_trained(tmp_path / "source")
    fork = fork_run(source.path, tmp_path / "fork", changed(config, learning_rate=0.01, gamma=0.9))
    assert fork.has_new_algorithm_settings
    assert not source.has_new_algorithm_settings
    finished = resume(fork, steps=512)
    steps = read_progress(finished.path / "progress.csv")["train/steps"]
    assert steps[-1] == 512
    (change,) = Run.open(finished.path).changes
    assert change["settings"]["algorithm_config.gamma"] == {"from": config.algorithm_config["gamma"], "to": 0.9}
    assert Run.open(source.path).newest_checkpoint()[0].steps < 512


def test_a_fork_with_the_same_settings_continues_exactly(tmp_path: Path) -> None:
    source, config = half_trained(tmp_path / "source")
    fork = resume(fork_run(source.path, tmp_path / "fork", config), steps=512)
    original = resume(source, steps=512)
    ours, theirs = (read_progress(run.path / "progress.csv") for run in (fork, original))
    assert ours["ppo/loss"] == pytest.approx(theirs["ppo/loss"], nan_ok=True, rel=0, abs=0)


def test_a_fork_replaces_what_was_there(tmp_path: Path) -> None:
    source, config = half_trained(tmp_path / "source")
    (tmp_path / "fork").mkdir()
    (tmp_path / "fork" / "old").touch()
    assert not (fork_run(source.path, tmp_path / "fork", config).path / "old").exists()


@pytest.mark.slow
def test_sac_can_change_its_learning_rate_but_not_its_networks(tmp_path: Path) -> None:
    source, config = half_trained(tmp_path / "source", "sac")
    resume(fork_run(source.path, tmp_path / "fork", changed(config, learning_rate=1e-3, batch_size=32)), steps=512)
    bad = fork_run(source.path, tmp_path / "bad", changed(config, buffer_size=10))
    with pytest.raises(ConfigurationError, match="buffer_size cannot change"):
        resume(bad, steps=512)
