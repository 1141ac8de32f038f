"""Studies, which store the trials of a search and their results."""

from __future__ import annotations

import contextlib
import json
import time
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from frobs_core.util.errors import ParameterValueError, RunError
from frobs_core.util.install_hints import local_install_hint
from frobs_core.util.plain import spell_numbers, to_json
from frobs_train.errors import StudyError

if TYPE_CHECKING:
    import optuna

Sampler = Literal["tpe", "gp", "random"]
"""Methods that choose settings: tree-structured Parzen estimator, Gaussian process, or random sampling."""

Pruner = Literal["median", "halving", "hyperband", "population", "none"]
"""Methods that stop unpromising trials: median rule, successive halving, Hyperband, population, or none. ``population``
replaces unpromising trials with variants of better trials, and is supported only by cluster runners."""

SAMPLERS, PRUNERS = get_args(Sampler), get_args(Pruner)

REPORTS = 20
"""Number of reports that each run sends to the pruner, at equal step intervals."""

_State = Literal["running", "complete", "pruned", "failed"]

_ATTEMPTS = 5

_HEARTBEAT = 60  # heartbeat interval [s]; a trial fails if its process is silent for twice as long


@dataclass(frozen=True, kw_only=True)
class TrialResult:
    """Settings and result of a trial.

    Attributes:
        number: Number of the trial in its study, starting from 0.
        state: ``"running"``, ``"complete"``, ``"pruned"`` or ``"failed"``.
        value: Mean of the metric over seeds, or the last reported value of a pruned trial. None if no value exists.
        settings: Chosen settings, by dotted key.
        runs: Run folders.
        seconds: Duration [s], or None while the trial is running.
        error: Error that ended the trial, or an empty string if the trial has not failed.
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
        trials: Trials of all processes, ordered by number.
        best: Best complete trial, or None. If all have the same value, it is the one with the highest reward.
        tied: Whether all complete trials, at least two, have the same value of success.
        best_config: Configuration of the best trial for ``frobs train --config``, or None if no trial is complete.
    """

    name: str
    storage: str
    folder: Path
    trials: tuple[TrialResult, ...]
    best: TrialResult | None
    tied: bool
    best_config: Path | None

    def to_dict(self) -> dict[str, Any]:
        """Return the fields as JSON-serializable values."""
        return asdict(self)


def open_study(name: str, storage: str, sampler: str, pruner: str, seeds: int) -> optuna.Study:
    """Open or create a study with ``seeds`` runs per trial. ``storage`` is any database URL that Optuna supports."""
    try:
        import optuna
    except ImportError as error:
        hint = local_install_hint("pip install 'frobs-train[tune]'")
        raise RunError(f"a search requires Optuna; install it with: {hint}") from error
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
        except Exception as error:  # each database driver has its own exception types
            reason = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
            raise StudyError(
                name,
                f"cannot be opened in the storage '{storage}': {reason}; pass a URL such as 'sqlite:///study.db' or "
                "'postgresql://user@host/database', and install the driver of this database.",
            ) from error


def load_study(found: StudyResult) -> optuna.Study:
    """Return the Optuna study of a result, or raise StudyError if its storage needs a password, which results lack."""
    import optuna

    try:
        return optuna.load_study(study_name=found.name, storage=found.storage)
    except Exception as error:  # each database driver has its own exception types
        raise StudyError(found.name, f"cannot be opened in the storage '{found.storage}': {error}") from error


def _database(url: str) -> optuna.storages.RDBStorage:
    import optuna
    from sqlalchemy.exc import IntegrityError, OperationalError

    # If two processes write to the same SQLite file, one process waits for the other.
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
    """Suppress Optuna's log messages and its warnings about experimental features."""
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
    """Store the settings of a new study as JSON, or raise StudyError if the settings of an existing study differ."""
    known = study.user_attrs.get("frobs")
    now = json.loads(to_json(spell_numbers(begun_with)))
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
    """Return the trials of a study, ordered by number."""
    return tuple(to_result(trial) for trial in study.get_trials(deepcopy=False))


def to_result(trial: optuna.trial.FrozenTrial) -> TrialResult:
    """Convert an Optuna trial to a result."""
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
    # The constant liar strategy keeps parallel processes from trying the same settings. The sampler is not seeded,
    # because otherwise all processes would draw the same settings.
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
