"""In which manner a class answers: by the name that its file imports."""

from __future__ import annotations

import ast
import inspect
import sys
from functools import lru_cache
from types import ModuleType

from packaging.version import InvalidVersion, Version

from frobs_rl_compat.manner import Manner

_OURS = ("frobs_rl", "frobs_rl_compat", "frobs_ros", "frobs_core", "gymnasium")


@lru_cache(maxsize=512)
def manner_by_imports(cls: type) -> Manner:
    """Return the manner that a class's file asks for, or else the file of a class that it inherits.

    A file that imports ``gymnasium`` has Gymnasium's manner, also where it imports both, as those do that fall back on
    ``gym``. One that imports ``gym`` has that of the ``gym`` that there is: four values, unless it is a real one of 0.26 or
    later. A file that imports neither leaves it to the next class; where none imports one, it is Gymnasium's.

    Args:
        cls: A class of an environment.
    """
    for base in cls.__mro__:
        if base.__module__.partition(".")[0] in _OURS:
            continue
        module = sys.modules.get(base.__module__)
        names = set() if module is None else imported_names(module)
        if "gymnasium" in names:
            return Manner.GYMNASIUM
        if "gym" in names:
            return manner_of_gym(sys.modules.get("gym"))
    return Manner.GYMNASIUM


def imported_names(module: ModuleType) -> set[str]:
    """Return the top-level names of what a module's file imports, wherever in it; without a file, of what it holds."""
    try:
        tree = ast.parse(inspect.getsource(module))
    except (OSError, TypeError, SyntaxError):
        held = [value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", None)
                for value in list(vars(module).values())]  # fmt: skip
        return {name.partition(".")[0] for name in held if isinstance(name, str)}
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.partition(".")[0])
    return found


def manner_of_gym(gym: ModuleType | None) -> Manner:
    """Return the manner of a module ``gym``: old gym's before version 0.26."""
    try:
        return Manner.GYMNASIUM if Version(gym.__version__) >= Version("0.26") else Manner.GYM  # type: ignore[union-attr]
    except (AttributeError, InvalidVersion):
        return Manner.GYM
