from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import Result

from frobs_train import Run, RunConfig, StudyResult, TrialResult
from frobs_train.logs.progress import STEPS, ProgressLog


def make(path: Path, seed: int, success: float | None, **config: Any) -> str:
    run = Run.create(path, RunConfig(environment="X-v0", seed=seed, steps=100, **config))
    with ProgressLog(run.path) as log:
        row = {STEPS: 100, "time/elapsed": 61.0, "episode/count": 3, "episode/reward": -2.5}
        log.write({**row, "episode/success": success})
    return str(run.path)


def test_groups_stand_in_a_table_with_what_is_sure(frobs: Callable[..., Result], tmp_path: Path) -> None:
    good = [make(tmp_path / f"good{seed}", seed, 0.9, num_envs=4) for seed in range(3)]
    bad = [make(tmp_path / f"bad{seed}", seed, 0.1 * seed) for seed in range(3)]
    out = tmp_path / "picture.png"
    result = frobs("compare", *good, *bad, "--threshold", "0.5", "--plot", str(out))
    assert result.exit_code == 0, result.stderr
    lines = result.stdout.splitlines()
    assert lines[0] == "X-v0"
    assert "steps to 50 %" in lines[1]
    assert "num_envs=4" in lines[2]
    assert "90.0 %" in lines[2]
    assert "1:01" in lines[2]
    assert "0 of 3 reached it" in lines[3]
    assert "100 %" in result.stdout
    assert str(out) in result.stdout
    assert "evaluated" in result.stderr
    assert out.is_file()


def test_json_has_it_all(facts: Callable[..., Any], tmp_path: Path) -> None:
    found = facts("compare", make(tmp_path / "a", 0, None), make(tmp_path / "b", 1, None))
    assert found["metric"] == "reward"
    assert found["groups"][0]["final"] == {"value": -2.5, "low": None, "high": None}
    assert found["groups"][0]["runs"][1]["seed"] == 1
    assert found["notes"]
    assert {found[name] for name in ("picture", "csv", "markdown", "latex")} == {None}


def test_json_names_the_files_that_were_written(facts: Callable[..., Any], tmp_path: Path) -> None:
    files = {name: str(tmp_path / f"table.{name}") for name in ("csv", "markdown", "latex")}
    options = [word for name, path in files.items() for word in (f"--{name}", path)]
    found = facts("compare", make(tmp_path / "a", 0, None), *options)
    assert {name: found[name] for name in files} == files
    assert all(Path(path).is_file() for path in files.values())


def test_a_folder_that_is_no_run_is_bad_input(frobs: Callable[..., Result], tmp_path: Path) -> None:
    result = frobs("compare", str(tmp_path))
    assert result.exit_code == 2
    assert "contains no config.yaml" in result.stderr


def test_a_picture_of_unknown_format_is_reported_before_the_work(
    frobs: Callable[..., Result], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def work(*_: Any) -> None:
        pytest.fail("the command did the work first")

    monkeypatch.setattr("frobs_train.cli.compare._evaluate", work)
    monkeypatch.setattr("frobs_train.cli.tune._watched", work)
    run = make(tmp_path / "a", 0, 0.9)
    for command in (("compare", run, "--evaluate", "5", "--plot"), ("tune", "CartPole-v1", "--report")):
        result = frobs(*command, "picture.gif")
        assert result.exit_code == 2
        assert "ends in .png, .pdf or .svg" in result.stderr


def test_a_search_too_short_for_a_report_is_still_printed(
    frobs: Callable[..., Result], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trial = TrialResult(number=0, state="complete", value=7.0, settings={}, runs=(), seconds=1.0, error="")
    study = StudyResult(
        name="n", storage="s", folder=tmp_path, trials=(trial,), best=trial, tied=False, best_config=tmp_path / "b.yaml"
    )
    monkeypatch.setattr("frobs_train.cli.tune._watched", lambda *_: study)
    result = frobs("tune", "CartPole-v1", "--report", str(tmp_path / "report.png"))
    assert result.exit_code == 2
    assert "1 complete trials, too few" in result.stderr
    assert "7 in trial 0" in result.stdout
