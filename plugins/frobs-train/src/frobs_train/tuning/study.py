"""Studies, which store the trials of a search and their results."""

from __future__ import annotations

import contextlib
import json
import time
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from frobs_core.errors import ParameterValueError, RunError
from frobs_train.errors import StudyError

if TYPE_CHECKING:
    import optuna

SAMPLERS = ("tpe", "gp", "random")
"""Methods that choose settings: tree-structured Parzen estimator, Gaussian process, or random."""

PRUNERS = ("median", "halving", "hyperband", "population", "none")
"""Methods that stop unpromising trials: below the median, successive halving, Hyperband, or none. ``population``
replaces them by variants of better trials, which only a runner on a cluster supports."""

REPORTS = 20
"""Number of reports of a run to the pruner, at equal numbers of steps."""

_State = Literal["running", "complete", "pruned", "failed"]

_ATTEMPTS = 5

_HEARTBEAT = 60  # [s] if a process is silent for twice as long, its trial counts as failed


@dataclass(frozen=True, kw_only=True)
class TrialResult:
    """A trial: its settings and its result.

    Attributes:
        number: Number in the study, from 0.
        state: ``"running"``, ``"complete"``, ``"pruned"`` or ``"failed"``.
        value: Mean of the metric over seeds; for a pruned trial, the last reported value; None if there is none.
        settings: Chosen settings, by dotted key.
        runs: Run folders.
        seconds: Duration [s]; None while it is running.
        error: Error that ended the trial; empty if it has not failed.
    """

    number: int
    state: _State
    value: float | None
    settings: Mapping[str, Any]
    runs: tuple[Path, ...]
    seconds: float | None
    error: str


@dataclass(frozen=True, kw_only=True)
class StudyResult:
    """Results of a search so far.

    Attributes:
        name: Name of the study in its storage.
        storage: URL of the storage.
        folder: Folder with the runs and ``best.yaml``.
        trials: Trials of all processes, in order.
        best: Best complete trial; None if there is none.
        best_config: File with the configuration of the best trial, for ``frobs train --config``.
    """

    name: str
    storage: str
    folder: Path
    trials: tuple[TrialResult, ...]
    best: TrialResult | None
    best_config: Path | None

    def to_dict(self) -> dict[str, Any]:
        """Return values that JSON can represent."""
        return asdict(self)


def open_study(name: str, storage: str, sampler: str, pruner: str, seeds: int) -> optuna.Study:
    """Open or create a study with ``seeds`` runs per trial. ``storage`` is any database URL that Optuna supports."""
    try:
        import optuna
    except ImportError as error:
        raise RunError("a search needs Optuna: pip install 'frobs-train[tune]'.") from error
    for what, value, known in (("sampler", sampler, SAMPLERS), ("pruner", pruner, PRUNERS)):
        if value not in known:
            raise ParameterValueError(what, value, f"one of {', '.join(known)}")
    with quiet():
        try:
            return optuna.create_study(
                storage=_database(storage),
                study_name=name,
                direction="maximize",
                load_if_exists=True,
                sampler=_sampler(sampler),
                pruner=_pruner(pruner, seeds),
            )
        except Exception as error:  # each database has its own exceptions
            reason = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
            raise StudyError(
                name,
                f"cannot open the storage '{storage}': {reason}; pass a URL such as 'sqlite:///study.db' or "
                "'postgresql://user@host/database', whose driver is installed.",
            ) from error


def _database(url: str) -> optuna.storages.RDBStorage:
    import optuna
    from sqlalchemy.exc import IntegrityError, OperationalError

    # If two processes write to one SQLite file, each waits for the other.
    engine = {"connect_args": {"timeout": 60}} if url.startswith("sqlite") else {}
    for attempt in range(_ATTEMPTS):
        try:
            return optuna.storages.RDBStorage(
                url, engine_kwargs=engine, heartbeat_interval=_HEARTBEAT, grace_period=2 * _HEARTBEAT
            )
        except (IntegrityError, OperationalError):  # another process is creating the tables
            if attempt == _ATTEMPTS - 1:
                raise
            time.sleep(0.2 * 2**attempt)
    raise AssertionError


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Hide Optuna's log, and its warnings about experimental features."""
    import optuna

    level = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            yield
    finally:
        optuna.logging.set_verbosity(level)


def hold_together(study: optuna.Study, begun_with: Mapping[str, Any]) -> None:
    """Store the settings with which a study began, as JSON, and raise StudyError if they differ later."""
    known = study.user_attrs.get("frobs")
    now = json.loads(json.dumps(begun_with))
    if known is None:
        study.set_user_attr("frobs", now)
        return
    differing = [key for key in now if known.get(key) != now[key]]
    if differing:
        raise StudyError(
            study.study_name,
            f"was started with a different {' and a different '.join(differing)}; repeat the command "
            "that started the study, or start another study with --name and --study-dir.",
        )


def results(study: optuna.Study) -> tuple[TrialResult, ...]:
    """Return the trials of a study, in order."""
    return tuple(to_result(trial) for trial in study.get_trials(deepcopy=False))


def to_result(trial: optuna.trial.FrozenTrial) -> TrialResult:
    """Convert a trial of Optuna to a result."""
    from optuna.trial import TrialState

    names: dict[TrialState, _State] = {
        TrialState.COMPLETE: "complete",
        TrialState.PRUNED: "pruned",
        TrialState.FAIL: "failed",
    }
    attributes = trial.user_attrs
    state: _State = names.get(trial.state, "running")
    return TrialResult(
        number=trial.number,
        state=state,
        value=trial.value,
        settings=attributes.get("settings", {}),
        runs=tuple(Path(path) for path in attributes.get("runs", ())),
        seconds=None if trial.duration is None else trial.duration.total_seconds(),
        error=attributes.get("error", "its process died") if state == "failed" else "",
    )


def _sampler(name: str) -> optuna.samplers.BaseSampler:
    from optuna import samplers

    if name == "random":
        return samplers.RandomSampler()
    if name == "gp":
        return samplers.GPSampler()
    # A constant liar keeps parallel processes from trying the same settings. A seed would be shared by all of them.
    return samplers.TPESampler(multivariate=True, constant_liar=True)


def _pruner(name: str, seeds: int) -> optuna.pruners.BasePruner:
    from optuna import pruners

    if name == "median":
        return pruners.MedianPruner(n_startup_trials=5, n_warmup_steps=REPORTS // 4)
    if name == "halving":
        return pruners.SuccessiveHalvingPruner(min_resource=REPORTS // 4, reduction_factor=2)
    if name == "hyperband":
        return pruners.HyperbandPruner(min_resource=2, max_resource=REPORTS * seeds, reduction_factor=3)
    return pruners.NopPruner()
