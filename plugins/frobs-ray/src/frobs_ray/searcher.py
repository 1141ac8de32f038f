"""Adapter from an Optuna study to Ray Tune. The study selects the trials' settings and records the trials' results."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Self

import optuna
from optuna.trial import TrialState
from ray.actor import ActorHandle
from ray.tune import Callback
from ray.tune.experiment import Trial
from ray.tune.search import Searcher

from frobs_ray.mailbox import collect
from frobs_train.training.monitor import Progress
from frobs_train.tuning.study import REPORTS, StudyResult, TrialResult, to_result
from frobs_train.tuning.tune import Session

_RUNNER = "runner"
"""Name of the trial attribute that marks this runner's trials. A restarted search continues marked trials that have not
ended."""


class _Stays:
    """Base class for objects that Ray must not pickle.

    Ray pickles objects in order to restore a search, but FRobs restores searches itself.
    """

    def __getstate__(self) -> dict[str, Any]:
        return {}

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self


class StudyTrials:
    """The trials that this search starts or continues."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.begun: dict[int, optuna.Trial] = {}
        frozen = session.study.get_trials(deepcopy=False, states=(TrialState.RUNNING,))
        self._unfinished = [trial for trial in frozen if trial.user_attrs.get(_RUNNER) == "ray"]
        self.left = max(0, session.search.trials - session.finished)

    def next(self) -> dict[str, Any] | None:
        """Return the number and settings of the next trial, or None if the study has enough trials."""
        if len(self.begun) >= self.left:
            return None
        if self._unfinished:
            frozen = self._unfinished.pop(0)
            trial = optuna.Trial(self._session.study, frozen._trial_id)
        else:
            trial = self._session.study.ask()
            self._session.draw(trial)
            trial.set_user_attr(_RUNNER, "ray")
        self.begun[trial.number] = trial
        return {"number": trial.number, "settings": trial.user_attrs["settings"]}


class StudySearcher(_Stays, Searcher):
    """Searcher that provides Ray Tune with the study's settings for each trial."""

    def __init__(self, trials: StudyTrials) -> None:
        super().__init__(metric="value", mode="max")
        self._trials = trials

    def suggest(self, trial_id: str) -> Any:
        """Return the configuration of the next trial."""
        return self._trials.next() or Searcher.FINISHED

    def on_trial_complete(self, trial_id: str, result: dict[str, Any] | None = None, error: bool = False) -> None:
        """Do nothing, because :class:`Recorder` records results."""

    def save(self, checkpoint_path: str) -> None:
        """Do nothing, because the study has its own storage."""

    def restore(self, checkpoint_path: str) -> None:
        """Do nothing, because the study has its own storage."""


class Recorder(_Stays, Callback):
    """Callback that records Ray Tune's results in the study."""

    def __init__(
        self,
        session: Session,
        trials: StudyTrials,
        mailbox: ActorHandle[Any],
        on_trial: Callable[[StudyResult, TrialResult], None] | None,
        on_progress: Callable[[int, int, Progress], None] | None,
    ) -> None:
        self._session, self._trials, self._mailbox = session, trials, mailbox
        self._on_trial, self._on_progress = on_trial, on_progress
        self._reported: dict[int, int] = {}

    def on_step_end(self, iteration: int, trials: list[Trial], **info: Any) -> None:
        """Forward the progress of the trials to ``on_progress``."""
        if self._on_progress is not None:
            for (number, index), progress in collect(self._mailbox).items():
                self._on_progress(number, index, progress)

    def on_trial_result(
        self, iteration: int, trials: list[Trial], trial: Trial, result: dict[str, Any], **info: Any
    ) -> None:
        """Record an intermediate value of a trial."""
        number = int(str(trial))
        if "step" in result and result["step"] > self._reported.get(number, -1):
            self._reported[number] = result["step"]
            self._trials.begun[number].report(result["value"], result["step"])

    def on_trial_complete(self, iteration: int, trials: list[Trial], trial: Trial, **info: Any) -> None:
        """Record whether a trial was completed, was stopped early, or failed."""
        result = trial.last_result or {}
        if "error" in result:
            self._tell(trial, TrialState.FAIL, error=result["error"])
        elif result.get("step", 0) >= REPORTS * self._session.search.seeds:
            self._tell(trial, TrialState.COMPLETE, result["value"], result["settings"])
        else:
            self._tell(trial, TrialState.PRUNED)

    def on_trial_error(self, iteration: int, trials: list[Trial], trial: Trial, **info: Any) -> None:
        """Record that a trial failed because its process or node died too many times."""
        self._tell(trial, TrialState.FAIL, error="its process died repeatedly")

    def _tell(
        self,
        trial: Trial,
        state: TrialState,
        value: float | None = None,
        settings: dict[str, Any] | None = None,
        error: str = "",
    ) -> None:
        known = self._trials.begun[int(str(trial))]
        if error:
            known.set_user_attr("error", error)
        if settings is not None:
            known.set_user_attr("settings", settings)  # population-based training may have changed the settings
        frozen = self._session.study.tell(known, value, state=state)
        if self._on_trial is not None:
            self._on_trial(self._session.result(), to_result(frozen))
