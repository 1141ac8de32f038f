"""Processes that use ROS 2."""

import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

NODES = Path(__file__).parent / "nodes"
PATIENCE = 120.0
"""Time that a test waits for another process on a busy machine [s]."""


class Process:
    """A running program. At the end of a ``with`` block it is killed.

    Args:
        variables: Its environment variables.
        command: ``"frobs"`` and its arguments, ``"node"``, the name of a file in ``nodes`` and its arguments, or
            ``"-m"`` and a module.
    """

    def __init__(self, variables: Mapping[str, str], *command: object) -> None:
        words = [str(word) for word in command]
        if words[0] == "frobs":
            words = ["-m", "frobs_cli", *words[1:]]
        elif words[0] == "node":
            words = [str(NODES / words[1]), *words[2:]]
        self.process = subprocess.Popen(
            [sys.executable, *words], env=dict(variables), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        self.errors: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.errors.append(line)

    def __enter__(self) -> "Process":
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait()
        self._reader.join(5.0)
        if self.process.stdout is not None:
            self.process.stdout.close()
        if self.process.stderr is not None:
            self.process.stderr.close()

    def wait_for(self, text: str) -> None:
        """Wait until a line of stderr contains a text."""
        end = time.monotonic() + PATIENCE
        while not any(text in line for line in self.errors):
            alive = time.monotonic() < end and self.process.poll() is None
            assert alive, f"no {text!r}: {''.join(self.errors)}"
            time.sleep(0.02)

    def line(self) -> str:
        """Return the next line of stdout."""
        assert self.process.stdout is not None
        return self.process.stdout.readline().strip()

    def result(self, status: int = 0) -> Any:
        """Wait for the end, check the exit status, and return stdout as JSON, or as text."""
        assert self.process.stdout is not None
        text = self.process.stdout.read()
        actual = self.process.wait(PATIENCE)
        self._reader.join(5.0)
        assert actual == status, f"status {actual}: {text}{''.join(self.errors)}"
        try:
            return json.loads(text)
        except ValueError:
            return text


Start = Callable[..., Process]
"""Function that starts a process with the arguments of :class:`Process`."""
