"""Find out whether what defines a measured row has changed since it was measured.

The fingerprint of a row contains a hash of each file that defines its task, robot, controller and tuned settings, and for
imitation its expert. Imports, docstrings and comments of Python files, and comments of YAML files, do not change it.
"""

from __future__ import annotations

import ast
import hashlib
import inspect
import json
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import yaml

from frobs_core import plugins
from frobs_core.plugins import registry

ROOT = Path(__file__).parents[2]
MODELS = (".xacro", ".urdf", ".xml")
"""File name extensions of robot models."""
IMITATION = ("dagger", "bc", "act")
"""Algorithms that learn from the task's scripted expert."""
CHANGED, UNKNOWN = "†", "‡"
"""Marks of rows that changed since they were measured, and of rows of which this is not known."""


def defining_files(id: str, algorithm: str, controller: str = "") -> list[str]:
    """Return the files that define a row, relative to the root of the repository.

    Args:
        id: Gymnasium ID.
        algorithm: Name of the algorithm.
        controller: Name of the controller; empty: the ID's default.
    """
    task, environment = registry.environments()[id]
    modules = [cls.__module__ for cls in task.load().__mro__]
    found = [_source(name) for name in modules if name.partition(".")[0] not in ("frobs_core", "abc", "builtins")]
    if algorithm in IMITATION:
        found.append(_source(task.load().expert.partition(":")[0]))
    found.append(_source(_record("controller", controller or environment.controller).entry_point.partition(":")[0]))
    if environment.robot:
        robot = _record("robot", environment.robot)
        found.append(_source(robot.entry_point.partition(":")[0]))
        # Models of other robots may be in the same folder; "panda" contains "panda_arm".
        others = [name for name in plugins.records("robot") if not name.startswith(environment.robot)]
        models = (path for path in (found[-1].parent / "models").rglob("*") if path.suffix in MODELS)
        found += [path for path in models if path.name.partition(".")[0] not in others]
    package, _, path = _record("algorithm", algorithm).tuned[id].partition(":")
    found.append(_source(package).parent / path)
    return sorted({str(each.relative_to(ROOT)) for each in found})


def fingerprint(id: str, algorithm: str, controller: str = "") -> dict[str, str]:
    """Return a hash of each of the files of :func:`defining_files`, which also describes the arguments."""
    return {path: _hash(path, (ROOT / path).read_bytes()) for path in defining_files(id, algorithm, controller)}


def fingerprint_at(commit: str, files: Sequence[str]) -> dict[str, str] | None:
    """Return the hashes of files at a commit, or None if the commit is not in the history or was not clean.

    A file that did not exist has an empty hash.
    """
    if _git("merge-base", "--is-ancestor", commit, "HEAD") is None:
        return None
    contents = {path: _git("show", f"{commit}:{path}") for path in files}
    return {path: "" if text is None else _hash(path, text) for path, text in contents.items()}


def changed_files(row: Mapping[str, Any], current: Mapping[str, str]) -> list[str] | None:
    """Return the names of the files that differ from a row's fingerprint, or None if the row has no fingerprint."""
    measured = row.get("files")
    if measured is None:
        return None
    return sorted({Path(path).name for path in {**measured, **current} if measured.get(path) != current.get(path)})


def mark(rows: Sequence[Mapping[str, Any]], current: Mapping[str, str]) -> str:
    """Return the mark of a row of a table that summarizes measured rows, or an empty string."""
    found = [changed_files(row, current) for row in rows]
    return CHANGED if any(found) else UNKNOWN if None in found else ""


def footnotes(rows: Mapping[str, tuple[Sequence[Mapping[str, Any]], Mapping[str, str]]]) -> list[str]:
    """Return the lines that explain the marks below a table.

    Args:
        rows: Measured rows and current fingerprint, by the description of the row of the table.
    """
    marks = {name: mark(*each) for name, each in rows.items()}
    lines: list[str] = []
    changed = []
    for name, (measured, current) in rows.items():
        files = {file for row in measured for file in changed_files(row, current) or ()}
        changed += [f"{name} ({', '.join(sorted(files))})"] * bool(files)
    if changed:
        lines += ["", f"{CHANGED} These files changed after the measurement: {'; '.join(changed)}."]
    if unknown := [name for name in rows if marks[name] == UNKNOWN]:
        lines += [
            "",
            f"{UNKNOWN} It is not known whether the task, robot, controller or tuned settings changed after the "
            f"measurement: {'; '.join(unknown)}.",
        ]
    return lines


def add_fingerprints(record: Path, files_of: Callable[[Mapping[str, Any]], Sequence[str]]) -> None:
    """Add fingerprints to the rows of a file that have none, from the commits at which they were measured.

    Args:
        record: File with the rows, which also contain ``commit``.
        files_of: Function that returns the files that define a row.
    """
    rows = json.loads(record.read_text("utf-8"))
    for row in rows:
        if "files" not in row:
            files = fingerprint_at(row["commit"], files_of(row))
            row |= {} if files is None else {"files": files}
    missing = sum("files" not in row for row in rows)
    sys.stderr.write(f"{len(rows) - missing} of {len(rows)} rows have a fingerprint\n")
    record.write_text(json.dumps(rows, indent=1) + "\n", "utf-8")


def _record(kind: str, name: str) -> Any:
    return plugins.get_record(kind, name)


def _source(module: str) -> Path:
    return Path(str(inspect.getsourcefile(import_module(module)))).resolve()


def _git(*arguments: str) -> bytes | None:
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True)
    return done.stdout if done.returncode == 0 else None


def _hash(path: str, content: bytes) -> str:
    if path.endswith(".py"):
        content = ast.unparse(_Code().visit(ast.parse(content))).encode()
    elif path.endswith((".yaml", ".yml")):
        content = json.dumps(yaml.safe_load(content), sort_keys=True).encode()
    return hashlib.blake2b(content, digest_size=6).hexdigest()


class _Code(ast.NodeTransformer):
    """Removes what does not change the behavior: docstrings, and imports, because modules move."""

    def visit_Expr(self, node: ast.Expr) -> ast.AST:
        is_text = isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        return ast.Pass() if is_text else node

    def visit_Import(self, node: ast.Import) -> ast.AST:
        return ast.Pass()

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.AST:
        return ast.Pass()
