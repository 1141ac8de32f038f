"""Deprecation warnings that name the replacement, and the table of what version 0.2 offered in other places."""

from __future__ import annotations

import logging
import os
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from importlib import import_module
from importlib.machinery import PathFinder
from importlib.util import find_spec
from operator import attrgetter
from types import ModuleType
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


STRICT = "FROBS_DEPRECATIONS"
"""Environment variable with the value ``error``, which makes the use of a deprecated part an error."""


class FrobsDeprecationWarning(DeprecationWarning):
    """Warning about the use of a deprecated part of FRobs. The message names the replacement."""


def warn_deprecated(what: str, *, instead: str, since: str, removed_in: str, stacklevel: int = 2) -> None:
    """Warn that a deprecated part of FRobs is used.

    The tests of many plugins treat all warnings as errors. Because a plugin must keep working until a deprecated part
    is removed, the warning is then logged instead, unless ``FROBS_DEPRECATIONS=error`` is set.

    Args:
        what: Deprecated part, such as ``"RobotHandle.joint_torques"``.
        instead: Replacement for the deprecated part, such as ``"RobotHandle.joint_efforts"``.
        since: Version of the core that first announced the deprecation.
        removed_in: Version that removes the part. It must be a later major version than ``since`` (before 1.0, a later
            minor version).
        stacklevel: Stack level of the code that uses the deprecated part. Level 2 is the caller of the function that
            calls ``warn_deprecated``.
    """
    text = f"{what} has been deprecated since frobs-core {since} and will be removed in {removed_in}; use {instead}."
    try:
        warnings.warn(text, FrobsDeprecationWarning, stacklevel=stacklevel + 1)
    except FrobsDeprecationWarning:
        if os.environ.get(STRICT) == "error":
            raise
        logging.getLogger("frobs").warning("%s", text)


def deprecated(*, instead: str, since: str, removed_in: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Mark a function or method as deprecated. For the arguments, see :func:`warn_deprecated`.

    Example::

        @deprecated(instead="load_model", since="0.2", removed_in="0.3")
        def read_model(path): ...
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def warning(*args: P.args, **kwargs: P.kwargs) -> R:
            what = f"{function.__module__}.{function.__qualname__}"
            warn_deprecated(what, instead=instead, since=since, removed_in=removed_in)
            return function(*args, **kwargs)

        return warning

    return decorate


_SAME_NAME = (
    ("kernel", ("added_terms", "compose", "config", "copying", "inputs", "robot_config", "vector_env")),
    ("plugins", ("registry",)),
    ("sensing", ("randomization", "sensors")),
    ("util", ("arrays", "files", "install_hints", "keywords", "plain", "random", "rotations", "yaml")),
)
"""Modules that were at the top of ``frobs_core`` in version 0.2, by the package that contains them now."""

MOVED: Mapping[str, Sequence[str]] = {
    **{f"frobs_core.{name}": [f"frobs_core.{room}.{name}"] for room, names in _SAME_NAME for name in names},
    "frobs_core.capabilities": ["frobs_core.plugins.records", "frobs_core.plugins.capabilities"],
    "frobs_core.control": ["frobs_core.contracts.control"],
    "frobs_core.env": ["frobs_core.kernel.env"],
    "frobs_core.errors": ["frobs_core.util.errors", "frobs_cli.errors"],
    "frobs_core.hookspecs": ["frobs_core.plugins.hooks"],
    "frobs_core.interfaces": [
        "frobs_core.contracts",
        "frobs_core.description",
        "frobs_models",
        "frobs_core.kernel.policies",
        "frobs_controllers.discrete",
    ],
    "frobs_core.models": ["frobs_models"],
    "frobs_core.observation": ["frobs_core.description", "frobs_core.sensing.observation"],
    "frobs_core.plugins": ["frobs_devkit.probe", "frobs_devkit.doctor.requirements"],
    "frobs_core.specs": ["frobs_core.plugins.records"],
    "frobs_core.validation": ["frobs_core.util.validation", "frobs_tasks_reach.start"],
    "frobs_core.wrappers": ["frobs_rl_compat.wrappers"],
}
"""Public modules of version 0.2, and the modules that define their names now. Some of them still exist, with fewer
names.
"""

RENAMED: Mapping[str, str] = {
    "AbilityRecord": "CapabilityRecord",
    "CubeTask": "ObjectTask",
    "abilities": "known_capabilities",
    "ObservationTermError": "ConfigurationError",
    "RandomizationError": "SettingError",
    "SensorSettingError": "SettingError",
}
"""New names of what version 0.2 offered under another name in one of these modules."""


def moved_names(module: str, places: Sequence[str] = (), stacklevel: int = 2) -> Callable[[str], Any]:
    """Return a ``__getattr__`` for a module of version 0.2, which finds names in the modules that define them now.

    Args:
        module: The module of version 0.2.
        places: Modules that define the names now. By default, the modules in ``MOVED``.
        stacklevel: Stack level of the code that uses a name, as in :func:`warn_deprecated`.
    """
    places = places or MOVED[module]

    def find(name: str) -> Any:
        if name == "__all__":
            installed = [place for place in places if find_spec(place.partition(".")[0])]
            if public := [one for place in installed for one in getattr(import_module(place), name, ())]:
                return public
        package = vars(sys.modules[module]).get("__path__") if module in sys.modules else None
        if name.startswith("__") or (package and PathFinder.find_spec(f"{module}.{name}", package)):  # not imported yet
            raise AttributeError(f"module '{module}' has no attribute '{name}'")
        new = RENAMED.get(name, name)
        missing = ""
        for place in places:
            try:
                home = import_module(place)
                hook = vars(home).get("__getattr__")
                moved_again = getattr(hook, "__module__", "") == __name__  # another place follows
                value = vars(home)[new] if moved_again else getattr(home, new)
            except (AttributeError, KeyError):
                continue
            except ModuleNotFoundError as error:
                missing = (error.name or place).partition(".")[0].replace("_", "-")
                continue
            what, instead = f"{module}.{name}", f"{place}.{new}"
            warn_deprecated(what, instead=instead, since="0.3", removed_in="0.4", stacklevel=stacklevel)
            return value
        if missing:
            raise ImportError(f"'{module}' no longer has '{name}'; to install its new place: pip install {missing}.")
        raise AttributeError(f"module '{module}' has no attribute '{name}'")

    return find


def keep_moved_modules(moved: Mapping[str, Sequence[str]] = MOVED) -> None:
    """Keep modules of version 0.2 importable. Each name that is taken from one of them causes a warning.

    Other distributions call this function with their own modules.

    Args:
        moved: For each module of version 0.2, the modules that now have its names.
    """
    for name, places in moved.items():
        if name not in ("frobs_core.models", "frobs_core.plugins"):
            module = sys.modules[name] = ModuleType(name)
            vars(module)["__getattr__"] = moved_names(name, places)
            parent, _, child = name.rpartition(".")
            setattr(sys.modules[parent], child, module)


def renamed_attribute(old: str, new: str) -> Any:
    """Return a property for the name of an attribute in version 0.2. Reading it causes a warning.

    Args:
        old: Name of the attribute in version 0.2.
        new: Name of the attribute now, such as ``"place"`` or ``"tool.pos"``.
    """

    def read(part: Any) -> Any:
        cls = type(part).__qualname__
        warn_deprecated(f"{cls}.{old}", instead=f"{cls}.{new}", since="0.3", removed_in="0.4")
        return attrgetter(new)(part)

    return property(read)


def rename_keywords(keywords: Mapping[str, Any], new_names: Mapping[str, str]) -> dict[str, Any]:
    """Return keywords with their names now, and warn about each that has a name of version 0.2.

    Args:
        keywords: The keywords.
        new_names: New names by old name. A new name that is also among the keywords takes precedence.
    """
    renamed = dict(keywords)
    for old, new in new_names.items():
        if old in renamed:
            warn_deprecated(f"the keyword '{old}'", instead=f"'{new}'", since="0.3", removed_in="0.4")
            renamed.setdefault(new, renamed[old])
            del renamed[old]
    return renamed
