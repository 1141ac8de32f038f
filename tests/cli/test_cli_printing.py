"""Control characters, line breaks and markup in the names of a file are shown, and never reach the terminal as such."""

from __future__ import annotations

import json
import logging
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from frobs_cli import output
from frobs_cli.formats import number, percent
from frobs_cli.program import program
from frobs_core.util.errors import FrobsError
from frobs_deploy.__main__ import main as deploy
from frobs_deploy.bundle import pack_bundle
from frobs_train import Run
from frobs_train.configuration.config import RunConfig
from frobs_train.errors import JobsError
from frobs_train.export.pretrained import read_pretrained

HOSTILE = "\x1b[2J\x07\x08\r\x00\x7f\x9b31m\u202e\u2066\u200b\ufeff\nerror: forged"
CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff]")
MARKUP = "[red]x[/red][link=https://evil.example]y[/link][/]"
XML = "&#x9b;2J&#x202e;&#x2066;&#x85;&#10;error: forged" + MARKUP

ROBOT = f"""<robot name="r{XML}"><link name="base{XML}"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1"
iyz="0" izz="1"/></inertial></link><link name="tip{XML}"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0"
iyy="1" iyz="0" izz="1"/></inertial></link><joint name="j{XML}" type="revolute"><parent link="base{XML}"/><child
link="tip{XML}"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


def run(*args: str) -> Result:
    return CliRunner().invoke(program(), list(args), prog_name="frobs")


def assert_clean(text: str) -> None:
    assert not CONTROL.search(text)
    assert not any(line.startswith("error: forged") for line in text.splitlines())


@pytest.fixture
def trained(tmp_path: Path) -> Path:
    name = HOSTILE.replace("\x00", "") + MARKUP.replace("/", "")
    folder = tmp_path / name
    Run.create(folder, RunConfig(environment="CartPole-v1", seed=1, environment_kwargs={HOSTILE: HOSTILE + MARKUP}))
    (folder / "progress.csv").write_text("train/steps,time/elapsed,episode/reward\n100,1.0,2.0\n200,2.0,3.0\n")
    return folder


@pytest.mark.parametrize("command", [["show"], ["doctor", "robot"]], ids=" ".join)
def test_the_names_of_a_robot_are_shown_as_text(tmp_path, command):
    path = tmp_path / "r.urdf"
    path.write_text(ROBOT)
    found = run(*command, str(path))
    assert_clean(found.output)
    assert "\\x9b2J\\u202e\\u2066\\x85\\nerror: forged[red]x" in found.output


def test_an_error_about_a_robot_is_one_line(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text(ROBOT.replace(f'child\nlink="tip{XML}"', f'child link="gone{XML}"'))
    found = run("show", str(path))
    assert found.exit_code == 2
    assert found.stderr.count("\n") == 1
    assert_clean(found.output)


@pytest.mark.parametrize("command", [["show"], ["show", "--config"], ["compare"], ["plot"], ["evaluate"], ["resume"]])
def test_the_names_of_a_run_are_shown_as_text(trained, command):
    kind = "run:" if command[0] == "show" else ""
    found = run(*command, f"{kind}{trained}")
    assert_clean(found.output)
    assert not isinstance(found.exception, UnicodeError)


def test_json_holds_the_names_as_they_are(trained):
    found = run("show", f"run:{trained}", "--json")
    assert_clean(found.stdout)
    assert json.loads(found.stdout)[0]["environment_kwargs"] == {HOSTILE: HOSTILE + MARKUP}


def packed(path: Path, change: Callable[[dict[str, Any]], object]) -> Path:
    original = read_pretrained("frobs/Irb120Reach-v0")
    manifest = {key: value for key, value in original.manifest.items() if key not in ("format", "files")}
    change(manifest)
    path.write_bytes(pack_bundle(manifest, original.graph, original.license))
    return path


@pytest.mark.parametrize(
    "changes",
    [
        {"environment": HOSTILE + MARKUP},
        {"environment_kwargs": {HOSTILE: 1}},
        {"environment_kwargs": {"robot": HOSTILE}},
        {"wrappers": [{"name": HOSTILE}]},
        {HOSTILE: 1},
    ],
    ids=["environment", "keyword", "robot", "wrapper", "setting"],
)
def test_the_names_of_a_bundle_are_shown_as_text(tmp_path, changes):
    path = packed(tmp_path / "p.frobs", lambda given: given["training"]["config"].update(changes))
    found = run("evaluate", str(path), "--episodes", "1")
    assert found.exit_code == 2
    assert found.stderr.count("\n") == 1
    assert_clean(found.output)


def test_the_program_without_the_core_shows_them_as_text_too(tmp_path, monkeypatch, capsys):
    path = packed(tmp_path / "p.frobs", lambda given: given["robot"].update(name=HOSTILE))
    monkeypatch.setattr("sys.argv", ["frobs_deploy", str(path), "--bench", "1"])
    assert deploy() == 0
    found = capsys.readouterr().out
    assert_clean(found)
    assert "\\x1b[2J" in found


def test_every_way_to_print_escapes(capsys):
    text = HOSTILE + MARKUP
    output.print_line(text)
    output.print_note(text)
    output.print_title(text, text)
    output.print_table([text, "b"], [[text, text]])
    output.console().print(text)
    with output.working(text) as show:
        show(text)
    found = capsys.readouterr()
    assert_clean(found.err)
    assert not CONTROL.search(found.out)
    assert found.out.count(MARKUP) == 7


def test_an_error_keeps_the_rows_of_its_table_only(capsys):
    output.print_error(str(JobsError([("a", FrobsError("b")), ("c", FrobsError(HOSTILE))], 3)))
    lines = capsys.readouterr().err.splitlines()
    assert lines[:1] == ["error: 2 of 3 jobs failed. a: b"]
    assert lines[1].startswith("  c: \\x1b[2J")
    assert len(lines) == 2


@pytest.mark.parametrize("debug", [[], ["--debug"]])
def test_the_log_and_tracebacks_are_shown_as_text(capsys, monkeypatch, debug):
    def warn(*_: object) -> None:
        logging.getLogger("frobs").warning("a %s", HOSTILE)
        raise FrobsError(HOSTILE)

    monkeypatch.setattr("frobs_cli.show.robot_of", warn)
    monkeypatch.setattr(logging.getLogger(), "handlers", [])  # those of pytest
    found = run("show", "x", *debug)
    assert "a \\x1b[2J" in found.stderr
    assert not CONTROL.search(found.stderr)


def test_an_unknown_number_is_a_dash() -> None:
    """A run that ends before its first episode has no reward."""
    assert number(None) == percent(None) == "–"
    assert number(1234.4) == "1,234"


def test_an_error_does_not_repeat_an_argument_that_is_a_file(frobs: Callable[..., Result]) -> None:
    result = frobs("plugins", "x" * 100_000)
    assert result.exit_code == 2
    assert len(result.stderr) < 1_000
    assert "x…" in result.stderr
