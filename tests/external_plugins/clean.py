"""A clean environment: the core and some plugins, installed from their wheels, and no other distribution of FRobs.

Libraries that others made (NumPy, Gymnasium, …) are lent by the environment that runs the tests, so that no network is
needed: a folder of links to all that is not ours.
"""

from __future__ import annotations

import ast
import os
import subprocess
import sys
import venv
from collections.abc import Iterator, Sequence
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PLUGINS = sorted(path.parent for path in HERE.glob("*/pyproject.toml"))
OURS = ("frobs", "acme", "__editable__", "_editable_impl", "_shared.pth", "__pycache__", "distutils-precedence.pth")

FROBS = ("frobs-cli", "frobs-deploy", "frobs-devkit", "frobs-models", "frobs-train")
"""Distributions of FRobs beside the core that commands need."""


def imports(path: Path) -> Iterator[tuple[str, str]]:
    """Yield (module, name) of every import from the core, in a file."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("frobs"):
            yield from ((node.module or "", alias.name) for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names if alias.name.startswith("frobs"))


class Environment:
    """A virtual environment in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        venv.create(folder / "venv", with_pip=False, symlinks=True)
        (self.site,) = (folder / "venv").glob("lib/python*/site-packages")
        lent = folder / "lent"
        lent.mkdir()
        for entry in (Path(path) for path in sys.path if path.endswith("site-packages")):
            for thing in entry.iterdir() if entry.is_dir() else ():
                if not thing.name.startswith(OURS) and not (lent / thing.name).exists():
                    (lent / thing.name).symlink_to(thing)
        (self.site / "lent.pth").write_text(f"{lent}\n")

    @property
    def python(self) -> Path:
        """Its interpreter."""
        return self.folder / "venv" / "bin" / "python"

    def install(self, *wheels: Path) -> None:
        """Install wheels, and check that all that they require is there."""
        command = [sys.executable, "-m", "pip", "--python", str(self.python), "--disable-pip-version-check"]
        run([*command, "install", "--quiet", "--no-index", "--no-deps", *map(str, wheels)])

    def uninstall(self, distribution: str) -> None:
        """Uninstall a distribution."""
        command = [sys.executable, "-m", "pip", "--python", str(self.python), "--disable-pip-version-check"]
        run([*command, "uninstall", "--quiet", "--yes", distribution])

    def frobs(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run a command of frobs in it."""
        return self.run("-m", "frobs_cli", *words)

    def run(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run its interpreter, away from this repository."""
        environment = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "FROBS"))}
        return subprocess.run(
            [str(self.python), *words], cwd=self.folder, env=environment, text=True, capture_output=True, timeout=900
        )


def run(command: Sequence[str]) -> None:
    """Run a command; what it says is in the error where it fails."""
    done = subprocess.run(command, text=True, capture_output=True, timeout=600)
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout}\n{done.stderr}"
