"""The Python files of a package: their classes and calls."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from frobs_rl_compat.migrate.errors import MigrationError

ROOTS = ("RobotBasicEnv", "CustomRobotEnv", "CCustomRobotEnv", "CustomTaskEnv")
"""FRobs_RL's own classes, which a package's inherit."""


@dataclass(frozen=True)
class OldClass:
    """A class of an environment.

    Attributes:
        bases: Last parts of the names of what it inherits.
        tree: That of its file.
    """

    name: str
    bases: tuple[str, ...]
    methods: dict[str, ast.FunctionDef]
    node: ast.ClassDef
    tree: ast.Module
    path: Path
    source: str

    def text(self, method: str, without: Callable[[ast.stmt], bool] = lambda statement: False) -> list[str]:
        """Return the lines of a method's body, without its docstring and indentation."""
        function = self.methods[method]
        body = function.body[1:] if ast.get_docstring(function) is not None else function.body
        all_lines = self.source.expandtabs(4).splitlines()
        lines: list[str] = []
        end = function.body[0].end_lineno or 0 if body is not function.body else body[0].lineno - 1
        for statement in body:
            begin, end = end, statement.end_lineno or statement.lineno
            if not without(statement):
                lines += all_lines[begin:end]  # with the comments and empty lines before it
        margin = min((len(line) - len(line.lstrip()) for line in lines if line.strip()), default=0)
        kept = [line[margin:].rstrip() for line in lines]
        while kept and not kept[0]:
            kept.pop(0)
        return kept

    def signature(self, method: str) -> str:
        """Return the first line of a method."""
        return f"def {method}({ast.unparse(self.methods[method].args)}):"


@dataclass(frozen=True)
class Registration:
    """A call of ``register``."""

    id: str
    class_name: str
    max_episode_steps: int | None
    path: Path


@dataclass(frozen=True)
class PythonFiles:
    """What the files have.

    Attributes:
        classes: Environments, by name.
        registrations: In the order of the files.
        calls: Calls by the last part of the function's name: ``"TimeLimitWrapper"``.
        unread: Files that are no Python of today, with what is wrong.
    """

    classes: dict[str, OldClass]
    registrations: list[Registration]
    calls: dict[str, list[ast.Call]]
    unread: dict[Path, str]

    def lineage(self, name: str) -> list[OldClass]:
        """Return a class and those of the package that it inherits, itself first."""
        found, names = [], [name]
        while names:
            known = self.classes.get(names.pop(0))
            if known is not None and known not in found:
                found.append(known)
                names += known.bases
        return found

    @property
    def environments(self) -> list[OldClass]:
        """The classes that inherit one of FRobs_RL's, over whatever others."""
        return [
            each for each in self.classes.values()
            if any(base in ROOTS for ancestor in self.lineage(each.name) for base in ancestor.bases)
        ]  # fmt: skip


_DEFINES = re.compile(r"^\s*class\s+\w+\s*\(|^register\s*\(", re.MULTILINE)
"""What a file with a part of an environment has."""


def read_python_files(folder: Path) -> PythonFiles:
    """Read all Python files of a package.

    Raises:
        ConfigurationError: One that defines a class, or registers an environment, is no Python of today.
    """
    files = PythonFiles({}, [], {}, {})
    for path in sorted(folder.rglob("*.py")):
        if any(part.startswith(".") or part in ("build", "devel") for part in path.relative_to(folder).parts):
            continue
        try:
            source = path.read_text("utf-8")
            tree = ast.parse(source, path.name)
        except (SyntaxError, ValueError) as error:  # of which UnicodeDecodeError is one
            if _DEFINES.search(path.read_text("utf-8", "replace")):
                raise MigrationError(
                    path,
                    f"{error}. It may contain a part of the environment: fix it; convert a file of Python 2 with 2to3.",
                ) from error
            files.unread[path] = str(error)
            continue
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                methods = {item.name: item for item in node.body if isinstance(item, ast.FunctionDef)}
                bases = tuple(_last(base) for base in node.bases)
                files.classes.setdefault(node.name, OldClass(node.name, bases, methods, node, tree, path, source))
            elif isinstance(node, ast.Call):
                files.calls.setdefault(_last(node.func), []).append(node)
        files.registrations.extend(_registrations(tree, path))
    return files


def _registrations(tree: ast.Module, path: Path) -> Iterator[Registration]:
    for node in ast.walk(tree):
        if not (isinstance(node, ast.Call) and _last(node.func) == "register"):
            continue
        given = {keyword.arg: keyword.value for keyword in node.keywords if keyword.arg}
        given |= dict(zip(("id", "entry_point"), node.args, strict=False))
        id, entry, steps = (
            value.value if isinstance(value := given.get(key), ast.Constant) else None
            for key in ("id", "entry_point", "max_episode_steps")
        )
        point = entry if isinstance(entry, str) else _last(given["entry_point"]) if "entry_point" in given else ""
        if isinstance(id, str) and point:
            limit = steps if isinstance(steps, int) and not isinstance(steps, bool) else None
            yield Registration(id, point.rpartition(":")[2], limit, path)


def _last(node: ast.expr) -> str:
    """Return the last part of a dotted name; empty for anything else."""
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""
