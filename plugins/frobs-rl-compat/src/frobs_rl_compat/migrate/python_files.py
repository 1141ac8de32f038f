"""Reads the classes and function calls in a package's Python files."""

from __future__ import annotations

import ast
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from frobs_core.util.files import read_limited
from frobs_rl_compat.migrate.migration import MigrationError

ROOTS = ("RobotBasicEnv", "CustomRobotEnv", "CCustomRobotEnv", "CustomTaskEnv")
"""FRobs_RL's own base classes, from which a package's classes inherit."""

_MAX_BYTES = 4 * 2**20  # of one Python file


@dataclass(frozen=True, eq=False)
class OldClass:
    """A class that is defined in a package."""

    name: str
    bases: tuple[str, ...]  # names of the base classes, without their modules
    methods: dict[str, ast.FunctionDef]
    node: ast.ClassDef
    tree: ast.Module  # syntax tree of the file that defines the class
    path: Path

    def does(self, method: str) -> bool:
        """Return whether a method contains anything except ``pass`` and ``raise`` statements."""
        body = self.methods[method].body
        rest = body[1:] if ast.get_docstring(self.methods[method]) is not None else body
        return not all(isinstance(statement, ast.Pass | ast.Raise) for statement in rest)

    def place(self, method: str) -> str:
        """Return a method's location, such as ``"Reach._get_reward (reach.py, lines 20-31)"``."""
        function = self.methods[method]
        return f"{self.name}.{method} ({self.path.name}, lines {function.lineno}-{function.end_lineno})"


@dataclass(frozen=True)
class Registration:
    """A call to ``register``."""

    id: str
    module: str  # last part of the name of the class's module, or empty if the call passes the class itself
    class_name: str
    max_episode_steps: int | None
    path: Path


@dataclass(frozen=True)
class PythonFiles:
    """The contents of a package's Python files."""

    classes: list[OldClass]  # sorted by file
    registrations: list[Registration]  # of environments, sorted by file
    calls: dict[Path, dict[str, list[ast.Call]]]  # for each file, by function name without its module
    unread: dict[Path, str]  # error message for each file that is not valid Python 3

    def lineage(self, old: OldClass) -> list[OldClass]:
        """Return a class, followed by its base classes from the same package."""
        bases: list[OldClass] = []
        waiting = [old]
        while waiting:
            each = waiting.pop(0)
            if each not in bases:
                bases.append(each)
                waiting += [base for name in each.bases if (base := self._find(name, each.path)) is not None]
        return bases

    def registered(self, registration: Registration) -> OldClass | None:
        """Return the class that a call to ``register`` refers to."""
        places = [path for path in self.calls if path.stem == registration.module]
        return self._find(registration.class_name, *places, registration.path)

    @property
    def environments(self) -> list[OldClass]:
        """Classes that inherit, directly or indirectly, from one of FRobs_RL's base classes."""
        return [
            each for each in self.classes
            if any(base in ROOTS for ancestor in self.lineage(each) for base in ancestor.bases)
        ]  # fmt: skip

    def _find(self, name: str, *places: Path) -> OldClass | None:
        """Return the class with the given name. If several classes have this name, prefer one from the given files."""
        named = [each for each in self.classes if each.name == name]
        return next((each for place in places for each in named if each.path == place), named[0] if named else None)


_DEFINES = re.compile(r"^\s*class\s+\w+\s*\(|^register\s*\(", re.MULTILINE)
"""Pattern that matches files that define a class or register an environment."""

_MAX_FOLDERS = 1_000


def read_file(path: Path) -> bytes:
    """Read a file of a package."""
    try:
        return read_limited(path, _MAX_BYTES)
    except OSError as error:
        raise MigrationError(path, f"cannot be read: {error.strerror}.") from error


def _find_python_files(folder: Path) -> list[Path]:
    paths = []
    for number, (place, folders, names) in enumerate(os.walk(folder)):
        if number == _MAX_FOLDERS:
            raise MigrationError(
                folder, f"this folder has more than {_MAX_FOLDERS:,} subfolders; pass the folder of one ROS package."
            )
        folders[:] = [name for name in folders if not name.startswith(".") and name not in ("build", "devel")]
        paths += [Path(place, name) for name in names if name.endswith(".py") and not name.startswith(".")]
    return sorted(paths)


def read_python_files(folder: Path) -> PythonFiles:
    """Read all Python files of a package."""
    files = PythonFiles([], [], {}, {})
    for path in _find_python_files(folder):
        source = read_file(path)
        try:
            tree = ast.parse(source.decode("utf-8"), path.name)
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:  # UnicodeDecodeError is a ValueError
            if _DEFINES.search(source.decode("utf-8", "replace")):
                raise MigrationError(
                    path,
                    f"{error}. The file may contain a part of the environment; fix the error, or convert Python 2 "
                    "code with 2to3.",
                ) from error
            files.unread[path] = str(error)
            continue
        calls = files.calls.setdefault(path, {})
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                methods = {item.name: item for item in node.body if isinstance(item, ast.FunctionDef)}
                bases = tuple(last_name(base) for base in node.bases)
                files.classes.append(OldClass(node.name, bases, methods, node, tree, path))
            elif isinstance(node, ast.Call):
                calls.setdefault(last_name(node.func), []).append(node)
        files.registrations.extend(_registrations(tree, path))
    return files


def _registrations(tree: ast.Module, path: Path) -> Iterator[Registration]:
    for node in ast.walk(tree):
        if not (isinstance(node, ast.Call) and last_name(node.func) == "register"):
            continue
        given = {keyword.arg: keyword.value for keyword in node.keywords if keyword.arg}
        given |= dict(zip(("id", "entry_point"), node.args, strict=False))
        id, entry, steps = (
            value.value if isinstance(value := given.get(key), ast.Constant) else None
            for key in ("id", "entry_point", "max_episode_steps")
        )
        point = entry if isinstance(entry, str) else last_name(given["entry_point"]) if "entry_point" in given else ""
        if isinstance(id, str) and point:
            limit = steps if isinstance(steps, int) and not isinstance(steps, bool) else None
            module, _, name = point.rpartition(":")
            yield Registration(id, module.rpartition(".")[2], name, limit, path)


def last_name(node: ast.expr) -> str:
    """Return the last part of a dotted name, or an empty string for any other expression."""
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""
