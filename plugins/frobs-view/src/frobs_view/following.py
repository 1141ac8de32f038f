"""Shows a run that is being trained: its newest policy acts, and the learning curve grows."""

from __future__ import annotations

import csv
import os
import stat
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from frobs_core import load_policy
from frobs_core.util.errors import FrobsError
from frobs_train import Run
from frobs_view.overlays import Curves
from frobs_view.player import Player
from frobs_view.viewer import BrowserViewer

INTERVAL = 2.0
"""Time between two looks into the run folder [s]."""

POINTS = 2_000
"""Maximum number of points of the learning curve."""


class Following:
    """Reads a run folder while another process writes it. The training run does not notice.

    Args:
        folder: The run folder.
        env: Environment in which the policy acts.
        viewer: Viewer of the environment.
        player: Player of the environment.
        name: Name of the run's policy in the player.
    """

    def __init__(self, folder: Path, env: Any, viewer: BrowserViewer, player: Player, name: str) -> None:
        self._folder, self._env, self._player, self._name = folder, env, player, name
        gui = viewer.server.gui
        with gui.add_folder("Training", order=-0.5) as panel:
            self._newest = gui.add_text("policy of step", "", disabled=True)
        self._curves = Curves(gui, panel, "learning curve", POINTS)
        self._due, self._steps, self._rows = 0.0, -1, 0

    def poll(self) -> None:
        """Look for a new checkpoint and new points of the curve, at most every two seconds."""
        now = time.monotonic()
        if now < self._due:
            return
        self._due = now + INTERVAL
        self._read_curve()
        try:
            steps = Run.open(self._folder).find_checkpoint()[0].steps
            if steps == self._steps:
                return
            self._player.replace(self._name, load_policy(self._folder, self._env))
        except FrobsError:  # there is no checkpoint yet, or the learner is replacing it; the next look finds one
            return
        if self._steps < 0:
            self._player.choose(self._name)
        self._steps, self._newest.value = steps, f"{steps:,}"

    def _read_curve(self) -> None:
        path = self._folder / "progress.csv"
        if not path.is_file():
            return
        text = path.read_text("utf-8")
        rows = list(csv.DictReader(text[: text.rfind("\n") + 1].splitlines()))  # without an incomplete last row
        for row in rows[self._rows :]:
            if row.get("train/steps") and row.get("episode/reward"):
                values = {name: float(row.get(f"episode/{name}") or "nan") for name in ("reward", "success")}
                self._curves.add(float(row["train/steps"]), values)
        self._rows = len(rows)
        self._curves.draw()


def until_closed(is_running: Callable[[], bool]) -> Callable[[], bool]:
    """Return ``is_running``, or a function that also returns False once the pipe at the standard input is closed.

    A program that starts the view holds the other end of the pipe, so that the view never outlives it.
    """
    if not stat.S_ISFIFO(os.fstat(0).st_mode):
        return is_running
    os.nice(19)  # the program that started the view takes all the processor time that it can use
    closed = threading.Event()

    def read() -> None:
        while os.read(0, 4096):
            pass
        closed.set()

    threading.Thread(target=read, name="frobs-view-input", daemon=True).start()
    return lambda: not closed.is_set() and is_running()


def wait_for_run(folder: Path, is_running: Callable[[], bool]) -> bool:
    """Wait until a training run has begun to write its folder, and return whether it did before ``is_running`` ended."""
    while is_running():
        if (folder / "history.json").is_file():
            return True
        time.sleep(0.1)
    return False
