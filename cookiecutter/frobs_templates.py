"""Functions that create the scaffold's files from the files in ``templates/`` and ``partials/``.

Both cookiecutter and ``frobs new`` use this Jinja extension. It needs frobs-devkit only to read a robot's model file.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from jinja2 import Environment, pass_context
from jinja2.ext import Extension
from jinja2.runtime import Context

_HERE = Path(__file__).parent


def camel(name: str) -> str:
    """Return ``MyArm`` for ``my_arm``."""
    return "".join(word[:1].upper() + word[1:] for word in name.split("_"))


def renamed(text: str, old: str, new: str) -> str:
    """Return a text with a name replaced in all its spellings: my_arm, MY_ARM, MyArm and my-arm."""
    spellings = {
        old: new,
        old.upper(): new.upper(),
        camel(old): camel(new),
        old.replace("_", "-"): new.replace("_", "-"),
    }
    pattern = "|".join(map(re.escape, sorted(spellings, key=len, reverse=True)))
    return re.sub(pattern, lambda match: spellings[match[0]], text)


def plain(name: str, *names: str) -> str:
    """Return a file from ``templates/`` with the given names replaced.

    The self-check at the end of the file is removed, because the plugin has tests instead.

    Args:
        name: Name of the file.
        *names: Pairs of names: each old name is followed by its new name.
    """
    text = (_HERE.parent / "templates" / name).read_text("utf-8")
    check = '\n\nif __name__ == "__main__":'
    text = text.partition(check)[0].rstrip("\n") + "\n"
    if name.endswith(".yaml"):
        text = text.replace(name, "train.yaml")
    for old, new in zip(names[::2], names[1::2], strict=True):
        text = renamed(text, old, new)
    return text


def algorithm(name: str) -> str:
    """Return ``templates/algorithm.py`` renamed and without the algorithm's record, which is in ``plugin.py``."""
    text = (_HERE.parent / "templates" / "algorithm.py").read_text("utf-8").partition("\n\n\n@hookimpl")[0] + "\n"
    for line in (
        "from frobs_core.plugins.hooks import hookimpl\n",
        "from frobs_core.plugins.records import AlgorithmRecord\n",
    ):
        text = text.replace(line, "")
    summary, how, rest = text.partition("\n\nTo package it as a distribution")
    text = summary + "\n" + rest[rest.index('"""') :] if how else text
    return text.replace("cross_entropy", name).replace("CrossEntropy", camel(name))


def paced_simulator(name: str) -> str:
    """Return ``templates/my_paced_simulator.py`` renamed and without its record, which is in ``plugin.py``."""
    text = plain("my_paced_simulator.py")
    text = text.replace("from frobs_core.plugins.records import Level, SimulatorRecord\n", "")
    before, _, rest = text.partition("RECORD = SimulatorRecord(")
    return renamed(before + rest.partition("\n)\n\n")[2], "my_paced_simulator", name)


@pass_context
def partial(context: Context, name: str, **values: Any) -> str:
    """Return a rendered file of ``partials/``.

    Args:
        context: Context of the including file.
        name: Name of the partial.
        **values: Additional variables.
    """
    text = (_HERE / "partials" / name).read_text("utf-8")
    return context.environment.from_string(text).render({**context.get_all(), **values})


@pass_context
def robot_file(context: Context) -> Any:
    """Return the data from the robot's model file that the answers specify."""
    from frobs_devkit.scaffold.robot_file import facts_for  # needed only for a robot's model file

    return facts_for(context["cookiecutter"])


@pass_context
def robot_distribution(context: Context) -> str:
    """Return the distribution that provides the installed robot of a new task."""
    name = context["cookiecutter"]["robot"]
    if name == "irb120":
        return "frobs-robots-abb"
    from frobs_core import plugins

    return plugins.get_report("robot", name).distribution


class Templates(Extension):
    """Jinja extension that provides the functions above to the templates."""

    def __init__(self, environment: Environment) -> None:
        super().__init__(environment)
        for function in (camel, plain, algorithm, paced_simulator, partial, robot_file, robot_distribution):
            environment.globals[function.__name__] = function
        environment.filters["literal"] = repr_double


def repr_double(value: Any) -> str:
    """Return a value as Python code in ruff's format, with double quotes around strings."""
    if not isinstance(value, str):
        return repr(value)
    escaped = value.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
