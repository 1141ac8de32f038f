"""Wheels of every distribution of this repository, built once for all tests and workers."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def shared_folder(tmp_path_factory: pytest.TempPathFactory, name: str) -> Path:
    """Return a temporary folder that all workers share."""
    own = tmp_path_factory.getbasetemp()
    shared = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / name
    shared.mkdir(exist_ok=True)
    return shared


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Let one worker at a time into a folder."""
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def frobs_wheels(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return the wheels in the folder ``FROBS_WHEELS``, or without it wheels that are built at the first call."""
    folder = shared_folder(tmp_path_factory, "wheels")
    built = Path(os.environ.get("FROBS_WHEELS", folder / "dist"))
    projects = [ROOT, *(file.parent for file in sorted(ROOT.glob("plugins/*/pyproject.toml")))]
    with locked(folder):
        wheels = sorted(built.glob("*.whl")) or build_wheels(projects, built)
    assert len(wheels) == len(projects)
    return wheels


def build_wheels(projects: Sequence[Path], folder: Path) -> list[Path]:
    """Build wheels of projects, with the build tools that are here."""
    folder.mkdir(exist_ok=True)
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check"]
    command += ["--no-deps", "--no-index", "--no-build-isolation", "--wheel-dir", str(folder), *map(str, projects)]
    done = subprocess.run(command, text=True, capture_output=True, timeout=600)
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout}\n{done.stderr}"
    return sorted(folder.glob("*.whl"))
