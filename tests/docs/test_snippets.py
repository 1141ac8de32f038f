from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from fork_server import fork_server
from pages import PAGES, RUN, blocks, name
from sandbox import Sandbox

DRIVER = Path(__file__).with_name("run_blocks.py")
RUNNABLE = [page for page in PAGES if any(b.language in RUN and "skip" not in b.attributes for b in blocks(page))]
INSTALLING = [page for page in RUNNABLE if any("venv" in block.attributes for block in blocks(page))]
"""Pages that install something, and so are run in an environment of their own."""

QUICK = ("api-stability", "forces", "install", "many-environments", "model-files", "port-from-0.1", "ros", "scenes")
"""Pages whose blocks take at most three seconds. The others are run in the slow tests."""


def snippets() -> Iterator[Any]:
    for page in RUNNABLE:
        if page not in INSTALLING:
            yield pytest.param(page, id=name(page), marks=[] if page.stem in QUICK else [pytest.mark.slow])


@cache
def can_draw() -> bool:
    code = (
        "import gymnasium as gym\n"
        "gym.make('frobs_core:frobs/Irb120Reach-v0', render_mode='rgb_array').unwrapped.simulation.render()"
    )
    return subprocess.run([sys.executable, "-c", code], capture_output=True).returncode == 0


@pytest.fixture(scope="session")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with a ``frobs`` and a ``pytest`` that start quickly."""
    folder = tmp_path_factory.mktemp("programs")
    with fork_server(Path(sys.executable), folder, frobs="frobs_cli", pytest="pytest"):
        yield folder


@pytest.mark.parametrize("page", list(snippets()))
def test_snippets_run_in_the_order_of_their_page(page: Path, programs: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-W", "error", str(DRIVER), str(page), *(["--draw"] if can_draw() else [])]
    folders = (programs, Path(sys.executable).parent, os.environ["PATH"])
    environment = {**os.environ, "PATH": os.pathsep.join(map(str, folders))}
    done = subprocess.run(command, cwd=tmp_path, env=environment, text=True, capture_output=True, timeout=300)
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"


@pytest.mark.slow
@pytest.mark.parametrize("page", INSTALLING, ids=name)
def test_pages_that_install_run_in_an_environment_of_their_own(page: Path, tmp_path: Path) -> None:
    sandbox = Sandbox(tmp_path / "venv")
    (tmp_path / "here").mkdir()
    with sandbox.faster(tmp_path / "programs"):
        sandbox.run("python", DRIVER, page, cwd=tmp_path / "here")


def test_from_frobs_new_to_a_trained_policy_takes_five_commands() -> None:
    page = next(page for page in INSTALLING if page.name == "own-plugin.md")
    text = page.read_text("utf-8")
    lines = [
        line
        for block in blocks(page)
        if block.language == "bash" and "skip" not in block.attributes
        for line in block.text.splitlines()
    ]
    assert [line.split()[0:2] for line in lines if line.startswith("frobs")] == [
        ["frobs", "new"],
        ["frobs", "train"],
        ["frobs", "evaluate"],
    ]
    assert len(lines) == 5
    assert "five commands" in text


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_blocks_say_what_language_they_are_in(page: Path) -> None:
    assert [f"{name(page)}:{block.line}" for block in blocks(page) if not block.language] == []


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_blocks_that_are_not_run_say_why(page: Path) -> None:
    left_out = [block for block in blocks(page) if "skip" in block.attributes]
    assert [f"{name(page)}:{block.line}" for block in left_out if len(block.attributes["skip"]) < 10] == []


def test_most_pages_with_code_are_run() -> None:
    assert len(RUNNABLE) >= 7
