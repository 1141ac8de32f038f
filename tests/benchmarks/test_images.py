"""The times of pictures."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import images


@pytest.mark.needs("rendering")
def test_a_picture_and_its_opengl_take_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(images, "NUM_ENVS", (2,))
    monkeypatch.setattr(images, "REPETITIONS", 2)
    [(num_envs, ours, opengl)] = images.rows()
    assert num_envs == 2
    assert 0.0 < ours < 100.0
    assert 0.0 < opengl < 100.0


@pytest.mark.needs("rendering")
def test_the_page_names_what_is_missed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def rows() -> Any:
        yield from ((1, 2.0, 1.0), (8, 1.0, 1.0))

    monkeypatch.setattr(images, "rows", rows)
    monkeypatch.setattr(images, "REPETITIONS", 1)
    monkeypatch.setattr(images, "PAGE", tmp_path / "page.md")
    assert images.main() == 1
    page = (tmp_path / "page.md").read_text("utf-8")
    assert "| 1 | 2.00 ms | 500 | 1.00 ms | 2.00 (missed) |" in page
    assert "| 8 | 1.00 ms | 1,000 | 1.00 ms | 1.00 |" in page
