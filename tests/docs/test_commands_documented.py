from __future__ import annotations

from typing import Any

import pytest

from frobs_cli.program import walk

COMMANDS = list(walk())


@pytest.mark.parametrize(("name", "command"), COMMANDS, ids=[name for name, _ in COMMANDS])
def test_commands_are_explained_with_an_example(name: str, command: Any) -> None:
    text, _, example = (command.help or "").partition("Example:\n")
    assert text.strip()
    assert "frobs" in example


@pytest.mark.parametrize(("name", "command"), COMMANDS, ids=[name for name, _ in COMMANDS])
def test_every_argument_and_option_has_help(name: str, command: Any) -> None:
    missing = [parameter.name for parameter in command.params if not getattr(parameter, "help", None)]
    assert not missing, f"{name} does not explain {missing}"
