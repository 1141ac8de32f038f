"""A run from training to pictures, on a small environment of others."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import Result

from frobs_core.util.yaml import load_yaml

Frobs = Callable[..., Result]
Facts = Callable[..., Any]
TRAIN = ("--steps", "512", "--num-envs", "2", "--seed", "3", "--set", "algorithm_config.n_steps=64")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from typer.testing import CliRunner

    from frobs_cli.program import program

    path = tmp_path_factory.mktemp("runs") / "first"
    result = CliRunner().invoke(program(), ["train", "CartPole-v1", *TRAIN, "--run-dir", str(path)], prog_name="frobs")
    assert result.exit_code == 0, result.stderr
    assert f"frobs evaluate {path}" in result.stdout
    assert "training CartPole-v1 with ppo: 512 steps, 2 environments, seed 3" in result.stderr
    return path


def test_train_writes_facts_as_json(facts: Facts, tmp_path: Path) -> None:
    found = facts("train", "CartPole-v1", *TRAIN, "--run-dir", str(tmp_path / "run"))
    assert found["run"] == str(tmp_path / "run")
    assert found["steps"] == 512
    assert found["seed"] == 3
    assert found["success"] is None  # CartPole does not say
    assert found["reward"] > 0


def test_train_leaves_a_folder_that_exists_alone(frobs: Frobs, run: Path) -> None:
    before = {path: path.stat().st_mtime_ns for path in run.rglob("*")}
    result = frobs("train", "CartPole-v1", *TRAIN, "--run-dir", str(run))
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1
    assert "exists" in result.stderr
    assert before == {path: path.stat().st_mtime_ns for path in run.rglob("*")}


def test_settings_outrank_flags_and_flags_outrank_the_file(frobs: Frobs, facts: Facts, tmp_path: Path) -> None:
    file = tmp_path / "settings.yaml"
    file.write_text("steps: 1\nnum_envs: 2\nalgorithm_config:\n  n_steps: 8\n  gamma: 0.5\n")
    path = tmp_path / "run"
    args = ("--steps", "32", "--set", "algorithm_config.gamma=0.75", "--config", str(file), "--run-dir", str(path))
    assert frobs("train", "CartPole-v1", *args).exit_code == 0
    [found] = facts("show", str(path))
    assert found["config"]["steps"] == 32
    assert found["config"]["num_envs"] == 2
    assert found["config"]["algorithm_config"]["n_steps"] == 8
    assert found["config"]["algorithm_config"]["gamma"] == 0.75


def test_evaluate_measures_several_runs_in_one_table(frobs: Frobs, facts: Facts, run: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    shutil.copytree(run, other)
    result = frobs("evaluate", str(run), str(other), "--episodes", "4")
    assert result.exit_code == 0, result.stderr
    header, *rows = result.stdout.splitlines()
    assert header.split() == ["environment", "run", "success", "95", "%", "interval", "reward", "episodes"]
    assert [row.split()[:2] for row in rows] == [["CartPole-v1", str(path)] for path in (run, other)]
    assert [row["run"] for row in facts("evaluate", str(run), str(other), "--episodes", "4")] == [str(run), str(other)]


def test_an_evaluation_that_fails_leaves_the_others(frobs: Frobs, run: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken"
    shutil.copytree(run, broken)
    shutil.rmtree(broken / "checkpoints")
    result = frobs("evaluate", str(broken), str(run), "--episodes", "4")
    assert result.exit_code == 1
    assert str(run) in result.stdout
    assert f"error: 1 of 2 jobs failed. {broken}: " in result.stderr


def test_experts_of_several_environments_are_evaluated(facts: Facts) -> None:
    found = facts("evaluate", "frobs/PandaPush-v0", "frobs/PandaLift-v0", "--expert", "--episodes", "1")
    assert [row["environment"] for row in found] == ["frobs/PandaPush-v0", "frobs/PandaLift-v0"]


def test_a_model_file_is_evaluated_alone(frobs: Frobs) -> None:
    result = frobs("evaluate", "CartPole-v1", "Acrobot-v1", "--model", "model.zip")
    assert result.exit_code == 2
    assert "--model: this option requires a single RUN" in result.stderr


def test_compare_evaluates_first(frobs: Frobs, facts: Facts, run: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    shutil.copytree(run, other)
    found = facts("compare", str(run), str(other), "--evaluate", "3")
    scores = found["groups"][0]["runs"]
    assert [score["source"] for score in scores] == ["evaluation", "evaluation"]
    assert len(list((other / "evaluations").glob("*_3episodes.json"))) == 1
    assert "--runner: this option requires --evaluate N" in frobs("compare", str(run), "--runner", "ray").stderr


def test_evaluate_measures(frobs: Frobs, facts: Facts, run: Path) -> None:
    found = facts("evaluate", str(run), "--episodes", "6", "--seed", "4")
    assert {"success_rate", "success_interval", "mean_reward", "mean_length", "episodes"} <= set(found)
    assert found["episodes"] == 6
    assert found["mean_reward"] == found["mean_length"]
    text = frobs("evaluate", str(run), "--episodes", "6", "--seed", "4").stdout
    assert f"{found['mean_reward']:.2f} per episode" in text


def test_show_tells_about_the_run_on_one_screen(frobs: Frobs, run: Path) -> None:
    text = frobs("show", str(run)).stdout
    assert "512 steps" in text
    assert "CartPole-v1" in text
    assert len(text.splitlines()) < 24
    assert "1 thread" in text


def test_show_config_is_yaml_that_trains_again(frobs: Frobs, run: Path, tmp_path: Path) -> None:
    file = tmp_path / "again.yaml"
    file.write_text(frobs("show", str(run), "--config").stdout)
    path = tmp_path / "again"
    args = ("--config", str(file), "--steps", "128", "--run-dir", str(path))
    assert frobs("train", "CartPole-v1", *args).exit_code == 0
    assert load_yaml(path / "config.yaml") == {**load_yaml(run / "config.yaml"), "steps": 128}


def test_resume_leaves_a_complete_run_and_extends_it(frobs: Frobs, facts: Facts, tmp_path: Path) -> None:
    path = tmp_path / "run"
    assert frobs("train", "CartPole-v1", *TRAIN, "--run-dir", str(path)).exit_code == 0
    assert facts("resume", str(path))["steps"] == 512
    found = facts("resume", str(path), "--steps", "640")
    assert found["steps"] == 640
    assert load_yaml(path / "config.yaml")["steps"] == 640
    result = frobs("resume", str(path), "--steps", "100")
    assert result.exit_code == 2
    assert "must be at least 640" in result.stderr


def test_train_again_in_a_folder_that_exists(frobs: Frobs, tmp_path: Path) -> None:
    path = tmp_path / "run"
    train = ("train", "CartPole-v1", *TRAIN, "--run-dir", str(path))
    assert frobs(*train).exit_code == 0
    assert "resuming CartPole-v1" not in frobs(*train, "--on-existing", "resume").stderr
    assert str(tmp_path / "run_2") in frobs(*train, "--on-existing", "increment").stdout
    result = frobs(*train, "--on-existing", "incremnt")
    assert "did you mean 'increment'?" in result.stderr


def test_plot_draws_one_run_and_several(frobs: Frobs, run: Path, tmp_path: Path) -> None:
    out = tmp_path / "both.png"
    result = frobs("plot", str(run), str(run), "--out", str(out))
    assert result.stdout == f"{out}\n"
    assert out.read_bytes().startswith(b"\x89PNG")
    one = Path(frobs("plot", str(run)).stdout.strip())
    assert one.is_relative_to(run)
    assert one.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
@pytest.mark.needs("rendering")
def test_play_records_a_video(frobs: Frobs, tmp_path: Path) -> None:
    run, out = tmp_path / "run", tmp_path / "play.mp4"
    args = ("--steps", "64", "--num-envs", "2", "--set", "algorithm_config.n_steps=32", "--run-dir", str(run))
    assert frobs("train", "frobs/Irb120Reach-v0", *args).exit_code == 0
    result = frobs("play", str(run), "--video", str(out), "--episodes", "1")
    assert result.stdout == f"{out}\n"
    assert b"ftyp" in out.read_bytes()[:16]


def test_bench_says_where_the_time_goes(frobs: Frobs, facts: Facts) -> None:
    found = facts("bench", "frobs/Irb120Reach-v0", "--steps", "20")
    assert found["ratio"] > 0
    assert set(found["parts"]) == {"engine", "controller", "task", "environment", "wrappers"}
    assert "× " not in json.dumps(found)
    assert "engine" in frobs("bench", "frobs/Irb120Reach-v0", "--steps", "20").stdout


@pytest.mark.needs("rendering")
def test_bench_measures_the_cameras(frobs: Frobs, facts: Facts) -> None:
    found = facts("bench", "frobs/PandaPickAndPlace-v0", "--cameras", "--num-envs", "1,2")
    assert [(each["num_envs"], each["size"]) for each in found["speeds"]] == [
        (count, size) for count in (1, 2) for size in (64, 128, 256)
    ]
    assert all(each["seconds"] > 0.0 for each in found["speeds"])


def test_bench_refuses_what_has_no_camera(frobs: Frobs) -> None:
    result = frobs("bench", "Pendulum-v1", "--cameras")
    assert result.exit_code == 2
    assert "'Pendulum-v1' is not a FRobs environment" in result.stderr
    assert "requires --training" in frobs("bench", "frobs/Irb120Reach-v0", "--cameras", "--algorithm", "sac").stderr
