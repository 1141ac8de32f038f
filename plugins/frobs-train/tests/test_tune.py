"""Searches on a point that shall come to 0, with PPO's smallest trainings."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import optuna
import pytest

from frobs_core.util.errors import ConfigurationError, RunError, UnknownNameError
from frobs_core.util.files import write_json
from frobs_train import Progress, Run, Search, StudyResult, TrialResult, resolve_config, tune
from frobs_train.configuration.config import algorithm_record
from frobs_train.plots.plot_search import plot_search, setting_importance
from frobs_train.tuning.search_space import load_space
from frobs_train.tuning.study import PRUNERS, SAMPLERS, open_study, quiet
from frobs_train.tuning.tune import Session

LINE = "FrobsTests/Line-v0"
FAST = ("algorithm_config.batch_size=20", "algorithm_config.n_epochs=1")


@pytest.fixture
def space(tmp_path: Path) -> Path:
    file = tmp_path / "space.yaml"
    file.write_text(
        "algorithm_config.learning_rate: {type: float, low: 1e-4, high: 1e-2, log: true}\n"
        "algorithm_config.n_steps: [10, 20]\n"
    )
    return file


def search(tmp_path: Path, **changes: Any) -> Search:
    given: dict[str, Any] = {
        "environment": LINE,
        "trials": 2,
        "flags": {"num_envs": 2, "steps": 60, "seed": 4},
        "settings": FAST,
        "space": tmp_path / "space.yaml",
        "folder": tmp_path / "study",
        "episodes": 4,
        "sampler": "random",
        "pruner": "none",
    }
    return Search(**{**given, **changes})


def test_each_trial_is_a_run_for_each_seed_and_the_best_becomes_a_file(space: Path, tmp_path: Path) -> None:
    told: list[int] = []
    found = tune(search(tmp_path, seeds=2), lambda study, trial: told.append(trial.number))
    assert told == [0, 1]
    assert [trial.state for trial in found.trials] == ["complete", "complete"]
    trials = tmp_path / "study" / "trials"
    assert [path.parent.name + path.name for path in found.trials[1].runs] == ["0001seed4", "0001seed5"]
    run = Run.open(trials / "0001" / "seed5")
    assert run.config.seed == 5
    assert run.config.algorithm_config["learning_rate"] == found.trials[1].settings["algorithm_config.learning_rate"]
    rates = [Run.open(path).evaluations()[0]["success_rate"] for path in found.trials[1].runs]
    assert found.trials[1].value == pytest.approx(sum(rates) / 2)
    assert found.best is not None
    best = resolve_config(LINE, file=found.best_config)
    assert best.seed is None
    assert best.algorithm_config["n_steps"] == found.best.settings["algorithm_config.n_steps"]
    assert best.num_envs == 2


def test_the_reward_decides_among_trials_with_the_same_success(
    space: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("frobs_train.tuning.tune._final", lambda search, evaluation: 0.0)
    found = tune(search(tmp_path, trials=3))
    rewards = {trial.number: Run.open(trial.runs[0]).evaluations()[-1]["mean_reward"] for trial in found.trials}
    assert found.best is not None
    assert found.tied
    assert len(set(rewards.values())) == 3
    assert found.best.number == max(rewards, key=rewards.__getitem__)
    assert not tune(search(tmp_path, trials=1, folder=tmp_path / "one")).tied


def test_trials_with_the_same_reward_are_not_reported_as_tied_in_success(space: Path, tmp_path: Path) -> None:
    session = Session(search(tmp_path, environment="CartPole-v1"))
    found = {"steps": 60, "episodes": 4, "mean_reward": 500.0}
    for number in range(2):
        run = Run.create(tmp_path / "study" / "trials" / str(number) / "seed4", session.base)
        write_json(run.path / "evaluations" / "a.json", found)
        attributes = {"settings": {}, "runs": [str(run.path)]}
        session.study.add_trial(optuna.trial.create_trial(value=500.0, user_attrs=attributes))
    assert not session.result().tied
    for path in (tmp_path / "study").glob("trials/*/*/evaluations/a.json"):
        write_json(path, {**found, "success_rate": 1.0})
    assert session.result().tied


def test_a_report_shows_importance_and_slices(space: Path, tmp_path: Path) -> None:
    few = tune(search(tmp_path, trials=2, metric="reward"))
    with pytest.raises(RunError, match="2 complete trials, too few"):
        plot_search(few, tmp_path / "report.png")
    found = tune(search(tmp_path, trials=5, metric="reward"))
    importance = setting_importance(found)
    assert set(importance) == {"algorithm_config.learning_rate", "algorithm_config.n_steps"}
    assert sum(importance.values()) == pytest.approx(1.0)
    assert plot_search(found, tmp_path / "report.svg").read_text("utf-8").count("learning_rate") >= 2


def test_a_study_goes_on_where_it_stopped(space: Path, tmp_path: Path) -> None:
    tune(search(tmp_path, trials=1))
    assert len(tune(search(tmp_path, trials=2)).trials) == 2
    assert len(tune(search(tmp_path, trials=2)).trials) == 2


def test_a_study_is_not_continued_with_something_else(space: Path, tmp_path: Path) -> None:
    tune(search(tmp_path, trials=1))
    with pytest.raises(ConfigurationError, match="started with a different configuration"):
        tune(search(tmp_path, flags={"num_envs": 2, "steps": 80, "seed": 4}))
    with pytest.raises(ConfigurationError, match="a different search space"):
        tune(search(tmp_path, settings=(*FAST, "algorithm_config.n_steps=10")))


def test_what_is_set_is_not_searched(space: Path, tmp_path: Path) -> None:
    found = tune(search(tmp_path, trials=1, settings=(*FAST, "algorithm_config.n_steps=30")))
    assert list(found.trials[0].settings) == ["algorithm_config.learning_rate"]
    section = "algorithm_config={n_steps: 30, batch_size: 20, n_epochs: 1}"
    found = tune(search(tmp_path, trials=1, settings=(section,), folder=tmp_path / "section"))
    assert list(found.trials[0].settings) == ["algorithm_config.learning_rate"]
    assert Run.open(found.trials[0].runs[0]).config.algorithm_config["n_steps"] == 30
    everything = ("algorithm_config.n_steps=30", "algorithm_config.learning_rate=1e-3")
    with pytest.raises(ConfigurationError, match="nothing is left"):
        tune(search(tmp_path, settings=everything, folder=tmp_path / "other"))


def test_what_a_flag_sets_is_not_searched(tmp_path: Path) -> None:
    chosen = Search(environment="CartPole-v1", flags={"num_envs": 2, "steps": None}, folder=tmp_path / "study")
    assert "num_envs" in load_space(algorithm_record("ppo"))
    assert {"num_envs", "algorithm_config.n_steps"} - {*Session(chosen).space} == {"num_envs"}


def test_a_trial_that_fails_is_recorded_and_the_study_goes_on(space: Path, tmp_path: Path) -> None:
    space.write_text("algorithm_config.gamma: [1.5]\n")
    found = tune(search(tmp_path, trials=2))
    assert [trial.state for trial in found.trials] == ["failed", "failed"]
    assert "gamma is 1.5" in found.trials[0].error
    assert (found.best, found.best_config) == (None, None)


def test_a_trial_that_promises_little_is_ended_early(space: Path, tmp_path: Path) -> None:
    class Last(optuna.pruners.BasePruner):
        def prune(self, study: optuna.Study, trial: optuna.trial.FrozenTrial) -> bool:
            return trial.number > 0

    steps: dict[int, int] = {}

    def watch(number: int, index: int, progress: Progress) -> None:
        steps[number] = progress.steps

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("frobs_train.tuning.study._pruner", lambda name, seeds: Last())
        chosen = search(tmp_path, settings=(*FAST, "algorithm_config.n_steps=10", "log_every=20"))
        found = tune(chosen, on_progress=watch)
    assert [trial.state for trial in found.trials] == ["complete", "pruned"]
    assert found.trials[1].value is not None
    assert steps == {0: 60, 1: 20}
    assert found.best is not None
    assert found.best.number == 0


def test_ctrl_c_leaves_a_study_that_goes_on(space: Path, tmp_path: Path) -> None:
    def interrupt(number: int, index: int, progress: Progress) -> None:
        if number == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        tune(search(tmp_path), on_progress=interrupt)
    found = tune(search(tmp_path))
    assert [(trial.state, trial.error) for trial in found.trials] == [
        ("complete", ""),
        ("failed", "interrupted"),
        ("complete", ""),
    ]


@pytest.mark.slow
def test_two_processes_work_on_one_study(space: Path, tmp_path: Path) -> None:
    arguments = ["tune", "CartPole-v1", "--trials", "4", "--steps", "64", "--num-envs", "2", "--episodes", "2"]
    arguments += ["--space", str(space), "--study-dir", str(tmp_path / "study"), "--json"]
    processes = [
        subprocess.Popen([sys.executable, "-m", "frobs_cli", *arguments], stdout=subprocess.DEVNULL) for _ in range(2)
    ]
    assert [process.wait(timeout=120) for process in processes] == [0, 0]
    study = optuna.load_study(study_name="CartPole-v1/ppo", storage=f"sqlite:///{tmp_path / 'study' / 'study.db'}")
    assert 4 <= len(study.trials) <= 5
    assert {trial.state.name for trial in study.trials} == {"COMPLETE"}


@pytest.mark.slow
def test_environments_without_success_are_searched_by_reward(space: Path, tmp_path: Path) -> None:
    found = tune(search(tmp_path, trials=1, environment="CartPole-v1"))
    assert (found.trials[0].value or 0.0) > 1
    [failed] = tune(
        search(tmp_path, trials=1, environment="CartPole-v1", metric="success", folder=tmp_path / "other")
    ).trials
    assert "--metric reward" in failed.error


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        pytest.param({"environment": "FrobsTests/Lime-v0"}, UnknownNameError, "Did you mean", id="ID"),
        pytest.param({"flags": {"algorithm": "pppo"}}, UnknownNameError, "Did you mean 'ppo'", id="algorithm"),
        pytest.param({"settings": ["environment_kwargs.wdth=2"]}, ConfigurationError, "wdth", id="keyword"),
        pytest.param({"trials": 0}, ConfigurationError, "trials is 0", id="number"),
        pytest.param({"sampler": "tea"}, ConfigurationError, "one of tpe, gp, random", id="sampler"),
        pytest.param({"storage": "nowhere://x"}, ConfigurationError, "cannot be opened in the storage", id="storage"),
    ],
)
def test_bad_input_is_told_before_the_first_trial(
    changes: dict[str, Any], error: type[Exception], message: str, space: Path, tmp_path: Path
) -> None:
    with pytest.raises(error, match=message):
        tune(search(tmp_path, **changes))
    assert not (tmp_path / "study" / "trials").exists()


def test_an_unknown_key_of_the_space_is_told_before_the_first_trial(space: Path, tmp_path: Path) -> None:
    space.write_text("algorithm_config.learning_rat: [1, 2]\n")
    with pytest.raises(ConfigurationError, match="Did you mean 'learning_rate'"):
        tune(search(tmp_path))


def test_trials_of_another_study_are_left_alone(space: Path, tmp_path: Path) -> None:
    (tmp_path / "study" / "trials").mkdir(parents=True)
    with pytest.raises(RunError, match="another --study-dir"):
        tune(search(tmp_path))


@pytest.mark.parametrize(
    ("sampler", "pruner"), [("tpe", "median"), ("gp", "halving"), ("random", "hyperband"), ("tpe", "none")]
)
def test_samplers_and_pruners_have_names(sampler: str, pruner: str, tmp_path: Path) -> None:
    assert sampler in SAMPLERS
    assert pruner in PRUNERS
    with quiet():
        study = open_study("s", f"sqlite:///{tmp_path / 'study.db'}", sampler, pruner, seeds=2)
        study.optimize(lambda trial: trial.suggest_float("x", 0, 1), n_trials=2)
    assert len(study.trials) == 2


def test_a_result_says_what_json_can_hold(space: Path, tmp_path: Path) -> None:
    trial = TrialResult(number=0, state="failed", value=None, settings={}, runs=(), seconds=1.0, error="e")
    found = StudyResult(
        name="n", storage="s", folder=tmp_path, trials=(trial,), best=None, tied=False, best_config=None
    )
    assert found.to_dict()["trials"][0]["error"] == "e"
