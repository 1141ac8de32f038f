from collections.abc import Callable
from typing import Any

import pytest
from rich.text import Text
from typer.testing import Result

import frobs_core
from frobs_cli.commands import HEADINGS, installed_commands
from frobs_cli.program import walk

Frobs = Callable[..., Result]

EVERY = [(tuple(name.split()[1:]), command) for name, command in walk()]


def test_no_arguments_print_the_help(frobs: Frobs) -> None:
    result = frobs()
    assert result.exit_code == 0
    assert result.stdout == frobs("--help").stdout
    assert all(heading in result.stdout for heading in HEADINGS)


def test_version(frobs: Frobs) -> None:
    assert frobs("--version").stdout == f"frobs {frobs_core.__version__}\n"


@pytest.mark.parametrize(("words", "command"), EVERY, ids=[" ".join(("frobs", *words)) for words, _ in EVERY])
def test_every_command_has_help_with_an_example(frobs: Frobs, words: tuple[str, ...], command: Any) -> None:
    result = frobs(*words, "--help")
    assert result.exit_code == 0
    assert f"$ {' '.join(('frobs', *words))}" in result.stdout.partition("Example:")[2]
    assert frobs(*words, "-h").stdout == result.stdout
    assert max(len(line) for line in result.stdout.splitlines()) <= 80
    assert "<bool>" not in result.stdout


@pytest.mark.parametrize(("words", "command"), EVERY, ids=[" ".join(("frobs", *words)) for words, _ in EVERY])
def test_every_parameter_has_help(words: tuple[str, ...], command: Any) -> None:
    for parameter in command.params:
        if parameter.name not in ("install_completion", "show_completion"):
            text = getattr(parameter, "help", None)
            assert text, f"{words}: {parameter.name}"
            assert Text.from_markup(text).plain == text, f"{words}: {parameter.name} loses what is in brackets"


def test_every_declared_command_is_in_the_program() -> None:
    declared, problems = installed_commands()
    assert problems == []
    assert sorted(" ".join(words) for words, _ in EVERY if words) == sorted(declared)


def test_summaries_are_one_sentence() -> None:
    for command in installed_commands()[0].values():
        assert command.summary.endswith("."), command.name
        assert len(command.summary) <= 100, command.name
