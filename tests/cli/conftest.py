"""Running commands in this process, and in one of their own."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from importlib.metadata import Distribution, PathDistribution, distributions
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from frobs_cli.program import program
from frobs_core import plugins


@pytest.fixture
def frobs() -> Callable[..., Result]:
    """Run a command in this process."""

    def run(*args: str, **env: str) -> Result:
        return CliRunner().invoke(program(), list(args), prog_name="frobs", env=env, catch_exceptions=False)

    return run


@pytest.fixture
def facts(frobs: Callable[..., Result]) -> Callable[..., Any]:
    """Run a command with ``--json`` and return what it says."""

    def run(*args: str) -> Any:
        result = frobs(*args, "--json")
        assert result.exit_code == 0, result.stderr
        return json.loads(result.stdout)

    return run


@pytest.fixture
def process() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Run a command in a process of its own."""

    def run(*args: str, **kwargs: Any) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "frobs_cli", *args]
        return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False, **kwargs)

    return run


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str, str], None]]:
    """Install distributions beside the real ones: ``installed("name", "plugin.py's text")``."""
    monkeypatch.syspath_prepend(tmp_path)
    found: list[Distribution] = [d for d in distributions() if d.name.startswith("frobs-")]

    with ExitStack() as stack:

        def install(name: str, text: str) -> None:
            module = name.replace("-", "_") + "_plugin"
            monkeypatch.delitem(sys.modules, module, raising=False)  # another test's
            (tmp_path / f"{module}.py").write_text(text)
            info = tmp_path / f"{name.replace('-', '_')}-1.5.dist-info"
            info.mkdir()
            (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.5\n")
            (info / "entry_points.txt").write_text(f"[frobs]\n{name} = {module}\n")
            found.append(PathDistribution(info))
            stack.enter_context(plugins.isolated(plugins.Plugins(found, strict=False, disabled=())))

        yield install
