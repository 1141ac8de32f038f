from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import psutil
import pytest
from two_nodes import TwoNodes, finish, wait_for

from frobs_core.util.errors import ConfigurationError
from frobs_ray.runner import RayRunner
from frobs_train import Run, Search, tune
from frobs_train.runners.runner import RunnerOptions
from frobs_train.tuning.tune import run_trial

SPACE = "algorithm_config.gamma: [0.9, 0.95, 0.98]\nalgorithm_config.learning_rate: {type: float, low: 1e-4, high: 1e-2, log: true}\n"
SMALL = ["num_envs=4", "algorithm_config.n_steps=16", "algorithm_config.batch_size=64", "log_every=64"]


def command(folder: Path, *more: str, steps: int = 2_000) -> list[str]:
    (folder / "space.yaml").write_text(SPACE, "utf-8")
    settings = [text for setting in SMALL for text in ("--set", setting)]
    space = ["--space", "space.yaml", "--episodes", "5", "--steps", str(steps)]
    return ["tune", "CartPole-v1", "--study-dir", "study", *space, *settings, "--json", *more]


def workers() -> list[psutil.Process]:
    """Return the processes in which trials run."""
    return [
        each for each in psutil.process_iter(["cmdline"]) if "ImplicitFunc.train" in "".join(each.info["cmdline"] or ())
    ]


@pytest.mark.slow
def test_a_study_survives_dead_workers_and_equals_one_without_ray(two_nodes: TwoNodes) -> None:
    process = two_nodes.start(*command(two_nodes.folder, "--trials", "10", "--pruner", "halving"))
    trials = two_nodes.folder / "study" / "trials"
    wait_for(lambda: len(list(trials.glob("*/seed0/progress.csv"))) >= 2 and workers(), process)
    for worker in workers():
        worker.kill()
    wait_for(lambda: len(list(trials.glob("*/seed0/progress.csv"))) >= 4, process)
    two_nodes.replace_second()
    finished = finish(process)
    assert finished.returncode == 0, finished.stderr
    found = json.loads(finished.stdout)
    assert [trial["number"] for trial in found["trials"]] == list(range(10))
    assert {trial["state"] for trial in found["trials"]} <= {"complete", "pruned"}
    # The last trials began after the failures. Trials that were resumed may differ, because CartPole has no snapshots.
    complete = [trial for trial in found["trials"] if trial["state"] == "complete"][-1]
    search = Search(
        environment="CartPole-v1",
        flags={"steps": 2_000},
        settings=SMALL,
        episodes=5,
        space=two_nodes.folder / "space.yaml",
    )
    alone = two_nodes.folder / "alone"
    value = run_trial(search, alone, 0, complete["settings"], lambda step, value: True, lambda index, progress: None)
    assert value == complete["value"]
    assert not (two_nodes.folder / "study" / "ray").exists()


@pytest.mark.slow
def test_an_interrupted_search_continues_its_trials_and_can_go_on_without_ray(two_nodes: TwoNodes) -> None:
    process = two_nodes.start(*command(two_nodes.folder, "--trials", "2", "--pruner", "none", steps=20_000))
    runs = [two_nodes.folder / "study" / "trials" / f"{number:04d}" / "seed0" for number in range(2)]
    wait_for(lambda: all(any(run.glob("checkpoints/step_*")) for run in runs), process)
    process.kill()
    finish(process)
    finished = two_nodes.run(*command(two_nodes.folder, "--trials", "2", "--pruner", "none", steps=20_000))
    assert finished.returncode == 0, finished.stderr
    found = json.loads(finished.stdout)
    assert [trial["state"] for trial in found["trials"]] == ["complete", "complete"]
    search = Search(
        environment="CartPole-v1",
        trials=3,
        flags={"steps": 20_000},
        settings=SMALL,
        episodes=5,
        space=two_nodes.folder / "space.yaml",
        folder=two_nodes.folder / "study",
        pruner="none",
    )
    assert [trial.state for trial in tune(search).trials] == ["complete"] * 3


@pytest.mark.slow
def test_a_population_takes_over_better_runs(two_nodes: TwoNodes) -> None:
    more = ["--trials", "2", "--pruner", "population"]
    finished = two_nodes.run(*command(two_nodes.folder, *more, steps=4_000))
    assert finished.returncode == 0, finished.stderr
    found = json.loads(finished.stdout)
    assert [trial["state"] for trial in found["trials"]] == ["complete", "complete"]
    runs = [Run.open(Path(two_nodes.folder, trial["runs"][0])) for trial in found["trials"]]
    changes = [change for run in runs for change in run.changes]
    assert changes
    assert all(key.startswith("algorithm_config.") for change in changes for key in change["settings"])
    for run, trial in zip(runs, found["trials"], strict=True):
        assert run.config.algorithm_config["gamma"] == trial["settings"]["algorithm_config.gamma"]


def test_a_population_needs_a_cluster_and_one_seed(tmp_path: Path) -> None:
    search: dict[str, Any] = {"environment": "CartPole-v1", "pruner": "population", "folder": tmp_path}
    with pytest.raises(ConfigurationError, match="--runner ray"):
        tune(Search(**search))
    with pytest.raises(ConfigurationError, match="one seed per trial"):
        RayRunner(RunnerOptions()).tune(Search(**search, seeds=2))
