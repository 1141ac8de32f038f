"""The page of the errors."""

import re
from importlib import import_module

from generate.rst import directive, heading, label, literal

MODULES = {
    "frobs_core.util.errors": "The base class is :exc:`~frobs_core.util.errors.FrobsError`.",
    "frobs_cli.errors": "These errors of commands are also subclasses of :exc:`~frobs_core.util.errors.FrobsError`.",
    "frobs_train.errors": "These errors of runs are also subclasses of :exc:`~frobs_core.util.errors.FrobsError`.",
    "frobs_data.errors": "This error of data sets is also a subclass of :exc:`~frobs_core.util.errors.FrobsError`.",
    "frobs_ray.errors": "These errors of Ray clusters are also subclasses of :exc:`~frobs_core.util.errors.FrobsError`.",
    "frobs_deploy.errors": (
        "``frobs-deploy`` runs without the core, so it has its own base class: :exc:`~frobs_deploy.errors.DeployError`."
    ),
}
"""The modules that define errors, and a sentence about each."""


def classes(module: str) -> list[type[Exception]]:
    """Return the errors of a module, in the order of the file."""
    return [
        value
        for value in vars(import_module(module)).values()
        if isinstance(value, type) and issubclass(value, Exception) and value.__module__ == module
    ]


def page() -> str:
    """Return the page."""
    text = label("errors") + heading("Errors")
    text += (
        "Every error that FRobs raises deliberately is an instance of one of these classes. The message states what was "
        "requested, what exists and what to do, and the attributes contain the objects that are involved. The command line "
        "prints the message as a single line and exits with code 2.\n\n"
    )
    for module, about in MODULES.items():
        text += heading(module, "-") + f"{about}\n\n" + literal(_tree(module)) + directive("module", module)
        text += "".join(
            directive("autoexception", f"{module}.{error.__name__}", no_members="") for error in classes(module)
        )
    return text


def _tree(module: str) -> str:
    """Return the tree of classes that the module's docstring draws."""
    lines = (import_module(module).__doc__ or "").splitlines()
    drawn = [i for i, line in enumerate(lines) if "──" in line]
    tree = [re.sub(r":\w+:`([^`]+)`", r"\1", line) for line in lines[drawn[0] - 1 : drawn[-1] + 1]]
    margin = min(len(line) - len(line.lstrip()) for line in tree)
    return "\n".join(line[margin:] for line in tree)
