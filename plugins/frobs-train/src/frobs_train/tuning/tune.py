"""Searching for settings: each trial is a run, or one for each seed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from frobs_core.errors import ConfigurationError, RunError, UnknownParameterError
from frobs_core.files import write_text
from frobs_core.validation import whole_number
from frobs_core.yaml import dump_yaml
from frobs_train.configuration.config import RunConfig, algorithm_record
from frobs_train.configuration.resolve import resolve_config
from frobs_train.errors import SearchSpaceError
from frobs_train.evaluation.evaluate import Evaluation, evaluate
from frobs_train.training.monitor import Progress
from frobs_train.training.session import check_environment
from frobs_train.training.train import train
from frobs_train.tuning.search_space import SearchSpace, load_space, setting
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


@dataclass(frozen=True, kw_only=True)
class Search:
    """What is searched, and how.

    Attributes:
        environment: Gymnasium ID; None: the file has it.
        trials: How many the study shall have in the end, those of earlier commands and other processes included.
        file: A YAML file with the keys of :class:`RunConfig`: what all trials have in common.
        flags: As those of :func:`frobs_train.resolve_config`; ``seed`` is the first seed of each trial.
        settings: ``"algorithm_config.n_steps=16"``; what is set is not searched.
        space: A YAML file with the search space; None: the one that the algorithm offers.
        folder: Of the study; None: ``studies/<ID>/<algorithm>``.
        storage: Any Optuna storage URL; None: the SQLite file ``study.db`` in the folder.
        name: Of the study in the storage; None: ``<ID>/<algorithm>``.
        seeds: Runs of each trial, with seeds that follow each other.
        episodes: Of the evaluation at the end of each run.
        metric: ``"success"`` or ``"reward"``; None: success where the environment tells it.
        sampler: How settings are chosen: ``tpe``, ``gp`` or ``random``.
        pruner: How trials that promise little are ended: ``median``, ``halving``, ``hyperband`` or ``none``.
    """

    environment: str | None = None
    trials: int = 50
    file: Path | str | None = None
    flags: Mapping[str, Any] = field(default_factory=dict)
    settings: Sequence[str] = ()
    space: Path | str | None = None
    folder: Path | str | None = None
    storage: str | None = None
    name: str | None = None
    seeds: int = 1
    episodes: int = 200
    metric: Literal["success", "reward"] | None = None
    sampler: str = "tpe"
    pruner: str = "median"

    def resolve(self, chosen: Mapping[str, Any] | None = None) -> RunConfig:
        """Return the configuration of a trial, or, with nothing chosen, what all have in common.

        Raises:
            UnknownNameError: No algorithm has the name.
            ConfigurationError: A setting is unknown or cannot be used.
        """
        more = [setting(key, value) for key, value in (chosen or {}).items()]
        return resolve_config(self.environment, file=self.file, flags=self.flags, settings=[*self.settings, *more])


def tune(
    search: Search,
    on_trial: Callable[[StudyResult, TrialResult], None] | None = None,
    on_progress: Callable[[int, int, Progress], None] | None = None,
) -> StudyResult:
    """Search until the study has its number of trials; a study that is there is continued.

    Several processes may do the same at once on one storage; each then ends the trial that it has begun, so that there
    may be a few more. A trial that fails is recorded, and does not end the study; nor does it count among the trials
    when Ctrl-C ended it.

    Args:
        search: What is searched, and how.
        on_trial: Called after each trial of this process.
        on_progress: Called during one, with its number, the index of its seed and the progress of that run.

    Returns:
        What the study has found, in all processes.

    Raises:
        RunError: Optuna is not installed, or the folder holds the trials of another study.
        UnknownNameError: No such environment ID or algorithm.
        ConfigurationError: A setting, the search space, the storage or a number cannot be used.
    """
    for name, value in (("trials", search.trials), ("seeds", search.seeds), ("episodes", search.episodes)):
        whole_number(name, value, 1)
    base = search.resolve()
    space = _space(search, base)
    check_environment(base)
    identifier = f"{base.environment.rpartition(':')[2]}/{base.algorithm}"
    folder = Path(search.folder) if search.folder is not None else Path("studies") / identifier
    storage = search.storage or f"sqlite:///{(folder / 'study.db').resolve()}"
    if search.storage is None:
        folder.mkdir(parents=True, exist_ok=True)
    study = open_study(search.name or identifier, storage, search.sampler, search.pruner, search.seeds)
    if (folder / "trials").exists() and not study.get_trials(deepcopy=False):  # in this order: others work, too
        raise RunError(f"{folder} holds trials, and the study none; choose another --study-dir, or remove the folder.")
    hold_together(
        study,
        {
            "configuration": base.model_copy(update={"seed": None}).model_dump(mode="json"),
            "search space": {key: dimension.model_dump(mode="json") for key, dimension in space.items()},
            "number of seeds": [base.seed or 0, search.seeds],
            "metric": search.metric,
        },
    )

    def found() -> StudyResult:
        return _result(study, search, storage, folder)

    def after(study: optuna.Study, trial: optuna.trial.FrozenTrial) -> None:
        result = found()
        if on_trial is not None:
            on_trial(result, to_result(trial))
        if _finished(study) >= search.trials:
            study.stop()

    if _finished(study) < search.trials:
        objective = _Objective(search, base, space, folder, on_progress)
        with quiet():
            study.optimize(objective, callbacks=[after], catch=(Exception,))
    return found()


class _Objective:
    """Trains and evaluates what a trial chooses."""

    def __init__(
        self,
        search: Search,
        base: RunConfig,
        space: SearchSpace,
        folder: Path,
        on_progress: Callable[[int, int, Progress], None] | None,
    ) -> None:
        self._search, self._base, self._space, self._folder = search, base, space, folder
        self._on_progress = on_progress

    def __call__(self, trial: optuna.Trial) -> float:
        import optuna

        chosen = {key: dimension.draw(trial, key) for key, dimension in self._space.items()}
        trial.set_user_attr("settings", chosen)
        values: list[float] = []
        try:
            for index in range(self._search.seeds):
                values.append(self._run(trial, chosen, index, values))
        except optuna.TrialPruned:
            raise
        except KeyboardInterrupt:
            trial.set_user_attr("error", "interrupted")
            raise
        except Exception as error:
            trial.set_user_attr("error", f"{type(error).__name__}: {error}")
            raise
        return float(np.mean(values))

    def _run(self, trial: optuna.Trial, chosen: Mapping[str, Any], index: int, before: Sequence[float]) -> float:
        import optuna

        seed = (self._base.seed or 0) + index
        config = self._search.resolve(chosen).model_copy(update={"seed": seed})
        path = self._folder / "trials" / f"{trial.number:04d}" / f"seed{seed}"
        trial.set_user_attr("runs", [*trial.user_attrs.get("runs", ()), str(path)])
        reported, stopped = 0, False

        def watch(progress: Progress) -> bool:
            nonlocal reported, stopped
            if self._on_progress is not None:
                self._on_progress(trial.number, index, progress)
            value = self._metric(progress.success, progress.reward)
            part = REPORTS * progress.steps // progress.total_steps
            if value is None or part <= reported or part >= REPORTS:  # the end is evaluated
                return True
            reported = part
            trial.report(float(np.mean([*before, value])), REPORTS * index + part)
            stopped = trial.should_prune()
            return not stopped

        run = train(config, path, watch)
        if stopped:
            raise optuna.TrialPruned
        value = self._final(evaluate(run, self._search.episodes))
        trial.report(float(np.mean([*before, value])), REPORTS * (index + 1))
        return value

    def _metric(self, success: float | None, reward: float | None) -> float | None:
        wanted = self._search.metric or ("success" if success is not None else "reward")
        return success if wanted == "success" else reward

    def _final(self, found: Evaluation) -> float:
        value = self._metric(found.success_rate, found.mean_reward)
        if value is None:
            raise RunError(f"{found.environment} tells no success; search by --metric reward.")
        return value


def _space(search: Search, base: RunConfig) -> SearchSpace:
    """Return what is searched: the space without what is set, each of its keys tried once."""
    fixed = {text.partition("=")[0].strip() for text in search.settings}
    full = load_space(algorithm_record(base.algorithm), search.space)
    space = {key: dimension for key, dimension in full.items() if key not in fixed}
    if not space:
        raise SearchSpaceError("nothing is left to search: every setting of the search space is set.")
    for key, dimension in space.items():
        try:
            search.resolve({key: dimension.example})
        except UnknownParameterError as error:
            raise SearchSpaceError(f"the search space names '{key}': {error}", key) from error
        except ConfigurationError:
            continue  # a value that another setting may make usable: the trial that chooses it tells
    return space


def _finished(study: optuna.Study) -> int:
    """Return how many trials count: not those that run, nor those that Ctrl-C ended."""
    return sum(result.state != "running" and result.error != "interrupted" for result in results(study))


def _result(study: optuna.Study, search: Search, storage: str, folder: Path) -> StudyResult:
    trials = results(study)
    complete = [trial for trial in trials if trial.state == "complete" and trial.value is not None]
    best = max(complete, key=lambda trial: trial.value or 0.0, default=None)
    path = None
    if best is not None:
        path = folder / "best.yaml"
        count = f"{search.seeds} seed{'s' if search.seeds > 1 else ''}"
        header = f"# Trial {best.number} of study '{study.study_name}': {best.value:.6g} over {count}.\n"
        config = search.resolve(best.settings).model_dump(mode="json")
        write_text(path, header + dump_yaml({key: value for key, value in config.items() if key != "seed"}))
    return StudyResult(
        name=study.study_name,
        storage=_without_password(storage),
        folder=folder,
        trials=trials,
        best=best,
        best_config=path,
    )


def _without_password(url: str) -> str:
    from sqlalchemy import make_url

    return make_url(url).render_as_string(hide_password=True)
