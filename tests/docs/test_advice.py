"""Messages, help texts and docstrings name only commands, flags and packages that exist."""

from __future__ import annotations

import ast
import re
from functools import cache
from typing import Any

from pages import ROOT

from frobs_cli.program import walk

COMMANDS: dict[str, Any] = {name.removeprefix("frobs").strip(): command for name, command in walk()}
FLAGS = {
    name: {flag for option in command.params for flag in (*option.opts, *option.secondary_opts)} | {"--help"}
    for name, command in COMMANDS.items()
}
DISTRIBUTIONS = {path.parent.name for path in ROOT.glob("plugins/*/pyproject.toml")} | {"frobs-core"}
PINNED = {
    line.split("==")[0].lower().replace("_", "-") for line in (ROOT / "constraints.txt").read_text("utf-8").splitlines()
}
OUTSIDE = {
    *("--find-links", "--no-deps", "--upgrade", "--force-reinstall", "--system-site-packages"),  # pip, venv
    *("--porcelain", "--untracked-files", "--build", "--parallel", "--directory"),  # git, cmake, http.server
    *("--ros-args", "--head", "--address", "--env"),  # ROS 2, Ray, LeRobot
    *("--inorder", "--stopped", "--wait-for", "--physics", "--core"),  # ROS 1 and Gazebo
    *("--world-name", "--pause", "--step", "--multi-step", "--reset-all", "--reset-models"),  # gz
    *("--bench", "--respawn", "--grace", "--inside", "--root", "--scratch"),  # modules of FRobs, with python -m
}
"""Flags of other programs."""
LEGACY = "frobs legacy run"
"""Passes what follows the script on to it."""
EXAMPLES = {"name", "acme-wind", "frobs-sim"}
"""Parts of the names of packages that do not exist."""


@cache
def texts() -> list[tuple[str, str]]:
    """Return the place and the text of each string of the source; computed values become ``{}``."""
    found = []
    for path in [*ROOT.glob("frobs_core/**/*.py"), *ROOT.glob("plugins/*/src/**/*.py")]:
        tree = ast.parse(path.read_text("utf-8"))
        parts = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
        for node in ast.walk(tree):
            place = f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 0)}"
            if isinstance(node, ast.JoinedStr):
                values = [part.value if isinstance(part, ast.Constant) else "{}" for part in node.values]
                found.append((place, "".join(str(value) for value in values)))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in parts:
                found.append((place, node.value))
    return found


def unknown_parts(line: str) -> list[str]:
    """Return what a command line such as ``frobs list envs --json`` names that does not exist."""
    words = LEGACY.split()[1:] if line.startswith(LEGACY) else line.split()[1:]
    name = ""
    while words and f"{name} {words[0]}".strip() in {*COMMANDS, *(other.rpartition(" ")[0] for other in COMMANDS)}:
        name = f"{name} {words.pop(0)}".strip()
    if name not in COMMANDS:
        return [] if name and not words else [line]
    flags = [word.partition("=")[0].rstrip(".,;:)'") for word in words if re.match(r"--[a-z]", word)]
    return [f"{flag} of {line}" for flag in flags if flag not in FLAGS[name]]


def test_advised_commands_and_their_flags_exist() -> None:
    wrong, count = [], 0
    for place, text in texts():
        for quoted, example in re.findall(r"'(frobs [a-z][^'\n]*)'|^\s*\$ (frobs [a-z][^\n]*)$", text, re.MULTILINE):
            count += 1
            wrong += [f"{place}: {part}" for part in unknown_parts(quoted or example)]
    assert count > 150
    assert wrong == []


def test_advised_flags_exist_in_some_command() -> None:
    known, wrong, count = set().union(*FLAGS.values()) | OUTSIDE, [], 0
    for place, text in texts():
        for flag in re.findall(r"(?<![\w{}-])(--[a-z][a-z0-9-]+)(?![\w{])", text):
            count += 1
            wrong += [] if flag in known else [f"{place}: {flag}"]
    assert count > 150
    assert wrong == []


def test_advised_packages_exist() -> None:
    wrong, count = [], 0
    for place, text in texts():
        for package in re.findall(r"pip install '?([a-zA-Z][\w.-]*\w)", text):
            count += 1
            name = package.lower().replace("_", "-")
            wrong += [] if name in DISTRIBUTIONS | PINNED | EXAMPLES else [f"{place}: {package}"]
    assert count > 20
    assert wrong == []
