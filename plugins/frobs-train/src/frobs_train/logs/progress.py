"""The log of a run, written to ``progress.csv`` and as TensorBoard events."""

from __future__ import annotations

import contextlib
import csv
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import IO, Self

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.budgets import BUDGETS
from frobs_core.util.errors import RunError
from frobs_core.util.files import UnsuitableFileError, read_limited, write_aside
from frobs_train.logs.events import EventLog

_REMOVE = "Remove the file to use the run without its log; a resumed run starts a new log."

STEPS = "train/steps"
"""Name of the column that contains the number of environment steps."""

_LAST = {
    "steps": STEPS,
    "seconds": "time/elapsed",
    "success": "episode/success",
    "reward": "episode/reward",
    "length": "episode/length",
}
"""Column that contains each value of :func:`last_values`."""


class ProgressLog:
    """Context manager that writes the rows of the log. The methods raise RunError if writing fails.

    If a later row has a new column, the file is rewritten with an extended header. If a run is ``resumed_at`` a number
    of environment steps, later rows and an incomplete last row are removed.
    """

    def __init__(self, folder: Path, resumed_at: int | None = None) -> None:
        self._path = folder / "progress.csv"
        self._columns: list[str] = []
        self._file: IO[str] | None = None
        try:
            if resumed_at is not None and self._path.is_file():
                self._columns = self._trim(resumed_at)
            self._events = _open_events(folder / "tensorboard", resumed_at)
        except OSError as error:
            raise self._failure(error) from error

    def write(self, row: Mapping[str, float | None]) -> None:
        """Write a row immediately. A value of None leaves its cell empty."""
        try:
            self._write_csv(row)
            if self._events is not None:
                known = {name: value for name, value in row.items() if value is not None}
                self._events.write(int(row[STEPS] or 0), known)
        except OSError as error:
            raise self._failure(error) from error

    def sync(self) -> None:
        """Flush the rows to disk before a checkpoint is written."""
        if self._file is not None:
            try:
                os.fsync(self._file.fileno())
            except OSError as error:
                raise self._failure(error) from error

    def close(self) -> None:
        """Close the files. Further calls have no effect."""
        # If the disk is full, flushing the file's buffer fails again.
        with contextlib.suppress(OSError):
            if self._file is not None:
                self._file.close()
        self._file = None
        if self._events is not None:
            self._events.close()
            self._events = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _write_csv(self, row: Mapping[str, float | None]) -> None:
        new = [name for name in row if name not in self._columns]
        if new:
            self._extend(new)
        if self._file is None:
            self._file = self._path.open("a", newline="", encoding="utf-8")
        csv.writer(self._file).writerow([_cell(row.get(name)) for name in self._columns])
        self._file.flush()

    def _extend(self, new: list[str]) -> None:
        rows = read_rows(self._path) if self._columns else []
        columns = [*self._columns, *new]
        if self._file is not None:
            self._file.close()
            self._file = None
        _write_rows(self._path, columns, rows)
        self._columns = columns

    def _trim(self, steps: int) -> list[str]:
        """Remove the rows after a given number of steps, and return the column names."""
        rows = read_rows(self._path)
        kept = [row for row in rows if _steps(row) <= steps]
        columns = list(rows[0]) if kept else []
        _write_rows(self._path, columns, kept)
        return columns

    def _failure(self, error: OSError) -> RunError:
        run = self._path.parent
        return RunError(
            f"{run}: the log cannot be written: {error}. Free some space. The checkpoints are intact; "
            f"'frobs resume {run}' continues from the newest one."
        )


def read_rows(path: Path) -> list[dict[str, str]]:
    """Return the rows of a ``progress.csv`` as text, without an incomplete last line, or raise RunError."""
    try:
        text = read_limited(path, BUDGETS["run folder"]["bytes of progress.csv"]).decode("utf-8")
        return list(csv.DictReader(text[: text.rfind("\n") + 1].splitlines()))
    except UnsuitableFileError as error:
        raise RunError(f"{path} cannot be read: {error.strerror}. {_REMOVE}") from error
    except (ValueError, csv.Error) as error:
        raise RunError(f"{path} is damaged: {error}. {_REMOVE}") from error


def read_columns(run: Path) -> dict[str, Floats]:
    """Return the columns of a run's log by name, as arrays of shape (rows,)."""
    path = run / "progress.csv"
    columns = read_progress(path) if path.is_file() else {}
    if not columns.get(STEPS):
        raise RunError(f"{run}: progress.csv has no rows yet; try again after the run has trained for a while.")
    return {name: np.array(values) for name, values in columns.items()}


def smooth(values: Floats, weights: Floats, window: float = 0.04) -> Floats:
    """Return the weighted moving mean of a column, as an array of shape (rows,).

    The window spans the fraction ``window`` of all rows. NaN values are ignored, unless a window has no others.
    """
    half = int(window * len(values) / 2)
    valid = np.isfinite(values)
    weight = np.where(valid, np.nan_to_num(weights), 0.0)
    sums = np.concatenate([[0.0], np.cumsum(np.where(valid, values, 0.0) * weight)])
    counts = np.concatenate([[0.0], np.cumsum(weight)])
    rows = np.arange(len(values))
    first, last = np.maximum(rows - half, 0), np.minimum(rows + half + 1, len(values))
    count = counts[last] - counts[first]
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(count > 0, (sums[last] - sums[first]) / count, np.nan)


def read_progress(path: Path) -> dict[str, list[float]]:
    """Return the columns of a ``progress.csv``, with NaN for empty cells."""
    rows = read_rows(path)
    columns = list(rows[0]) if rows else []
    try:
        values = {name: [float(row[name] or "nan") for row in rows] for name in columns}
        if rows and STEPS not in values:
            raise ValueError(f"it has no column '{STEPS}'")
        for name in (STEPS, "time/elapsed"):
            if not all(0 <= value < 2**63 for value in values.get(name, ())):
                raise ValueError(f"a value of '{name}' is missing, negative or too large")
    except (TypeError, ValueError) as error:  # TypeError: a row has more cells than the header
        raise RunError(f"{path} is damaged: {error}. {_REMOVE}") from error
    return values


def last_value(values: Sequence[float]) -> float | None:
    """Return the last finite value of a column, or None if the column has no finite value."""
    return next((value for value in reversed(values) if math.isfinite(value)), None)


def last_values(run: Path) -> dict[str, float | None]:
    """Return the last steps, seconds, success, reward and length in a run's log. Values that do not exist are None."""
    path = run / "progress.csv"
    columns = read_progress(path) if path.is_file() else {}
    return {name: last_value(columns.get(column, [])) for name, column in _LAST.items()}


def _steps(row: Mapping[str, str]) -> float:
    try:
        return math.inf if None in row else float(row[STEPS])
    except (KeyError, TypeError, ValueError):  # the row is incomplete, for example after a power loss
        return math.inf


def _write_rows(path: Path, columns: Sequence[str], rows: Iterable[Mapping[str, str]]) -> None:
    def write(aside: Path) -> None:
        with aside.open("w", newline="", encoding="utf-8") as file:
            if columns:
                writer = csv.DictWriter(file, columns, restval="")
                writer.writeheader()
                writer.writerows(rows)

    write_aside(path, write)


def _cell(value: float | None) -> str:
    return "" if value is None else repr(value) if isinstance(value, int) else format(float(value), ".8g")


def _open_events(folder: Path, resumed_at: int | None) -> EventLog | None:
    """Return an event writer, or None if TensorBoard is not installed.

    No values are lost without TensorBoard, because the CSV file contains the same values.
    """
    try:
        return EventLog(folder, resumed_at)
    except ImportError:
        return None
