"""Rendering, and environments to install what was rendered into."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from sandbox import Sandbox

from frobs_devkit.scaffold import render, resolve


@pytest.fixture
def new(tmp_path: Path) -> Any:
    """Render a plugin into a temporary folder: ``new(what="pair", name="my_arm")`` returns the plugin's folder."""

    def make(**answers: str) -> Path:
        return render(resolve(answers), tmp_path / "made")

    return make


@pytest.fixture
def sandbox(tmp_path: Path) -> Sandbox:
    """An environment that sees all that is installed here, and into which more can be installed."""
    return Sandbox(tmp_path / "venv")
