"""Words of earlier versions do not come back: each idea has one word, and local names say what they hold."""

from __future__ import annotations

import ast
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

EXEMPT = (
    "CHANGELOG.md",
    "docs/how-to/port-*.md",
    "docs/explanation/decisions/*",
    "tests/external_plugins/*",
    "tests/plugins/test_deprecation.py",
    "tests/test_retired_words.py",
    "frobs_core/deprecation.py",
    "*LICENSE",
)
"""Files that show what an earlier version was like, keep it working, or are quoted word for word."""

WORDS = {
    "robot_args": "xacro_args",
    "(previous_)?given_action": "raw_action",
    "AbilityRecord": "CapabilityRecord",
    "abilit(y|ies)": "capability",
    "hookspecs": "frobs_core.plugins.hooks",
    r"frobs_core\.specs": "frobs_core.plugins.records",
    "stand[-_]ins?": "replacement, for a ROS package; legacy, for what exists only for FRobs_RL",
    "shims?": "legacy, or the class that is adapted",
    "honesty": "step_results",
    "furnish(es|ed|ing)?": "add",
}
"""Retired words, as regular expressions without regard to case, and the words to use instead."""

ALLOWED = {
    "robot_args": ("frobs_core/kernel/robot_config.py",),  # reads the keyword of 0.2
    "(previous_)?given_action": ("frobs_core/contracts/step_context.py",),  # the attributes of 0.2
    "abilit(y|ies)": ("frobs_core/plugins/records.py",),  # the field of 0.2
    "stand[-_]ins?": ("plugins/frobs-ros/src/frobs_ros/__init__.py",),  # the module of 0.2
    "shims?": ("plugins/frobs-ros/tests/test_ros_environment.py",),  # a folder of pyenv
}
"""Files in which a word may be used, because the word is there for version 0.2 or not ours."""

LOCAL_NAMES = {"told": "info", "wanted": "expected or requested", "whole": "combined or complete_scene"}
"""Retired names of variables and parameters, and examples of better names."""

SOURCES = ("frobs_core/*.py", "plugins/*/src/*.py", "templates/*.py", "docs/*.py", ".ci/*.py")

ALLOWED_LOCAL_NAMES = (
    "frobs_core/contracts/control.py",
    "frobs_core/contracts/joint_group.py",
    "frobs_core/plugins/capabilities.py",
)
"""Modules of the core with such names: a module leaves this list when it is edited next. Do not add modules."""


def _grep(option: str, pattern: str, where: tuple[str, ...] = (".",), exempt: tuple[str, ...] = ()) -> list[str]:
    """Return what ``git grep`` prints about the tracked text files that contain a word."""
    excluded = [f":(exclude){path}" for path in (*EXEMPT, *exempt)]
    command = ["git", "grep", "-IwE", option, "-e", pattern, "--", *where, *excluded]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert not done.stderr, done.stderr
    return done.stdout.splitlines()


def _local_names(path: str) -> dict[str, int]:
    """Return the names of variables and parameters in a file, with a line for each."""
    nodes = list(ast.walk(ast.parse((ROOT / path).read_bytes())))
    names = {
        node.id: node.lineno for node in nodes if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load)
    }
    return names | {node.arg: node.lineno for node in nodes if isinstance(node, ast.arg)}


@pytest.mark.parametrize("word", WORDS)
def test_a_retired_word_is_not_used(word: str) -> None:
    lines = _grep("-ni", word, exempt=ALLOWED.get(word, ()))
    assert not lines, f"use {WORDS[word]} instead:\n" + "\n".join(line[:200] for line in lines)


def test_local_names_say_what_they_hold() -> None:
    used = [
        f"{path}:{line}: {name}; use a name such as {LOCAL_NAMES[name]}"
        for path in _grep("-l", "|".join(LOCAL_NAMES), SOURCES, ALLOWED_LOCAL_NAMES)
        for name, line in _local_names(path).items()
        if name in LOCAL_NAMES
    ]
    assert not used, "\n".join(used)


def test_every_exception_is_still_needed() -> None:
    needed = [*ALLOWED_LOCAL_NAMES, *(path for paths in ALLOWED.values() for path in paths)]
    pattern = "|".join([*ALLOWED, *LOCAL_NAMES])
    assert sorted(_grep("-li", pattern, tuple(needed))) == sorted(needed)
