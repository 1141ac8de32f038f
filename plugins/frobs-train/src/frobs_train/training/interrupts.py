"""Handle Ctrl-C and SIGTERM.

The first signal stops training where it can resume exactly. A second signal stops training immediately.
"""

from __future__ import annotations

import logging
import signal
import threading
from pathlib import Path
from types import FrameType
from typing import Any, Self

_log = logging.getLogger("frobs")
_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_WARNING = "Training stops after the current rollout and writes a checkpoint; %s stops training immediately."


class TrainingInterrupt(KeyboardInterrupt):
    """Training was interrupted and can be resumed.

    Args:
        path: The run's folder.
        checkpoint: Number of environment steps at the newest checkpoint, or None if there is no checkpoint.
        signum: Number of the received signal.

    Attributes:
        exit_code: Exit status of a program that is ended by the signal: 130 for Ctrl-C, 143 for SIGTERM.
    """

    def __init__(self, path: Path, checkpoint: int | None, signum: int) -> None:
        self.path = path
        self.checkpoint = checkpoint
        self.signum = signum
        self.exit_code = 128 + signum
        where = "from the beginning" if checkpoint is None else f"from the checkpoint at step {checkpoint:,}"
        super().__init__(f"'frobs resume {path}' continues {where}")


class Interrupts:
    """Context manager that catches Ctrl-C and SIGTERM in the main thread.

    In the warning after the first signal, ``%s`` is replaced by the signal that stops immediately. ``requested`` is the
    number of the received signal, or None.
    """

    def __init__(self, text: str = _WARNING) -> None:
        self._text = text
        self.requested: int | None = None
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._take) for number in _SIGNALS}
        return self

    def __exit__(self, *error: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._before = {}

    def _take(self, signum: int, frame: FrameType | None) -> None:
        if self.requested is not None:
            raise KeyboardInterrupt
        self.requested = signum
        again = "Ctrl-C again" if signum == signal.SIGINT else "another SIGTERM"
        # In a thread, because the signal may have arrived while this thread was writing to the same stream.
        threading.Thread(target=_log.warning, args=(self._text, again)).start()
