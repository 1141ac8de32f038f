"""The xacro files of this repository and of installed packages expand to what version 0.1 made of them."""

from __future__ import annotations

import hashlib
import json
from importlib.metadata import distribution
from pathlib import Path

import pytest

from frobs_models.resources import Packages
from frobs_models.xacro.files import expand_xacro

REPOSITORY = Path(__file__).parents[2]
EXPANDED = json.loads(Path(__file__).with_name("expanded.json").read_text("utf-8"))
"""SHA-256 of what each file expanded to in version 0.1, with the folder of the file written as ``@``."""


def find(name: str) -> Path:
    """Return a file by the name that the table gives it."""
    if not name.startswith("example-robot-data/"):
        return REPOSITORY / name
    data = distribution("example-robot-data").locate_file("cmeel.prefix/share")
    return Path(str(data)) / name


def expanded(path: Path) -> str:
    """Return the SHA-256 of what a file expands to."""
    text = expand_xacro(path, {}, Packages({}, path)).replace(str(path.resolve().parent), "@")
    return hashlib.sha256(text.encode()).hexdigest()


@pytest.mark.parametrize(("name", "digest"), EXPANDED.items())
def test_a_robot_expands_as_in_version_0_1(name, digest):
    assert expanded(find(name).resolve()) == digest
