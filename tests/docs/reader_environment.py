"""Virtual environments that contain what a page tells its reader to install, and nothing else."""

from __future__ import annotations

import sys
import venv
from pathlib import Path

import linked_pip
from sandbox import Sandbox


class ReaderEnvironment(Sandbox):
    """A virtual environment with some distributions of this environment, and everything that they require.

    Args:
        folder: Where to create it.
        *requirements: Requirements of the distributions: ``"frobs-train[plots]"``.
    """

    def __init__(self, folder: Path, *requirements: str) -> None:
        venv.create(folder, symlinks=True)
        self.folder = folder
        self.programs = folder / "bin"
        self.python = folder / "bin" / "python"
        linked_pip.link(requirements, linked_pip.site_packages(folder), self.programs)
        command = f'exec "{sys.executable}" "{linked_pip.__file__}" "{folder}" "$@"'
        linked_pip.write_program(self.programs / "pip", command)

    @property
    def environ(self) -> dict[str, str]:
        """Environment variables of the reader's terminal. Nothing is sent to Weights & Biases."""
        return {**super().environ, "WANDB_MODE": "offline"}
