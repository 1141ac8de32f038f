"""Shows a training run in the browser while it learns, with ``frobs view`` in a separate process."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from frobs_cli.commands import installed_commands
from frobs_core.util.errors import MissingDependencyError

_END = 5.0  # time after which a view that does not end by itself is killed [s]


def check_view() -> None:
    """Raise MissingDependencyError unless ``frobs view`` is installed."""
    if "view" not in installed_commands()[0]:
        raise MissingDependencyError("--view", ["frobs-view"], "pip install frobs-view")


@contextmanager
def training_view(folder: Path) -> Iterator[None]:
    """Show the newest policy of a run inside the ``with`` block. The run folder may not exist yet.

    The view reads the run folder, and shares nothing with the learner. It ends when its standard input is closed, even
    if the learner is killed. It prints its address to stderr.
    """
    command = [sys.executable, "-m", "frobs_cli", "view", str(folder), "--follow"]
    view = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=2,
        start_new_session=True,  # Ctrl-C stops the learner, which then closes the view
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )
    try:
        yield
    finally:
        assert view.stdin is not None
        view.stdin.close()
        try:
            view.wait(_END)
        except subprocess.TimeoutExpired:
            view.kill()
            view.wait()
