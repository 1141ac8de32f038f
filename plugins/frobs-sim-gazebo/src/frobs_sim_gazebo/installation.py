"""Finds Gazebo 11 on this machine or in a root folder that was created by ``tools/make_root.sh``."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from frobs_core.util.errors import SimulationError
from frobs_core.util.files import cache_folder, write_aside

ROOT_VARIABLE, NETWORK_VARIABLE = "FROBS_GAZEBO_ROOT", "FROBS_GAZEBO_NETWORK"

_MARK = Path("etc/frobs-gazebo-root")  # make_root.sh writes this file last
_LAUNCH = Path(__file__).with_name("launch.py")
_ENVIRONMENT = {
    "LC_ALL": "C.UTF-8",
    "GAZEBO_MASTER_URI": "http://127.0.0.1:11345",
    "GAZEBO_IP": "127.0.0.1",
    "IGN_IP": "127.0.0.1",
    "GAZEBO_MODEL_DATABASE_URI": "",  # disables the search for models on the network
    "ALSOFT_DRIVERS": "null",  # the search for an audio device would flood the log
}


def tool() -> Path:
    """Return the path of the script that creates a root folder."""
    here = Path(__file__).parent
    installed = here / "tools" / "make_root.sh"
    return installed if installed.exists() else here.parents[1] / "tools" / "make_root.sh"


@dataclass(frozen=True)
class Installation:
    """An installation of Gazebo 11.

    Attributes:
        root: Folder that Gazebo's programs use as the root folder (``/``), or None if Gazebo is installed on this
            machine itself.
        version: Full version, such as ``"11.1.0"``.
    """

    root: Path | None
    version: str

    @property
    def store(self) -> Path:
        """Folder for files that are built for this installation, as a path on this machine."""
        return cache_folder("gazebo") if self.root is None else self.root / "var" / "cache" / "frobs"

    @property
    def scratch(self) -> Path | None:
        """Mount point of each program's private in-memory folder, or None to use the root's ``/tmp``."""
        return self.store / "scratch" if self.root is None else None

    def inside(self, path: Path) -> str:
        """Convert a path under :attr:`store` to the path that Gazebo's programs use."""
        return str(path) if self.root is None else f"/{path.relative_to(self.root)}"

    def add_file(self, name: str, write: Callable[[Path], object]) -> str:
        """Add a file to :attr:`store` unless it exists, and return the path that Gazebo's programs use.

        Args:
            name: Path of the file in the folder.
            write: Function that writes the file to a given path.

        Raises:
            SimulationError: The file cannot be written.
        """
        path = self.store / name
        if not path.exists():
            try:
                write_aside(path, write, durable=False)
            except OSError as error:
                raise SimulationError(f"the file {path} for Gazebo cannot be written: {error}") from error
        return self.inside(path)

    def command(self, *command: str) -> list[str]:
        """Return the command line that runs a Gazebo program in isolation. See :mod:`frobs_sim_gazebo.launch`."""
        network = os.environ.get(NETWORK_VARIABLE, "own")
        if network not in ("own", "host"):
            raise SimulationError(f"{NETWORK_VARIABLE} is '{network}'; it must be 'own' (the default) or 'host'.")
        line = [sys.executable, "-I", "-S", str(_LAUNCH), f"--network={network}"]
        if self.root is not None:
            line.append(f"--root={self.root}")
        elif self.scratch is not None:
            self.scratch.mkdir(parents=True, exist_ok=True)
            line.append(f"--scratch={self.scratch}")
        return [*line, "--", *command]

    def environment(self, **variables: str) -> dict[str, str]:
        """Return the environment variables for Gazebo's programs."""
        scratch = "/tmp" if self.scratch is None else str(self.scratch)
        path = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
        kept = {} if self.root else {k: v for k, v in os.environ.items() if k.startswith(("GAZEBO_", "LD_", "OGRE_"))}
        path = path if self.root else os.environ.get("PATH", path)
        return {**kept, **_ENVIRONMENT, "PATH": path, "HOME": scratch, "GAZEBO_LOG_PATH": scratch, **variables}


def find_gazebo() -> Installation:
    """Return the Gazebo installation from ``$FROBS_GAZEBO_ROOT`` if set, else from this machine, else from the cache.

    Raises:
        SimulationError: Gazebo is not installed, or its version is not 11.
    """
    named = os.environ.get(ROOT_VARIABLE)
    return _find(named, str(cache_folder()), os.environ.get("PATH", ""))


@lru_cache
def _find(named: str | None, cache: str, path: str) -> Installation:
    if named:
        return _in_root(Path(named).absolute(), f"${ROOT_VARIABLE}")
    own = shutil.which("gzserver", path=path)
    if own:
        installation = Installation(None, _version([own]))
        if installation.version.startswith("11."):
            return installation
    root = Path(cache) / "gazebo-root"
    if root.exists():
        return _in_root(root, "the cache")
    reason = f"{own} has version '{installation.version}', not 11" if own else "gzserver is not installed"
    raise SimulationError(
        f"Gazebo 11 is not available: {reason}. Install Gazebo 11 (Debian 11, Ubuntu 20.04 or 22.04: apt-get install "
        f"gazebo libgazebo-dev cmake g++). On other Debian releases, create a root folder for Gazebo: sudo {tool()}."
    )


def _in_root(root: Path, whence: str) -> Installation:
    if not (root / _MARK).is_file() or not (root / "usr/bin/gzserver").is_file():
        raise SimulationError(
            f"the Gazebo root folder {root} (from {whence}) does not exist or is incomplete; to create it, run: "
            f"sudo {tool()} {root}."
        )
    libraries = sorted(root.glob("usr/lib/*/libgazebo_physics.so.*.*"))  # running gzserver would take a second
    version = libraries[-1].name.partition(".so.")[2] if libraries else "11"
    return Installation(root, version)


def _version(command: Sequence[str]) -> str:
    try:
        done = subprocess.run([*command, "--version"], capture_output=True, text=True, timeout=60, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise SimulationError(f"gzserver does not run: {error}") from error
    for line in done.stdout.splitlines():
        if "version" in line:
            return line.rpartition(" ")[2].strip()
    raise SimulationError(f"gzserver does not run: {(done.stderr or done.stdout).strip() or done.returncode}")
