"""Integer options accept every spelling of a whole number that YAML files accept."""

from collections.abc import Callable
from typing import Any

import pytest
from typer.testing import Result

from frobs_cli.group import _is_integer
from frobs_cli.program import walk

COMMANDS = dict(walk())
INTEGERS = [
    (name, param.opts[0]) for name, command in COMMANDS.items() for param in command.params if _is_integer(param)
]


def parse(name: str, args: list[str]) -> dict[str, Any]:
    """Parse a command line without running the command."""
    command = COMMANDS[name]
    values = command.make_context(name, args).params
    return {param.opts[0]: values[param.name] for param in command.params if param.name in values}


@pytest.mark.parametrize(("name", "option"), INTEGERS, ids=" ".join)
def test_every_integer_option_accepts_every_spelling(name: str, option: str) -> None:
    params = {param.opts[0]: param for param in COMMANDS[name].params}
    needed = [word for key, param in params.items() if param.required for word in _required(key)]
    count = params[option].nargs
    expected: Any = [10] * count if count > 1 or getattr(params[option], "multiple", False) else 10
    for spelling in ("1e1", "1E+1", "10.0", "1_0", "10"):
        values = parse(name, [*needed, option, *[spelling] * count])[option]
        assert (list(values) if isinstance(expected, list) else values) == expected
        if count == 1:
            values = parse(name, [*needed, f"{option}={spelling}"])[option]
            assert (list(values) if isinstance(expected, list) else values) == expected


def _required(name: str) -> list[str]:
    """Return a required argument or option with a value."""
    return [name, "x"] if name.startswith("-") else ["x"]


@pytest.mark.parametrize("text", ["1.5", "1e-1", "inf", "nan", "many", "1e999999999", ""])
def test_other_numbers_are_rejected(frobs: Callable[..., Result], text: str) -> None:
    result = frobs("train", "CartPole-v1", "--steps", text)
    assert result.exit_code == 2
    assert "--steps" in result.stderr


def test_values_of_other_options_are_not_changed() -> None:
    found = parse("frobs train", ["CartPole-v1", "--set", "steps=1e3", "--run-dir", "1e3"])
    assert [str(found[name]) for name in ("--set", "--run-dir")] == ["['steps=1e3']", "1e3"]
