"""The memory that a program can still use."""

from __future__ import annotations

from pathlib import Path

import pytest

from frobs_core.util import memory
from frobs_core.util.errors import ConfigurationError


def test_memory_is_measured() -> None:
    assert 50_000_000 < memory.available_memory() < 2**50


def test_cache_of_a_control_group_is_available(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "_CGROUP", tmp_path)
    for name, text in {
        "max": "9000000\n",
        "current": "8000000\n",
        "stat": "anon 1000000\ninactive_file 7000000\n",
    }.items():
        (tmp_path / f"memory.{name}").write_text(text, "ascii")
    assert memory.available_memory() == 8_000_000
    (tmp_path / "memory.max").write_text("max\n", "ascii")
    assert memory.available_memory() > 9_000_000


def test_observations_that_do_not_fit_raise(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "available_memory", lambda: 10_000_000)
    memory.require_memory("sac", 3_000, 3_333, "steps", "keep {count}")
    with pytest.raises(ConfigurationError, match=r"sac: the observations of 3,334 steps need .*; keep 3,333\."):
        memory.require_memory("sac", 3_000, 3_334, "steps", "keep {count}")
