from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from frobs_cli.errors import CommandLineError
from frobs_core.util.errors import ConfigurationError, FrobsError
from frobs_core.util.files import write_json
from frobs_train import Run, RunConfig, load_runner
from frobs_train.cli.runner_options import RunnerChoice
from frobs_train.cli.study import study
from frobs_train.comparison.study import (
    Study,
    missing_evaluations,
    missing_trainings,
    read_study,
    run_jobs,
    study_folders,
    write_study,
)

SETTINGS = {"steps": 64, "num_envs": 2, "algorithm_config": {"n_steps": 16, "n_epochs": 1}}
SMALL = Study(environments=["CartPole-v1"], seeds=2, episodes=2, settings=SETTINGS)


def finish(study: Study, folder: Path) -> list[list[str]]:
    """Run what is missing, and return the names of the trainings and of the evaluations."""
    names = []
    for find in (missing_trainings, missing_evaluations):
        jobs = find(study, folder)
        outcomes = list(run_jobs(jobs, folder, load_runner("local"))) if jobs else []
        assert not [outcome.error for outcome in outcomes if outcome.error]
        names.append([job.name for job in jobs])
    return names


@pytest.mark.slow
def test_a_study_runs_only_what_is_missing(tmp_path: Path) -> None:
    both = ["CartPole-v1/ppo_seed0", "CartPole-v1/ppo_seed1"]
    assert finish(SMALL, tmp_path) == [both, both]
    assert finish(SMALL, tmp_path) == [[], []]
    shutil.rmtree(tmp_path / both[0])
    shutil.rmtree(tmp_path / both[1] / "evaluations")
    assert finish(SMALL, tmp_path) == [both[:1], both]
    more = SMALL.model_copy(update={"seeds": [0, 1, 7], "episodes": 3})
    assert finish(more, tmp_path) == [["CartPole-v1/ppo_seed7"], [*both, "CartPole-v1/ppo_seed7"]]
    page, found = write_study(more, tmp_path)
    text = page.read_text("utf-8")
    assert "3 runs: 1 environment × 1 algorithm × 3 seeds, each evaluated in 3 new episodes." in text
    assert "- `steps`: `64`" in text
    assert [score.seed for score in found.groups[0].runs] == [0, 1, 7]
    for name in ("results.png", "results.pdf", "results.csv", "results.tex"):
        assert (tmp_path / name).stat().st_size
        assert name in text
    other = SMALL.model_copy(update={"settings": {**SETTINGS, "num_envs": 4}})
    [first, _] = missing_trainings(other, tmp_path)
    [outcome] = run_jobs([first], tmp_path, load_runner("local"))
    assert "num_envs" in str(outcome.error)  # an existing run with other settings is neither replaced nor used


@pytest.mark.slow
def test_a_run_that_ended_early_is_complete(tmp_path: Path) -> None:
    learning = {"n_steps": 50, "learning_rate": 1e-2, "gamma": 0.8}
    settings: dict[str, Any] = {"steps": 100_000, "num_envs": 4, "evaluate_every": 400, "evaluation_episodes": 20}
    settings |= {"checkpoint_every": 50_000, "stop_at_success": 0.5, "algorithm_config": learning}
    study = Study(environments=["FrobsTests/Line-v0"], seeds=1, episodes=2, settings=settings)
    name = "FrobsTests/Line-v0/ppo_seed0"
    assert finish(study, tmp_path) == [[name], [name]]
    assert finish(study, tmp_path) == [[], []]
    notes = write_study(study, tmp_path)[1].notes
    assert any("of 100,000 steps: an evaluation measured" in note for note in notes)
    assert not any("unfinished" in note for note in notes)


def test_only_an_evaluation_as_trained_completes_a_run(tmp_path: Path) -> None:
    study = SMALL.model_copy(update={"seeds": 1})
    [(path, flags)] = study_folders(study, tmp_path).items()
    run = Run.create(path, RunConfig(**{**flags, **SETTINGS}))
    found = {"steps": 64, "episodes": 2, "mean_reward": 1.0}
    for name, changes in (("elsewhere", {"simulator": "x"}), ("sampled", {"deterministic": False})):
        write_json(run.path / "evaluations" / f"{name}.json", {**found, **changes})
    assert len(missing_evaluations(study, tmp_path)) == 1
    write_json(run.path / "evaluations" / "as_trained.json", found)
    assert not missing_evaluations(study, tmp_path)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("algorithms: [ppo]", "environments"),
        ("environments: []", "environments"),
        ("environments: [A-v0]\nseed: 3", "seeds"),
        ("environments: [A-v0, A-v0]", "a value twice"),
        ("environments: [A-v0]\nseeds: [1, 1]", "a value twice"),
        ("environments: [A-v0]\nseeds: 0", "seeds"),
        ("environments: [A-v0]\nepisodes: many", "episodes"),
        ("environments: [A-v0]\nsettings: {seed: 7}", "settings.seed would be ignored; write the key 'seeds'"),
    ],
)
def test_a_bad_file_is_named(content: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "study.yaml").write_text(content, "utf-8")
    with pytest.raises(ConfigurationError, match=says):
        read_study(tmp_path / "study.yaml")


def test_a_file_without_an_ending_is_not_taken_for_the_folder(tmp_path: Path) -> None:
    (tmp_path / "study").write_text("environments: [CartPole-v1]", "utf-8")
    with pytest.raises(CommandLineError, match=r"--out: .*study is a file"):
        study(tmp_path / "study", RunnerChoice())


@pytest.mark.parametrize(
    "changes", [{"algorithms": ["pppo"]}, {"settings": {"stepps": 3}}, {"environments": ["frobs/Irb120Reech-v0"]}]
)
def test_a_study_is_checked_before_it_begins(changes: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(FrobsError, match="Did you mean"):
        missing_trainings(SMALL.model_copy(update=changes), tmp_path)


def test_each_id_is_trained_with_its_own_algorithm_unless_others_are_chosen(tmp_path: Path) -> None:
    study = Study(environments=["frobs/PandaPushVision-v0", "CartPole-v1"], seeds=1)
    folders = study_folders(study, tmp_path)
    assert [str(folder.relative_to(tmp_path)) for folder in folders] == [
        "frobs/PandaPushVision-v0/dagger_seed0",
        "CartPole-v1/ppo_seed0",
    ]


def test_folders_tell_environments_of_two_namespaces_apart(tmp_path: Path) -> None:
    study = Study(environments=["a/Reach-v0", "b/Reach-v0", "module:c/Reach-v0"], algorithms=["ppo", "sac"], seeds=2)
    assert len(study_folders(study, tmp_path)) == 12
