"""A virtual environment that sees what is installed in this one: what is installed into it leaves this one alone."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import venv
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from fork_server import fork_server

ROOT = Path(__file__).parents[2]
_COMMANDS = {"pip": "pip", "pytest": "pytest", "frobs": "frobs_cli", "python": ""}


class Sandbox:
    """A virtual environment on top of this one; is not supported from the network.

    Args:
        folder: To make it in.
    """

    def __init__(self, folder: Path) -> None:
        venv.create(folder, symlinks=True)
        self.folder = folder
        self.programs = folder / "bin"
        self.python = folder / "bin" / "python"
        site = Path(sysconfig.get_path("purelib", vars={"base": str(folder)}))
        lines = [f"import site; site.addsitedir({path!r})\n" for path in sys.path if path.endswith("site-packages")]
        (site / "parent.pth").write_text("".join(lines))
        for command in ("pip", "pytest", "frobs"):
            script = folder / "bin" / command
            script.write_text(f'#!/bin/sh\nexec "{self.python}" -m {_COMMANDS[command]} "$@"\n')
            script.chmod(0o755)

    @property
    def environ(self) -> dict[str, str]:
        """Environment variables with which ``pip``, ``pytest``, ``frobs`` and ``python`` are those of the sandbox."""
        return {
            **{name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")},
            "PATH": os.pathsep.join(map(str, (self.programs, self.folder / "bin", os.environ["PATH"]))),
            "PIP_NO_BUILD_ISOLATION": "0",  # as pip reads it: --no-build-isolation
            "PIP_NO_DEPS": "1",
            "PIP_NO_INDEX": "1",
            "PIP_DISABLE_PIP_VERSION_CHECK": "1",
        }

    @contextmanager
    def faster(self, folder: Path) -> Iterator[None]:
        """Fork ``frobs`` and ``pytest`` from a server, whose programs are in a folder."""
        folder.mkdir()
        with fork_server(self.python, folder, frobs="frobs_cli", pytest="pytest"):
            self.programs = folder
            yield
            self.programs = self.folder / "bin"

    def run(self, *command: object, cwd: Path | None = None, check: bool = True) -> subprocess.CompletedProcess[str]:
        """Run a command; an exit code other than 0 fails with its output."""
        done = subprocess.run(
            [str(part) for part in command], cwd=cwd, env=self.environ, text=True, capture_output=True, timeout=900
        )
        assert not check or done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
        return done

    def install(self, folders: Sequence[Path]) -> None:
        """Install distributions, editable."""
        self.run("pip", "install", "-q", *(part for folder in folders for part in ("-e", folder)))


def distributions(folder: Path) -> list[Path]:
    """Return the folders of a rendered plugin that can be installed, the robot's before the task's."""
    return sorted(path.parent for path in folder.rglob("pyproject.toml"))
