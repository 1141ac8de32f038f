"""The table of CONTRIBUTING.md names files and folders that exist."""

from __future__ import annotations

import re

from pages import ROOT

PATH = re.compile(r"`((?:frobs_core|plugins|docs|tests|templates|cookiecutter)/[\w./-]*)`")


def test_the_table_names_existing_files() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    paths = [path for row in rows for path in PATH.findall(row)]
    assert len(paths) > 40
    assert [path for path in paths if not (ROOT / path).exists()] == []


def test_the_table_names_every_distribution() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    assert [path.name for path in ROOT.glob("plugins/*") if path.is_dir() and f"plugins/{path.name}/" not in text] == []
