"""Search for better training settings. Each trial trains one run per seed."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from frobs_cli.facts import dotted
from frobs_core.util.errors import ConfigurationError, RunError, UnknownParameterError
from frobs_core.util.files import write_text
from frobs_core.util.validation import whole_number
from frobs_core.util.yaml import dump_yaml, merge
from frobs_train.configuration.config import RunConfig, algorithm_record
from frobs_train.configuration.resolve import read_setting
from frobs_train.errors import SearchSpaceError
from frobs_train.evaluation.evaluate import Evaluation, evaluate
from frobs_train.runs.evaluation_files import is_as_trained
from frobs_train.runs.run import Run, is_run
from frobs_train.training.monitor import Progress
from frobs_train.training.session import check_environment
from frobs_train.training.train import train
from frobs_train.tuning.search import Search
from frobs_train.tuning.search_space import SearchSpace, load_space
from frobs_train.tuning.study import (
    REPORTS,
    StudyResult,
    TrialResult,
    hold_together,
    open_study,
    quiet,
    results,
    to_result,
)

if TYPE_CHECKING:
    import optuna


class Session:
    """An open study, which draws settings and records results. Several processes can open the same study.

    ``base`` is the configuration that all trials share, and ``study`` is the Optuna study.
    """

    def __init__(self, search: Search) -> None:
        for name, value in (("trials", search.trials), ("seeds", search.seeds), ("episodes", search.episodes)):
            whole_number(name, value, 1)
        self.search = search
        self.base = search.resolve()
        self.space = _space(search, self.base)
        check_environment(self.base)
        identifier = f"{self.base.environment.rpartition(':')[2]}/{self.base.algorithm}"
        self.folder = Path(search.folder) if search.folder is not None else Path("studies") / identifier
        self._storage = search.storage or f"sqlite:///{(self.folder / 'study.db').resolve()}"
        if search.storage is None:
            self.folder.mkdir(parents=True, exist_ok=True)
        self.study = open_study(search.name or identifier, self._storage, search.sampler, search.pruner, search.seeds)
        trials = self.folder / "trials"
        # The folder is checked before the study, because other processes may add trials.
        if trials.exists() and not self.study.get_trials(deepcopy=False):
            raise RunError(
                f"{self.folder} contains runs of trials, but the study has no trials; choose another --study-dir, or "
                "remove this folder."
            )
        hold_together(
            self.study,
            {
                "configuration": self.base.model_copy(update={"seed": None}).model_dump(mode="json"),
                "search space": {key: dimension.model_dump(mode="json") for key, dimension in self.space.items()},
                "number of seeds": [self.base.seed or 0, search.seeds],
                "metric": search.metric,
            },
        )

    @property
    def finished(self) -> int:
        """Number of finished trials, excluding running and interrupted trials."""
        return sum(result.state != "running" and result.error != "interrupted" for result in results(self.study))

    def draw(self, trial: optuna.Trial) -> dict[str, Any]:
        """Draw and record the settings of a trial."""
        chosen = {key: dimension.draw(trial, key) for key, dimension in self.space.items()}
        trial.set_user_attr("settings", chosen)
        paths = run_folders(self.search, self.base, self.folder, trial.number)
        trial.set_user_attr("runs", [str(path) for path in paths.values()])
        return chosen

    def result(self) -> StudyResult:
        """Return the results of the study so far, and write ``best.yaml``."""
        from sqlalchemy import make_url

        trials = results(self.study)
        complete = [trial for trial in trials if trial.state == "complete" and trial.value is not None]
        best = max(complete, key=lambda trial: trial.value or 0.0, default=None)
        tied = (
            len(complete) > 1 and len({trial.value for trial in complete}) == 1 and self._measures_success(complete[0])
        )
        if tied:
            best = max(complete, key=_mean_reward)
        path = None
        if best is not None:
            path = self.folder / "best.yaml"
            count = f"{self.search.seeds} seed{'s' if self.search.seeds > 1 else ''}"
            header = f"# Trial {best.number} of study '{self.study.study_name}': {best.value:.6g} over {count}.\n"
            config = self.search.resolve(best.settings).model_dump(mode="json", exclude={"seed"})
            write_text(path, header + dump_yaml(config))
        return StudyResult(
            name=self.study.study_name,
            storage=make_url(self._storage).render_as_string(hide_password=True),
            folder=self.folder,
            trials=trials,
            best=best,
            tied=tied,
            best_config=path,
        )

    def _measures_success(self, trial: TrialResult) -> bool:
        """Return whether the value of a complete trial is a success rate."""
        reported = (result.get("success_rate") for result in _evaluations(trial))
        return self.search.metric != "reward" and any(rate is not None for rate in reported)


def tune(
    search: Search,
    on_trial: Callable[[StudyResult, TrialResult], None] | None = None,
    on_progress: Callable[[int, int, Progress], None] | None = None,
) -> StudyResult:
    """Search until the study has the requested number of trials. An existing study is continued.

    Several processes can work on the same study at once. Each process finishes its current trial, so the study may end
    with a few more trials than requested. Failed trials are recorded and do not end the study. Trials that were
    interrupted by Ctrl-C are not counted.

    Args:
        search: Settings of the search.
        on_trial: Called after each trial of this process.
        on_progress: Called during a trial with the trial's number, the index of the seed and the progress of the run.

    Returns:
        The results of the study, including trials of other processes.

    Raises:
        RunError: Optuna is not installed, or the folder contains the trials of another study.
        UnknownNameError: The environment ID or algorithm does not exist.
        ConfigurationError: A setting, the search space, the storage or a numeric argument is invalid.
    """
    if search.pruner == "population":
        raise ConfigurationError(
            "population-based training runs its trials in parallel; add --runner ray, or choose another --pruner."
        )
    session = Session(search)

    def after(study: optuna.Study, trial: optuna.trial.FrozenTrial) -> None:
        if on_trial is not None:
            on_trial(session.result(), to_result(trial))
        if session.finished >= search.trials:
            study.stop()

    def objective(trial: optuna.Trial) -> float:
        import optuna

        def report(step: int, value: float) -> bool:
            trial.report(value, step)
            return not trial.should_prune()

        def tell(index: int, progress: Progress) -> None:
            if on_progress is not None:
                on_progress(trial.number, index, progress)

        chosen = session.draw(trial)
        try:
            value = run_trial(search, session.folder, trial.number, chosen, report, tell)
        except KeyboardInterrupt:
            trial.set_user_attr("error", "interrupted")
            raise
        except Exception as error:
            trial.set_user_attr("error", f"{type(error).__name__}: {error}")
            raise
        if value is None:
            raise optuna.TrialPruned
        return value

    if session.finished < search.trials:
        with quiet():
            session.study.optimize(objective, callbacks=[after], catch=(Exception,))
    return session.result()


def run_folders(search: Search, base: RunConfig, folder: Path, number: int) -> dict[int, Path]:
    """Return the run folder of each seed of a trial."""
    first = base.seed or 0
    return {seed: folder / "trials" / f"{number:04d}" / f"seed{seed}" for seed in range(first, first + search.seeds)}


def run_trial(
    search: Search,
    folder: Path,
    number: int,
    chosen: Mapping[str, Any],
    report: Callable[[int, float], bool],
    on_progress: Callable[[int, Progress], None],
    *,
    on_existing: str = "error",
) -> float | None:
    """Train and evaluate one run for each seed of a trial, and return the mean of the metric over the seeds.

    The function ``report`` is called with the number of the report, in [0, ``REPORTS`` × seeds], and the mean of the
    metric so far. If it returns False, the trial ends without a result. ``on_progress`` is called with the index of a
    seed and the progress of its run.
    """
    config = search.resolve(chosen)
    values: list[float] = []
    for index, (seed, path) in enumerate(run_folders(search, config, folder, number).items()):
        reported, stopped = 0, False

        def watch(progress: Progress, index: int = index) -> bool:
            nonlocal reported, stopped
            on_progress(index, progress)
            value = _metric(search, progress.success, progress.reward)
            part = REPORTS * progress.steps // progress.total_steps
            if value is None or part <= reported or part >= REPORTS:  # an evaluation measures the final value
                return True
            reported = part
            stopped = not report(REPORTS * index + part, float(np.mean([*values, value])))
            return not stopped

        run = train(config.model_copy(update={"seed": seed}), path, watch, on_existing=on_existing)
        if stopped:
            return None
        values.append(_final(search, evaluate(run, search.episodes)))
        report(REPORTS * (index + 1), float(np.mean(values)))
    return float(np.mean(values))


def _mean_reward(trial: TrialResult) -> float:
    """Return the mean reward in the newest evaluations of a trial's runs, or −∞ if one is missing."""
    rewards = [float(result["mean_reward"]) for result in _evaluations(trial)]
    return float(np.mean(rewards)) if len(rewards) == len(trial.runs) else -math.inf


def _evaluations(trial: TrialResult) -> list[dict[str, Any]]:
    """Return the newest evaluation of each of a trial's runs that has one."""
    found = [list(filter(is_as_trained, Run.open(path).evaluations())) for path in trial.runs if is_run(path)]
    return [results[-1] for results in found if results]


def _metric(search: Search, success: float | None, reward: float | None) -> float | None:
    metric = search.metric or ("success" if success is not None else "reward")
    return success if metric == "success" else reward


def _final(search: Search, found: Evaluation) -> float:
    value = _metric(search, found.success_rate, found.mean_reward)
    if value is None:
        raise RunError(f"{found.environment} does not report success; search with --metric reward.")
    return value


def _space(search: Search, base: RunConfig) -> SearchSpace:
    """Return the search space without the fixed settings, after checking that its keys exist."""
    fixed = {*dotted(merge(*map(read_setting, search.settings)))}
    flags = [name for name, value in search.flags.items() if value is not None]
    fixed.update(flags, (f"environment_kwargs.{name}" for name in flags))
    full = load_space(algorithm_record(base.algorithm), search.space)
    space = {key: dimension for key, dimension in full.items() if not any(_overlap(key, name) for name in fixed)}
    if not space:
        raise SearchSpaceError("nothing is left to search: every setting of the search space has a fixed value.")
    for key, dimension in space.items():
        try:
            search.resolve({key: dimension.example})
        except UnknownParameterError as error:
            raise SearchSpaceError(f"the search space names '{key}': {error}", key) from error
        except ConfigurationError:
            continue  # the value may be valid with other settings; if not, the trial fails
    return space


def _overlap(key: str, other: str) -> bool:
    """Return whether two dotted keys are equal, or one of them names a section that contains the other."""
    return f"{key}.".startswith(f"{other}.") or f"{other}.".startswith(f"{key}.")
