from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frobs_core.util.errors import CheckpointError, ConfigurationError
from frobs_train import Run, RunConfig, evaluate, plot_runs, resolve_config, resume, train
from frobs_train.logs.progress import STEPS, read_progress, read_rows

LEARNING = {"n_steps": 50, "learning_rate": 1e-2, "gamma": 0.8}


def config(**changes: Any) -> RunConfig:
    values: dict[str, Any] = {"environment": "FrobsTests/Line-v0", "num_envs": 4, "steps": 1600, "seed": 1}
    values |= {"algorithm_config": LEARNING, "checkpoint_every": 400, "evaluate_every": 400, "evaluation_episodes": 20}
    return RunConfig(**{**values, **changes})


@pytest.fixture(scope="module")
def evaluated(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run with evaluations; do not change it."""
    return train(config(), tmp_path_factory.mktemp("runs") / "evaluated")


def algorithm_files(run: Run) -> dict[str, bytes]:
    folder = run.checkpoints[-1].path / "algorithm"
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file()}


def test_evaluations_are_columns_of_the_log(evaluated: Run) -> None:
    columns = read_progress(evaluated.path / "progress.csv")
    known = np.isfinite(columns["evaluation/success"])
    assert np.array(columns[STEPS])[known].tolist() == [400, 800, 1200, 1600]
    assert columns["evaluation/success"][-1] > columns["evaluation/success"][1]
    assert np.array(columns["evaluation/length"])[known].tolist() == [10, 10, 10, 10]


@pytest.mark.slow
def test_evaluating_changes_nothing_of_the_training(evaluated: Run, tmp_path: Path) -> None:
    plain = train(config(evaluate_every=None), tmp_path / "plain")
    assert algorithm_files(plain) == algorithm_files(evaluated)
    others = [
        {key: value for key, value in row.items() if not key.startswith(("time/", "evaluation/"))}
        for row in read_rows(evaluated.path / "progress.csv")
    ]
    times = {"time/elapsed", "time/steps_per_second"}
    assert others == [
        {k: v for k, v in row.items() if k not in times} for row in read_rows(plain.path / "progress.csv")
    ]


def test_the_best_policy_is_kept_and_can_be_asked_for(evaluated: Run) -> None:
    columns = read_progress(evaluated.path / "progress.csv")
    rank = [
        (success, reward)
        for success, reward in zip(columns["evaluation/success"], columns["evaluation/reward"], strict=True)
        if success == success
    ]
    checkpoint, _ = evaluated.find_checkpoint("best")
    assert checkpoint.steps == 400 * (rank.index(max(rank)) + 1)
    assert {path.name for path in (checkpoint.path / "algorithm").iterdir()} == {"algorithm.json", "policy.pt"}
    assert evaluate(evaluated, 4, checkpoint="best").steps == checkpoint.steps
    assert evaluate(evaluated, 4, checkpoint="800").steps == evaluate(evaluated, 4, checkpoint=800).steps == 800
    with pytest.raises(CheckpointError, match=r"no checkpoint 'worst'\. Available: newest, 800, 1200, 1600, best"):
        evaluate(evaluated, 4, checkpoint="worst")


def test_the_plot_has_the_evaluations(evaluated: Run, tmp_path: Path) -> None:
    assert plot_runs([evaluated], tmp_path / "curve.png").stat().st_size > 10_000


def test_a_success_that_is_enough_ends_the_training(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    run = train(config(steps=100_000, checkpoint_every=50_000, stop_at_success=0.5), tmp_path / "run")
    assert "stop_at_success is 50.0 %" in caplog.text
    [last] = run.checkpoints
    assert last.steps < 100_000
    assert last.steps == read_progress(run.path / "progress.csv")[STEPS][-1]
    caplog.clear()
    assert resume(run).checkpoints[-1].steps == last.steps
    assert "is complete after" in caplog.text


def test_a_threshold_without_effect_is_reported_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    small = {"n_steps": 16, "n_epochs": 1}
    chosen = config(environment="CartPole-v1", steps=128, evaluate_every=64, evaluation_episodes=2, stop_at_success=0.5)
    train(chosen.model_copy(update={"algorithm_config": small}), tmp_path / "run")
    assert caplog.text.count("stop_at_success has no effect, because CartPole-v1 does not report success") == 1


@pytest.mark.slow
def test_a_run_that_is_continued_does_not_lose_a_better_policy(tmp_path: Path) -> None:
    run = train(config(steps=800), tmp_path / "run")
    best = run.path / "checkpoints" / "best" / "best.json"
    best.write_text('{"steps": 400, "rank": [2.0, 0.0]}')
    from frobs_train.runs.checksums import write_checksums

    write_checksums(best.parent, [p for p in best.parent.rglob("*") if p.is_file() and p.name != "checksums.json"])
    resume(run, steps=1200)
    assert "2.0" in best.read_text()


def test_a_threshold_without_evaluations_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="stop_at_success needs evaluate_every"):
        resolve_config("CartPole-v1", settings=["stop_at_success=0.5"])
    with pytest.raises(ConfigurationError, match=r"stop_at_success is 2"):
        resolve_config("CartPole-v1", settings=["stop_at_success=2"])
