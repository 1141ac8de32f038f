"""Every pair of answers is rendered, by frobs new and by cookiecutter: the same bytes, sound Python and TOML."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml
from combinations import FILE, combinations, every_answer, label, pairs
from cookiecutter.exceptions import CookiecutterException
from cookiecutter.main import cookiecutter
from sandbox import ROOT

from frobs_devkit.scaffold import CHOICES, QUESTIONS, asked, prompts, render, resolve
from frobs_devkit.scaffold.rendering import template_folder

ARM = ROOT / "templates" / "my_arm.urdf.xacro"
ROWS = [{**row, **({"robot_file": str(ARM)} if row.get("robot_file") == FILE else {})} for row in combinations()]


@pytest.fixture
def rover(isolated_plugins: Any) -> None:
    """Let a wheeled robot be installed."""
    isolated_plugins(installed=True, my_rover="rover_plugin")


FAST = ("pair arm", "task wheeled", "controller")
"""What of each is rendered in the quick tests, too."""


def _cases() -> Iterator[Any]:
    fast = set(FAST)
    for row in ROWS:
        begins = next((begin for begin in fast if label(row).startswith(begin)), None)
        fast.discard(begins or "")
        yield pytest.param(row, id=label(row), marks=() if begins else pytest.mark.slow)


CASES = list(_cases())


def tree(folder: Path) -> Mapping[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_the_pairs_are_covered() -> None:
    assert set().union(*map(pairs, ROWS)) == set().union(*map(pairs, every_answer()))
    assert len(ROWS) < 30


@pytest.mark.parametrize("answers", CASES)
def test_cookiecutter_and_frobs_new_give_the_same_sound_files(
    answers: dict[str, str], tmp_path: Path, rover: None, cookiecutters: Any
) -> None:
    ours = render(resolve(answers), tmp_path / "ours")
    theirs = cookiecutters(answers)
    found = tree(ours)
    assert ours.name == theirs.name
    assert tree(theirs) == found
    for name, data in found.items():
        text = data.decode()
        assert text.strip(), f"{name} is empty"
        assert "{{" not in text.replace("${{ matrix.python }}", ""), name
        assert "cookiecutter" not in text, name
        assert text.endswith("\n"), name
        assert not text.endswith("\n\n"), name
        assert "\n\n\n\n" not in text, name
        if name.endswith(".toml"):
            tomllib.loads(text)
        if name.endswith((".yaml", ".yml")):
            yaml.safe_load(text)
    for command in (["check"], ["format", "--check"]):
        done = subprocess.run([sys.executable, "-m", "ruff", *command, ours], text=True, capture_output=True)
        assert done.returncode == 0, done.stdout
    assert ("LICENSE" in found) == (answers["license"] != "none")
    assert (".github/workflows/tests.yml" in found) == (answers["ci"] == "github")


@pytest.fixture
def cookiecutters(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Render with cookiecutter itself, its hooks in processes of their own."""
    config = tmp_path / "cookiecutter.yaml"
    config.write_text(f"replay_dir: {tmp_path / 'replay'}\ncookiecutters_dir: {tmp_path / 'cloned'}\n")

    def make(answers: Mapping[str, str]) -> Path:
        output = tmp_path / "theirs"
        output.mkdir(exist_ok=True)
        if answers.get("robot") == "my_rover":  # which is not installed for the hooks' processes
            monkeypatch.setenv("PYTHONPATH", str(_without_core(tmp_path)))
        return Path(
            cookiecutter(
                str(ROOT / "cookiecutter"),
                no_input=True,
                extra_context=dict(answers),
                output_dir=str(output),
                config_file=str(config),
            )
        )

    return make


def _without_core(folder: Path) -> Path:
    """Return a folder that hides frobs-core from a process, as where it is not installed."""
    hidden = folder / "hidden" / "frobs_core"
    hidden.mkdir(parents=True, exist_ok=True)
    (hidden / "__init__.py").write_text("raise ImportError('frobs-core is not installed')\n")
    return hidden.parent


@pytest.mark.parametrize(
    "answers",
    [
        {"name": "class"},
        {"name": "My-Arm"},
        {"what": "robot", "name": "irb120"},
        {"what": "task", "name": "camera", "robot": "irb120"},
        {"what": "task", "example": "file", "name": "my_task"},
        {"what": "pair", "example": "file", "name": "my_arm", "robot_file": "/missing.urdf"},
        {"what": "pair", "example": "file", "name": "my_arm", "robot_file": ""},
    ],
    ids=lambda answers: " ".join(answers.values()),
)
def test_the_hook_refuses_and_nothing_stays(
    answers: dict[str, str], cookiecutters: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(CookiecutterException):
        cookiecutters(answers)
    assert list((tmp_path / "theirs").iterdir()) == []
    assert "error: " in capfd.readouterr().err


def test_an_answer_to_a_question_of_another_kind_changes_nothing(cookiecutters: Any, tmp_path: Path) -> None:
    ours = render(resolve({"what": "controller", "name": "my_controller"}), tmp_path / "ours")
    assert tree(cookiecutters({"what": "controller", "name": "my_controller", "paced": "yes"})) == tree(ours)


def test_without_the_core_a_robots_file_is_refused(
    cookiecutters: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(_without_core(tmp_path)))
    with pytest.raises(CookiecutterException):
        cookiecutters({"what": "pair", "example": "file", "name": "my_arm", "robot_file": str(ARM)})
    assert "pip install frobs-devkit" in capfd.readouterr().err


def test_cookiecutter_asks_the_same_questions() -> None:
    questions = [key for key in resolve({"what": "robot", "name": "some_arm"}) if not key.startswith("_")]
    assert questions == list(QUESTIONS)
    assert set(prompts()) == set(QUESTIONS)
    for question, choices in CHOICES.items():
        texts = prompts()[question]
        assert set(texts) - {"__prompt__"} <= set(choices)


def test_every_question_is_asked_for_something() -> None:
    some = {q for what in CHOICES["what"] for e in CHOICES["example"] for q in asked({"what": what, "example": e})}
    assert some == set(QUESTIONS)


def test_plugins_are_made_for_the_core_that_made_them() -> None:
    ours = tomllib.loads((ROOT / "plugins/frobs-robots-abb/pyproject.toml").read_text())["project"]["dependencies"]
    assert ours[0] in (template_folder() / "partials" / "pyproject.toml").read_text("utf-8")
