"""Attacks by files: each must be refused within two seconds, and must change nothing outside its temporary folder.

A folder ``work`` is the working directory of each test; a test fails if anything appears in it. An alarm ends a test that
blocks. CPU time is measured, so that a busy machine does not matter; the garbage collector passes over the objects that
exist already, which are millions after some thousand tests.
"""

from __future__ import annotations

import gc
import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

MOST_SECONDS = 2.0
HEAD = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'


@pytest.fixture(scope="session", autouse=True)
def imported() -> None:
    """Import what the tests need: the first import takes seconds."""
    import collada  # noqa: F401
    import gymnasium  # noqa: F401
    import mujoco  # noqa: F401
    import trimesh  # noqa: F401
    import xacro  # noqa: F401

    import frobs_train  # noqa: F401
    from frobs_core import plugins

    plugins.records("robot")


@pytest.fixture(autouse=True)
def guarded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Fail a test that writes into the working directory, takes longer than two seconds or blocks."""
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))

    def stop(*_: object) -> None:
        raise TimeoutError("the test blocks")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(30)
    gc.freeze()
    start = time.process_time()
    try:
        yield
        taken = time.process_time() - start
    finally:
        gc.unfreeze()
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
    assert taken < MOST_SECONDS
    assert not os.listdir(work)


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Return a function that writes a xacro file and returns its path."""

    def write(inside: str, name: str = "r.urdf.xacro") -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(HEAD + inside + "</robot>")
        return path

    return write
