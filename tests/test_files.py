"""Files are whole at any moment, and the cache is below the home."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from frobs_core.util.files import cache_folder, write_aside


def test_the_variable_names_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "frobs"
    assert cache_folder("meshes", "a") == tmp_path / "frobs" / "meshes" / "a"


@pytest.mark.parametrize("value", ["", "relative/folder"])
def test_without_an_absolute_path_it_is_below_the_home(
    value: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", value)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache_folder("meshes") == tmp_path / ".cache" / "frobs" / "meshes"


def test_a_user_without_a_home_gets_a_folder_that_does_not_exist(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.delenv("HOME")
    monkeypatch.setattr(os, "getuid", lambda: 2**31 - 7)  # without an entry in the list of users
    assert not cache_folder().exists()
    assert cache_folder().is_absolute()


def test_a_file_is_replaced_whole(tmp_path: Path) -> None:
    path = tmp_path / "new" / "file"
    write_aside(path, lambda aside: aside.write_text("old"))

    def write(aside: Path) -> None:
        aside.write_text("new")
        assert path.read_text() == "old"

    write_aside(path, write)
    assert path.read_text() == "new"
    assert list(path.parent.iterdir()) == [path]


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("old")

    def write(aside: Path) -> None:
        aside.write_text("half")
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        write_aside(path, write)
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_text() == "old"
