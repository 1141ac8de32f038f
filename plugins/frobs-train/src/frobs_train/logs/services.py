"""Loggers that send the rows of ``progress.csv`` to experiment-tracking services."""

from __future__ import annotations

import logging
import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, ClassVar

from frobs_core.util.errors import MissingDependencyError, RunError
from frobs_core.util.files import read_json, write_json
from frobs_train.errors import RunBusyError
from frobs_train.logs.progress import STEPS, read_progress
from frobs_train.runs.evaluation_files import is_as_trained
from frobs_train.runs.lock import RunLock
from frobs_train.training.callbacks import TrainingCallback

if TYPE_CHECKING:
    from frobs_train.evaluation.evaluate import Evaluation
    from frobs_train.runs.checkpoints import Checkpoint
    from frobs_train.runs.run import Run
    from frobs_train.training.monitor import Progress

_log = logging.getLogger("frobs")

SERVICES: Mapping[str, str] = {
    "wandb": "frobs_train.logs.wandb_logger:WandbLogger",
    "mlflow": "frobs_train.logs.mlflow_logger:MlflowLogger",
}
"""Logger classes by service name. The setting ``log`` uses these names, and each service's Python module has the same
name."""

_FINALS = ("success_rate", "mean_reward", "mean_length", "tracking_error", "steps_to_success")
"""Results of an evaluation that are sent to a service."""

Row = tuple[int, Mapping[str, float]]
"""A row of the log: its number of environment steps, and its finite values by column name."""


class ServiceLogger(TrainingCallback):
    """Base class of loggers that send each row of ``progress.csv`` to a run of a service.

    The file ``<name>.json`` in the run folder stores the ID of the service's run and the step count of the last row
    sent. A resumed training run can therefore continue the service's run without sending rows twice. Rows that could
    not be sent are sent again at the next checkpoint. Rows that were logged before the service was enabled are sent
    first.
    """

    name: ClassVar[str]

    def __init__(self) -> None:
        self._pending: list[Row] = []
        self._failed = False
        self._complete = False
        self._state: dict[str, Any] = {}
        self._run: Run | None = None

    def on_start(self, run: Run, steps: int) -> None:
        """Open the service's run, and send the rows that the run does not yet contain."""
        self._state = read_state(run, self.name)
        self._state |= self._open(run, self._state)
        self._run = run
        path = run.path / "progress.csv"
        logged = read_progress(path) if steps and path.is_file() else {}
        rows = [dict(zip(logged, values, strict=True)) for values in zip(*logged.values(), strict=True)]
        self._pending = [(int(row[STEPS]), _finite(row)) for row in rows if row[STEPS] > self._sent]
        self._write_state()
        self._send()

    def on_progress(self, progress: Progress, row: Mapping[str, float | None]) -> None:
        """Send a row, unless the row was already sent before the run was resumed."""
        steps = int(row[STEPS] or 0)
        if steps > self._sent:
            self._pending.append((steps, _finite(row)))
        if not self._failed:
            self._send()

    def on_checkpoint(self, checkpoint: Checkpoint) -> None:
        """Send rows that could not be sent before."""
        self._send()

    def on_end(self, run: Run, steps: int) -> None:
        """Mark the training run as complete."""
        self._complete = True

    def close(self) -> None:
        """Send the remaining rows, and close the service's run."""
        if self._run is not None:
            self._send()
            try:
                self._close(complete=self._complete)
            except Exception as error:
                _log.warning("The run in %s could not be closed: %s.", self.name, error)
            self._run = None

    def log_evaluation(self, run: Run, found: Evaluation) -> None:
        """Send the result of an evaluation to the service's run."""
        self._open(run, read_state(run, self.name))
        values = {f"final/{key}": getattr(found, key) for key in _FINALS}
        finals = {key: value for key, value in values.items() if value is not None}
        try:
            self._log_finals(found.steps, {**finals, "final/episodes": found.episodes})
        finally:
            self._close(complete=True)

    @property
    def _sent(self) -> int:
        return int(self._state.get("steps", 0))

    def _send(self) -> None:
        if self._run is None or not self._pending:
            return
        try:
            self._log(self._pending)
        except Exception as error:
            if not self._failed:
                _log.warning(
                    "%s cannot be reached: %s. The training run continues. The rows are sent again at the next checkpoint, "
                    "and progress.csv contains all rows.",
                    self.name,
                    error,
                )
            self._failed = True
            return
        self._failed = False
        self._state["steps"] = self._pending[-1][0]
        self._pending = []
        self._write_state()

    def _write_state(self) -> None:
        assert self._run is not None
        write_json(self._run.path / f"{self.name}.json", self._state)

    @abstractmethod
    def _open(self, run: Run, state: Mapping[str, Any]) -> dict[str, Any]:
        """Open the service's run with the ``id`` in ``state``, or create a new run, and return the state to store."""

    @abstractmethod
    def _log(self, rows: Sequence[Row]) -> None:
        """Send rows, oldest first."""

    @abstractmethod
    def _log_finals(self, steps: int, values: Mapping[str, float]) -> None:
        """Send the results of an evaluation after a number of training steps."""

    @abstractmethod
    def _close(self, *, complete: bool) -> None:
        """Close the service's run so that it can be resumed."""


def check_services(names: Sequence[str]) -> None:
    """Raise MissingDependencyError if the package of a service is not installed."""
    for name in names:
        spec = find_spec(name)
        if spec is None or spec.origin is None:  # ignore a folder with the package's name, which W&B creates
            raise MissingDependencyError(f"--log {name}", [name], f"pip install 'frobs-train[{name}]'")


def make_loggers(names: Sequence[str]) -> list[ServiceLogger]:
    """Create the loggers of the named services."""
    check_services(names)
    loggers = []
    for name in dict.fromkeys(names):
        module, _, attribute = SERVICES[name].partition(":")
        loggers.append(getattr(import_module(module), attribute)())
    return loggers


def log_evaluation(run: Run, found: Evaluation) -> None:
    """Send an evaluation to the services that track the evaluated run. Failures are logged as warnings."""
    if not is_as_trained(vars(found)):
        return
    names = [name for name in run.config.log if (run.path / f"{name}.json").is_file()]
    for name in names:
        try:
            [logger] = make_loggers([name])
            with RunLock(run.path):
                logger.log_evaluation(run, found)
        except RunBusyError:
            _log.warning("The evaluation was not sent to %s, because the run is still being trained.", name)
        except Exception as error:
            _log.warning("The evaluation was not sent to %s: %s", name, error)


def read_state(run: Run, name: str) -> dict[str, Any]:
    """Return a service's state from the run folder, or an empty mapping if nothing has been sent yet."""
    path = run.path / f"{name}.json"
    try:
        return read_json(path)
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise RunError(
            f"{path} cannot be read: {error.strerror}; remove the file to start a new {name} run."
        ) from error


def facts_of(run: Run) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the configuration and the versions of a run, as plain values."""
    return run.config.model_dump(mode="json"), read_json(run.path / "versions.json")


def _finite(row: Mapping[str, float | None]) -> dict[str, float]:
    return {name: float(value) for name, value in row.items() if value is not None and math.isfinite(value)}
