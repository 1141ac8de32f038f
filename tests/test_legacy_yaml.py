from __future__ import annotations

import pytest

from frobs_core.errors import ConfigFileError
from frobs_core.legacy_yaml import read_section
from frobs_core.parameters import positive
from frobs_core.yaml import load_yaml_text


def read(text: str) -> dict[str, object]:
    return read_section(load_yaml_text(text, "task.yaml"), "task.yaml", "robot", {"size": positive}, ["colour"])


def test_what_means_something_is_read_and_the_rest_passed_over() -> None:
    assert read("robot:\n  size: 2\n  colour: red\n") == {"size": 2.0}


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("robot:\n  syze: 2\n", 2, "unknown key 'syze'. Did you mean 'size'.*colour"),
        ("robot:\n  colour: red\n  size: -2\n", 3, "size is -2"),
        ("robots:\n  size: 2\n", 1, "must hold 'robot:'"),
        ("robot: 2\n", 1, "must hold a mapping under 'robot:'"),
    ],
)
def test_mistakes_are_told_with_file_and_line(text: str, line: int, message: str) -> None:
    with pytest.raises(ConfigFileError, match=message) as failure:
        read(text)
    assert failure.value.line == line
