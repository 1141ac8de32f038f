"""A page for each public module of the distributions."""

import ast
import inspect
import pkgutil
from importlib import import_module

from layers import ROOT, distributions

from generate import errors
from generate.rst import directive, escape, heading, label, table, toctree

_CORE_ELSEWHERE = {"frobs_core.util.errors", "frobs_core.plugins.hooks", "frobs_core.plugins.records"}
"""Modules of the core that have a page of their own in the reference."""

_CORE_PACKAGES = ("contracts", "description", "models", "plugins", "sensing.sensors", "sensing.randomization")
"""Packages of the core whose ``__all__`` lists the public names of all their modules."""

_HELPERS = (
    "catalogue",
    "commands",
    "completion",
    "describe_fit",
    "facts",
    "field_options",
    "formats",
    "group",
    "lazy_names",
    "model_options",
    "options",
    "output",
    "parameters",
    "providers",
)
"""Modules of ``frobs_cli`` for the commands of any distribution; the others are commands."""


def _core() -> list[str]:
    """Return the public modules of the core."""
    names = {f"frobs_core.{name}" for name in (*_CORE_PACKAGES, "deprecation", "sensing.observation")}
    names |= {f"frobs_core.plugins.{name}" for name in ("capabilities", "registry")}
    for room in ("kernel", "util"):
        found = pkgutil.iter_modules([str(ROOT / "frobs_core" / room)])
        names |= {f"frobs_core.{room}.{module.name}" for module in found}
    return sorted(names - _CORE_ELSEWHERE)


MODULES = {
    "frobs-core": _core(),
    "frobs-models": ["frobs_models"],
    "frobs-deploy": ["frobs_deploy"],
    "frobs-cli": [f"frobs_cli.{name}" for name in _HELPERS],
    "frobs-train": ["frobs_train", "frobs_train.cli.jobs_progress", "frobs_train.cli.runner_options"],
    "frobs-data": ["frobs_data"],
    "frobs-view": ["frobs_view"],
    "frobs-ros2": ["frobs_ros2.safety"],
    "frobs-devkit": [
        f"frobs_devkit.{name}"
        for name in (
            "bench",
            "bench_training",
            "doctor",
            "parity",
            "probe",
            "robot_sheet",
            "scaffold",
            "scaling",
            "testing",
        )
    ],
    "frobs-rl-compat": ["frobs_rl_compat.wrappers"],
}
"""The public modules of each distribution that is more than a plugin."""


def page() -> str:
    """Return the page that lists the modules."""
    text = label("api") + heading("Python modules")
    text += (
        "This page lists the public modules of each distribution. Everything else may change without notice: modules that "
        "are not listed here, and names with a leading underscore. Separate pages describe the :ref:`errors <errors>`, and "
        "the :ref:`hooks and records <hooks>`. The other distributions are plugins; see "
        ":ref:`their parts <plugins>`, :ref:`their environments <environments>` and, for ROS, :ref:`ros`.\n\n"
    )
    for name, modules in MODULES.items():
        rows = [(f":doc:`{module} <api/{module}>`", _summary(module)) for module in modules]
        text += heading(name, "-") + f"{escape(distributions()[name].project['description'])}.\n\n"
        text += table(["module", "contents"], rows, widths="35 65")
    return text + toctree((f"api/{module}" for modules in MODULES.values() for module in modules), hidden="")


def pages() -> dict[str, str]:
    """Return a page for each module."""
    return {f"api/{module}": _page(module) for modules in MODULES.values() for module in modules}


def _page(name: str) -> str:
    module = import_module(name)
    if not set(getattr(module, "__all__", ())) <= vars(module).keys():  # imports names when they are first used
        return heading(name) + directive("automodule", name, no_members="") + _lazy(name)
    options = {"members": ""}
    if hasattr(module, "__path__"):
        elsewhere = (
            [error.__name__ for error in errors.classes(f"{name}.errors")] if f"{name}.errors" in errors.MODULES else []
        )
        options |= {"imported_members": ""} | ({"exclude_members": ", ".join(elsewhere)} if elsewhere else {})
    return heading(name) + directive("automodule", name, **options)


def _lazy(name: str) -> str:
    """Return a section for each name that a package imports when it is first used; Sphinx does not find these names."""
    module = import_module(name)
    text = ""
    for exported in module.__all__:
        value = getattr(module, exported)
        if inspect.isclass(value) or inspect.isfunction(value):
            text += directive(f"auto{'class' if inspect.isclass(value) else 'function'}", f"{name}.{exported}")
    return text


def _summary(name: str) -> str:
    """Return the first line of a module's docstring, which is read and not imported."""
    top = name.partition(".")[0]
    [package] = [found for other in distributions().values() for found in other.packages if found.name == top]
    base = package.parent.joinpath(*name.split("."))
    source = base / "__init__.py" if base.is_dir() else base.with_suffix(".py")
    return (ast.get_docstring(ast.parse(source.read_text("utf-8"))) or "").partition("\n")[0]
