"""Builds the world plugin once for each combination of Gazebo's version and the plugin's sources."""

from __future__ import annotations

import fcntl
import hashlib
import os
import shutil
import subprocess
from pathlib import Path

from frobs_core.util.errors import SimulationError
from frobs_sim_gazebo.installation import Installation

_SOURCES = Path(__file__).with_name("world_plugin")
_LIBRARY, _WORLD = "libfrobs_world.so", "frobs.world"
_LONGEST = 600.0  # [s] maximum duration of a build


def built_plugin(installation: Installation) -> Path:
    """Return the folder that contains the plugin's library.

    If necessary, build the library first (about half a minute). If several processes call this function at the same
    time, one process builds the library while the others wait. The folder is created atomically.

    Raises:
        SimulationError: The build failed. The error message ends with the output of the build.
    """
    files = sorted(path for path in _SOURCES.iterdir() if path.is_file() and path.name != _WORLD)
    key = hashlib.sha256(installation.version.encode())
    for path in files:
        key.update(path.name.encode() + b"\0" + path.read_bytes())
    folder = installation.store / f"plugin-{key.hexdigest()[:16]}"
    if folder.is_dir():
        return folder
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with open(folder.parent / "build.lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not folder.is_dir():
                _build(installation, files, folder)
    except OSError as error:
        raise SimulationError(f"the world plugin for Gazebo cannot be built in {folder.parent}: {error}") from error
    return folder


def _build(installation: Installation, files: list[Path], folder: Path) -> None:
    aside = folder.with_suffix(".part")
    shutil.rmtree(aside, ignore_errors=True)
    sources = aside / "sources"
    sources.mkdir(parents=True)
    try:
        for path in files:
            shutil.copy(path, sources)
        seen, into = installation.inside(sources), f"{installation.inside(aside)}/build"
        jobs = str(min(4, os.cpu_count() or 1))
        for command in (["cmake", "-S", seen, "-B", into], ["cmake", "--build", into, "--parallel", jobs]):
            _run(installation, command)
        shutil.move(aside / "build" / _LIBRARY, aside)
        shutil.rmtree(aside / "build")
        shutil.rmtree(sources)
        aside.rename(folder)
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _run(installation: Installation, command: list[str]) -> None:
    try:
        done = subprocess.run(
            installation.command(*command),
            env=installation.environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            timeout=_LONGEST,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise SimulationError(
            f"building the world plugin for Gazebo took longer than {_LONGEST:.0f} s and was stopped."
        ) from error
    if done.returncode != 0:
        said = "\n".join(f"  {line}" for line in done.stdout.splitlines()[-30:])
        raise SimulationError(
            "the world plugin for Gazebo cannot be built. The build requires Gazebo's headers, CMake and a C++ "
            f"compiler (Debian: libgazebo-dev, cmake, g++). Output of '{' '.join(command)}':\n{said}"
        )
