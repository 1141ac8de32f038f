"""Write TensorBoard events of a run without requiring TensorFlow or torch."""

from __future__ import annotations

import contextlib
import os
import socket
import struct
import time
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

from frobs_core.util.files import write_aside

_HEADER = struct.Struct("<QI")
_FOOTER = 4  # bytes


class EventLog:
    """Writer of TensorBoard events. Each event is written immediately, and each process writes its own file.

    If a run is ``resumed_at`` a number of environment steps, later events are removed from existing files and discarded
    by a running TensorBoard.
    """

    def __init__(self, folder: Path, resumed_at: int | None = None) -> None:
        from tensorboard.compat.proto.event_pb2 import Event, SessionLog
        from tensorboard.compat.proto.summary_pb2 import Summary
        from tensorboard.summary.writer.record_writer import RecordWriter

        self._event, self._summary = Event, Summary
        folder.mkdir(exist_ok=True)
        if resumed_at is not None:
            for path in sorted(folder.glob("events.out.tfevents.*")):
                _cut(path, resumed_at, Event)
        name = f"events.out.tfevents.{int(time.time()):010d}.{socket.gethostname()}.{os.getpid()}"
        others = len(list(folder.glob(f"{name}.*")))  # number of files that this process opened in the same second
        self._file: IO[bytes] = (folder / f"{name}.{others}").open("wb")
        self._records = RecordWriter(self._file)
        self._write(file_version="brain.Event:2")
        if resumed_at is not None:
            self._write(step=resumed_at + 1, session_log=SessionLog(status=SessionLog.START))

    def write(self, steps: int, values: Mapping[str, float]) -> None:
        """Write scalar values."""
        scalars = [self._summary.Value(tag=name, simple_value=value) for name, value in values.items()]
        self._write(step=steps, summary=self._summary(value=scalars))

    def close(self) -> None:
        """Close the file. Further calls have no effect."""
        with contextlib.suppress(OSError):  # if the disk is full, flushing on close fails again
            self._file.close()

    def _write(self, **fields: Any) -> None:
        self._records.write(self._event(wall_time=time.time(), **fields).SerializeToString())
        self._file.flush()


def _cut(path: Path, steps: int, event: Any) -> None:
    """Remove the events after a given number of steps, and an incomplete last event, from a file."""
    data = path.read_bytes()
    kept, place = bytearray(), 0
    while place + _HEADER.size <= len(data):
        length, _ = _HEADER.unpack_from(data, place)
        end = place + _HEADER.size + length + _FOOTER
        if end > len(data):
            break
        if event.FromString(data[place + _HEADER.size : end - _FOOTER]).step <= steps:
            kept += data[place:end]
        place = end
    if len(kept) < len(data):
        write_aside(path, lambda aside: aside.write_bytes(kept))
