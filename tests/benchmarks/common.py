"""Helpers of the scripts that measure: commands, the conditions of a measurement, and stored results."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, cast

from frobs_core.plugins import registry

ROOT = Path(__file__).parents[2]
RESULTS = Path(__file__).with_name("results")
"""Folder of stored results, which belong to the repository: a measurement can continue on another machine."""
BUSY = 1.5
"""Load average per core above which a machine is considered shared."""


def stored(file: Path, measure: Callable[..., Mapping[str, Any]], *arguments: object) -> dict[str, Any]:
    """Return the results in a file, or call ``measure`` and store them with ``machine`` and ``commit``."""
    if not file.is_file():
        commit = current_commit()
        row = {**measure(*arguments), "machine": machine(), "commit": commit}
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(row, indent=1) + "\n", "utf-8")
    return cast("dict[str, Any]", json.loads(file.read_text("utf-8")))


def slug(id: str) -> str:
    """Return the name of an ID in file names."""
    return id.rpartition("/")[2].lower()


def manipulation_ids() -> list[str]:
    """Return the IDs of ``frobs-tasks-manipulation``."""
    return [
        id
        for id, (task, _) in registry.environments().items()
        if task.entry_point.startswith("frobs_tasks_manipulation")
    ]


def frobs(*arguments: object, path: Path | None = None) -> dict[str, Any]:
    """Run a command and return its results.

    Args:
        arguments: Words of the command.
        path: Folder with further modules and distributions that the command can import.
    """
    command = [sys.executable, "-m", "frobs_cli", *map(str, arguments), "--json"]
    env = None if path is None else {**os.environ, "PYTHONPATH": str(path)}
    done = subprocess.run(command, check=True, text=True, stdout=subprocess.PIPE, env=env)
    return cast("dict[str, Any]", json.loads(done.stdout))


def current_commit() -> str:
    """Return the commit of the source, followed by ``+`` if files differ from it that no script writes."""

    def git(*arguments: str) -> str:
        return subprocess.run(["git", *arguments], cwd=ROOT, text=True, capture_output=True).stdout.strip()

    written = ("docs", "tests/benchmarks/*_measured.json", "tests/benchmarks/results")
    changed = git("status", "--porcelain", "--untracked-files=no", "--", ".", *(f":!{each}" for each in written))
    return git("rev-parse", "--short=7", "HEAD") + ("+" if changed else "") or "unknown"


def is_shared() -> bool:
    """Return whether other programs kept the machine busy during the last 15 minutes."""
    return os.getloadavg()[2] > BUSY * (os.cpu_count() or 1)


@cache
def machine() -> str:
    """Return the processor, the number of cores that this process may use, and the Python version."""
    names = [line for line in _lines(Path("/proc/cpuinfo")) if line.startswith("model name")]
    processor = names[0].partition(":")[2].strip() if names else platform.machine()
    cores, usable = os.cpu_count(), len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return (
        f"{processor}, {cores if usable == cores else f'{usable} of {cores}'} cores, Python {platform.python_version()}"
    )


def _lines(path: Path) -> list[str]:
    return path.read_text("utf-8").splitlines() if path.is_file() else []
