"""The page about the doctor shows what the doctor says, in a terminal of 80 columns."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import pytest
from pages import DOCS, blocks
from rich.console import Console

from frobs_cli import output
from frobs_devkit.cli import doctor_report
from frobs_devkit.doctor import examine_robot

PAGE = DOCS / "how-to" / "check-a-robot-file.md"


def test_the_output_on_the_page_is_the_real_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    screen = io.StringIO()

    def console(**_: Any) -> Console:
        return Console(file=screen, width=80, force_terminal=True, color_system=None, highlight=False)

    found = list(blocks(PAGE))
    [file] = [block for block in found if "file" in block.attributes]
    [shown] = [block for block in found if "output" in block.attributes]
    (tmp_path / file.attributes["file"]).write_text(file.text)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(output, "console", console)
    monkeypatch.setattr(doctor_report, "console", console)
    doctor_report.print_report(examine_robot(shown.attributes["output"], simulators=("mujoco",)))
    said = "".join(f"{line.rstrip()}\n" for line in screen.getvalue().splitlines())
    assert shown.text == said, f"put this on the page:\n{said}"
