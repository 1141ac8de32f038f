import json
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from rich.console import Console
from typer.testing import Result

from frobs_cli import output
from frobs_cli.facts import dotted, print_facts, text
from frobs_cli.formats import duration, number, percent

Capture = pytest.CaptureFixture[str]
Width = Callable[[int], None]


class Colour(Enum):
    RED = "red"


@dataclass
class Pair:
    left: float
    right: tuple[int, ...]


@pytest.mark.parametrize(
    ("value", "becomes"),
    [
        (math.nan, None),
        (-math.inf, None),
        (np.float32(0.5), 0.5),
        (np.bool_(True), True),
        (np.arange(3), [0, 1, 2]),
        (np.array([1.0, np.nan]), [1.0, None]),
        (Path("a/b"), "a/b"),
        (Colour.RED, "Colour.RED"),
        (Pair(1.0, (2, 3)), {"left": 1.0, "right": [2, 3]}),
        ({1: {"a": {2}}}, {"1": {"a": [2]}}),
        (gym.spaces.Discrete(2), "Discrete(2)"),
        (True, True),
    ],
    ids=repr,
)
def test_json_holds_whatever_facts_hold(capsys: Capture, value: object, becomes: object) -> None:
    output.print_json(value)
    assert json.loads(capsys.readouterr().out) == becomes


def test_what_libraries_print_goes_to_stderr_while_json_is_wanted(capsys: Capture) -> None:
    with output.only_json(True):
        print("noise")  # noqa: T201 - a library that prints
    output.print_json([1])
    assert json.loads(capsys.readouterr().out) == [1]


@pytest.fixture
def width(monkeypatch: pytest.MonkeyPatch) -> Width:
    """Make stdout a terminal of some width, without colours."""

    def set_width(columns: int) -> None:
        monkeypatch.setattr(
            output, "console", lambda: Console(width=columns, force_terminal=True, no_color=True, highlight=False)
        )

    return set_width


ROWS = [["short", "x", "a sentence of eight words that needs wrapping"], ["a-longer-name", "yy", "brief"]]


def test_a_wide_terminal_gets_a_row_a_line(capsys: Capture, width: Width) -> None:
    width(120)
    output.print_table(("name", "n", "text"), ROWS)
    assert _plain(capsys) == [
        "  name           n   text",
        "  short          x   a sentence of eight words that needs wrapping",
        "  a-longer-name  yy  brief",
    ]


def test_a_terminal_that_is_not_wide_enough_wraps_the_last_column(capsys: Capture, width: Width) -> None:
    width(55)
    output.print_table(("name", "n", "text"), ROWS)
    assert _plain(capsys)[1:3] == [
        "  short          x   a sentence of eight words that",
        "                     needs wrapping",
    ]


def test_a_narrow_terminal_gets_the_last_column_below(capsys: Capture, width: Width) -> None:
    width(40)
    output.print_table(("name", "n", "text"), ROWS)
    assert _plain(capsys) == [
        "  name           n",
        "  short          x",
        "    a sentence of eight words that needs",
        "    wrapping",
        "  a-longer-name  yy",
        "    brief",
    ]


def test_an_empty_table_is_its_header(capsys: Capture) -> None:
    output.print_table(("name", "text"), [])
    assert capsys.readouterr().out == "  name  text\n"


def test_markup_in_facts_is_not_interpreted(capsys: Capture) -> None:
    print_facts({"kind": "robot", "name": "[bold]x", "summary": "[m]", "unit": "[rad]", "rows": [{"a": "[b]"}]})
    out = capsys.readouterr().out
    assert all(piece in out for piece in ("[bold]x", "[m]", "[rad]", "[b]"))


def test_markup_in_lines_is_not_interpreted(capsys: Capture) -> None:
    output.print_line("pip install -e 'my-arm[test]'")
    assert capsys.readouterr().out == "pip install -e 'my-arm[test]'\n"


def test_the_printed_commands_of_a_new_plugin_install_pytest(frobs: Callable[..., Result], tmp_path: Path) -> None:
    install, test, *_ = (
        frobs("new", "controller", "zz_c", "--output", str(tmp_path)).stdout.split("next\n")[1].split("\n")
    )
    assert install.strip() == f"pip install -e '{tmp_path}/frobs-controllers-zz-c[test]'"
    assert test.strip() == f"pytest {tmp_path}/frobs-controllers-zz-c"


def test_work_writes_lines_where_there_is_no_terminal(capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    with output.working("quick"):
        pass
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(output, "_FIRST_LINE", 0.01)
    monkeypatch.setattr(output, "_LINE_EVERY", 0.01)
    told = ""
    with output.working("recording") as show:
        for text in ("recording", "recording: 2 frames"):
            show(text)
            while f"{text} (0 s)\n" not in told:
                told += capsys.readouterr().err
    assert "writer" not in [thread.name for thread in threading.enumerate()]


def test_facts_leave_out_what_is_empty(capsys: Capture) -> None:
    rows = [{"name": "x", "required": False, "lacks": ""}, {"name": "y", "required": False, "lacks": ""}]
    print_facts({"kind": "task", "name": "t", "summary": "", "error": None, "needs": {}, "rows": rows})
    assert capsys.readouterr().out.split() == ["t", "task", "rows", "name", "x", "y"]


@pytest.mark.parametrize(
    ("value", "reads"),
    [
        (None, "–"),
        (True, "true"),
        (0.30000000000000004, "0.3"),
        (["a", "b"], "a, b"),
        ([0.5, 1], "[0.5, 1]"),
        ({"a": [1]}, "{a: [1]}"),
        (math.inf, "–"),
    ],
)
def test_values_read_as_people_write_them(value: object, reads: str) -> None:
    assert text(value) == reads


def test_paths_of_settings_are_those_that_set_takes() -> None:
    assert dotted({"a": {"b": {"c": 1}, "d": {}}, "e": 2}) == {"a.b.c": 1, "a.d": {}, "e": 2}


@pytest.mark.parametrize(
    ("seconds", "reads"),
    [(0.0, "0.0 s"), (9.94, "9.9 s"), (59.4, "59 s"), (59.6, "1:00"), (185, "3:05"), (3723, "1:02:03")],
)
def test_durations(seconds: float, reads: str) -> None:
    assert duration(seconds) == reads


def test_numbers_have_as_many_digits_as_they_mean() -> None:
    assert [number(value) for value in (-0.123, 12.345, -123.45, 12345.6)] == ["-0.12", "12.35", "-123.5", "12,346"]
    assert [percent(0.9845), percent(None)] == ["98.5 %", "–"]


def _plain(capsys: Capture) -> list[str]:
    import re

    return re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().out).splitlines()
