"""The log of a run: ``progress.csv``, and the same as TensorBoard events."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

from frobs_core.errors import RunError
from frobs_core.runs.files import write_aside

STEPS = "train/steps"
"""The column that counts environment steps."""


class ProgressLog:
    """Writes rows; closes as a context manager.

    A name that turns up for the first time in a later row becomes a new column: the file is written anew, aside,
    with one header.

    Args:
        folder: Of the run.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / "progress.csv"
        self._columns: list[str] = []
        self._file: IO[str] | None = None
        self._events = _open_events(folder / "tensorboard")

    def write(self, row: Mapping[str, float | None]) -> None:
        """Write a row, at once; None leaves a cell empty.

        Raises:
            RunError: The disk is full.
        """
        try:
            self._write_csv(row)
            if self._events is not None:
                known = {name: value for name, value in row.items() if value is not None}
                self._events.write(int(row[STEPS] or 0), known)
        except OSError as error:
            raise RunError(f"{self._path.parent}: the log cannot be written: {error}; free some space.") from error

    def close(self) -> None:
        """Close the files; twice is harmless."""
        if self._file is not None:
            self._file.close()
            self._file = None
        if self._events is not None:
            self._events.close()
            self._events = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
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
        self._columns += new
        if self._file is not None:
            self._file.close()
            self._file = None

        def write(path: Path) -> None:
            with path.open("w", newline="", encoding="utf-8") as file:
                writer = csv.DictWriter(file, self._columns, restval="")
                writer.writeheader()
                writer.writerows(rows)

        write_aside(self._path, write)


def read_rows(path: Path) -> list[dict[str, str]]:
    """Return the rows of a ``progress.csv`` as text; a last line that a kill cut short is left out."""
    with path.open(newline="", encoding="utf-8") as file:
        text = file.read()
    complete = text[: text.rfind("\n") + 1]
    return list(csv.DictReader(complete.splitlines()))


def read_progress(path: Path) -> dict[str, list[float]]:
    """Return the columns of a ``progress.csv``; an empty cell is NaN."""
    rows = read_rows(path)
    columns = list(rows[0]) if rows else []
    return {name: [float(row[name] or "nan") for row in rows] for name in columns}


def _cell(value: float | None) -> str:
    return "" if value is None else repr(value) if isinstance(value, int) else format(float(value), ".8g")


class _Events:
    """TensorBoard's own writer, without TensorFlow or torch."""

    def __init__(self, folder: Path) -> None:
        from tensorboard.compat.proto.event_pb2 import Event
        from tensorboard.compat.proto.summary_pb2 import Summary
        from tensorboard.summary.writer.event_file_writer import EventFileWriter

        self._event, self._summary = Event, Summary
        self._writer: Any = EventFileWriter(str(folder), flush_secs=10)

    def write(self, steps: int, values: Mapping[str, float]) -> None:
        import time

        scalars = [self._summary.Value(tag=name, simple_value=value) for name, value in values.items()]
        self._writer.add_event(self._event(wall_time=time.time(), step=steps, summary=self._summary(value=scalars)))

    def close(self) -> None:
        self._writer.close()


def _open_events(folder: Path) -> _Events | None:
    """Return a writer, or None where TensorBoard is not installed: the CSV has the same numbers."""
    try:
        return _Events(folder)
    except ImportError:
        return None
