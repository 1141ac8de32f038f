from collections.abc import Callable, Iterator
from typing import Any

import pytest
import typer
from rich.text import Text
from typer.testing import Result

import frobs_core
from frobs_core.cli.app import COMMANDS, FAMILIES, app
from frobs_core.cli.extensions import extensions

Frobs = Callable[..., Result]


def _walk(words: tuple[str, ...], command: Any) -> Iterator[tuple[tuple[str, ...], Any]]:
    yield words, command
    for word, child in getattr(command, "commands", {}).items():
        yield from _walk((*words, word), child)


EVERY = list(_walk((), typer.main.get_command(app)))


def test_no_arguments_print_the_help(frobs: Frobs) -> None:
    result = frobs()
    assert result.exit_code == 0
    assert result.stdout == frobs("--help").stdout
    assert all(heading in result.stdout for heading in COMMANDS)


def test_version(frobs: Frobs) -> None:
    assert frobs("--version").stdout == f"frobs {frobs_core.__version__}\n"


@pytest.mark.parametrize(("words", "command"), EVERY, ids=[" ".join(("frobs", *words)) for words, _ in EVERY])
def test_every_command_has_help_with_an_example(frobs: Frobs, words: tuple[str, ...], command: Any) -> None:
    result = frobs(*words, "--help")
    assert result.exit_code == 0
    assert f"$ {' '.join(('frobs', *words))}" in result.stdout.partition("Example:")[2]
    assert frobs(*words, "-h").stdout == result.stdout
    assert max(len(line) for line in result.stdout.splitlines()) <= 80


@pytest.mark.parametrize(("words", "command"), EVERY, ids=[" ".join(("frobs", *words)) for words, _ in EVERY])
def test_every_parameter_has_help(words: tuple[str, ...], command: Any) -> None:
    for parameter in command.params:
        if parameter.name not in ("install_completion", "show_completion"):
            text = getattr(parameter, "help", None)
            assert text, f"{words}: {parameter.name}"
            assert Text.from_markup(text).plain == text, f"{words}: {parameter.name} loses what is in brackets"


def test_every_command_has_a_file_and_a_heading() -> None:
    words = [word for table in (COMMANDS, FAMILIES) for commands in table.values() for word in commands]
    added = [extension.words[0] for extension in extensions() if len(extension.words) == 1]
    assert sorted(typer.main.get_command(app).commands) == sorted([*words, *added])
    for families in FAMILIES.values():
        for word, module in families.items():
            assert module.__name__ == f"frobs_core.cli.{word}"
            for member, function in module.COMMANDS.items():
                assert function.__module__ == f"frobs_core.cli.{word}_{member}"
    for commands in COMMANDS.values():
        for word, function in commands.items():
            assert function.__module__ == f"frobs_core.cli.{word}"
