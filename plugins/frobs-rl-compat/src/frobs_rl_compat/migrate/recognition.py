"""Recognizes the example tasks of FRobs_RL by the structure of their methods.

Only fingerprints of the original code are stored, in ``known_tasks.yaml``. A fingerprint ignores comments, docstrings,
logs, markers, and the literals that :mod:`frobs_rl_compat.migrate.examples` reads. A package in which only numbers were
changed is therefore recognized, and a package whose code was changed is not.
"""

from __future__ import annotations

import ast
import copy
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from frobs_core.yaml import load_yaml
from frobs_rl_compat.migrate.package import OldPackage
from frobs_rl_compat.migrate.python_files import OldClass

KNOWN_TASKS = Path(__file__).with_name("known_tasks.yaml")

_SETTINGS = ("__init__", "get_params")
"""Methods whose numbers are read by the name to which they are assigned."""

_NAMED = ("get_param", "has_param", "ros_load_yaml_from_pkg", "urdf_parse_from_pkg")
"""Functions whose arguments name a parameter or a file that is read."""

_POSES = ("gazebo_spawn_sdf_string", "gazebo_set_model_state")
"""Functions whose numbers are read: the poses of models."""

_SILENT = ("rospy.log", "rospy.sleep", "print")
"""Prefixes of calls that have no effect on the task."""

_IGNORED_FIELDS = ("ctx", "kind", "type_comment", "type_params", "returns", "annotation")


@dataclass(frozen=True)
class Recognition:
    """The example task that a package's task is most similar to.

    Attributes:
        name: Its key in ``known_tasks.yaml``, such as ``"maze"``.
        differing: Methods that differ from the example's, with their places; empty if the task is the example.
    """

    name: str
    differing: list[str]


def recognize(package: OldPackage) -> Recognition | None:
    """Return the most similar example task; None if none shares at least half of the task's methods."""
    known = load_yaml(KNOWN_TASKS)
    found = []
    for name, task in known["tasks"].items():
        differing = _differing(package.lineage[0], task["methods"])
        if 2 * len(differing) > len(task["methods"]):
            continue
        if [len(old.bases) for old in package.lineage] == [1, 1]:
            differing += _differing(package.lineage[1], known["robots"][task["robot"]])
        else:
            differing.append(f"the classes that {package.lineage[0].name} inherits")
        for node in task.get("nodes", ()):
            own = [old for old in package.python.classes if old.name == node]
            differing += _differing(own[0], known["nodes"][node]) if own else [f"{node}, which is missing"]
        found.append(Recognition(name, differing))
    return min(found, key=lambda each: len(each.differing), default=None)


def fingerprint(method: ast.FunctionDef) -> str:
    """Return 16 hexadecimal digits that are equal for methods of the same structure, in every version of Python."""
    bare = _Structure(method.name).visit(copy.deepcopy(method))
    return hashlib.sha256(json.dumps(_plain(bare)).encode()).hexdigest()[:16]


def factors(method: ast.FunctionDef) -> list[float]:
    """Return the numbers that a method adds, subtracts or multiplies by, in the order of its lines."""
    found = [side for node in ast.walk(method) if isinstance(node, ast.BinOp) and isinstance(node.op, _ARITHMETIC)
             for side in (node.left, node.right) if _is_number(side)]  # fmt: skip
    return [side.value for side in sorted(found, key=lambda side: (side.lineno, side.col_offset))]  # type: ignore[attr-defined]


def _differing(old: OldClass, known: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the methods that are new, different or missing."""
    changed = [
        old.place(name) for name, method in old.methods.items() if fingerprint(method) not in known.get(name, ())
    ]
    return changed + [f"{old.name}.{name}, which is missing" for name in known if name not in old.methods]


_ARITHMETIC = (ast.Add, ast.Sub, ast.Mult)


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool)


class _Structure(ast.NodeTransformer):
    """Removes parts that have no effect on the task, and the literals that are read.

    Args:
        method: Name of the method.
    """

    def __init__(self, method: str) -> None:
        self._settings = method in _SETTINGS
        self._reward = method == "_get_reward"
        self._numbers_are_read = self._settings

    def visit_Expr(self, node: ast.Expr) -> ast.AST | None:
        """Remove docstrings, logs, and what is sent to a marker."""
        text = ast.unparse(node.value)
        is_silent = isinstance(node.value, ast.Call) and (text.startswith(_SILENT) or ".pub_marker." in text)
        return None if is_silent or isinstance(node.value, ast.Constant) else self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> ast.AST | None:
        """Remove markers, and the literals that a constructor assigns to local names."""
        if "_marker" in ast.unparse(node.targets[0]):
            return None
        if self._settings and isinstance(node.targets[0], ast.Name) and _is_literal(node.value):
            node.value = _blank()
            return node
        return self.generic_visit(node)

    def visit_If(self, node: ast.If) -> ast.AST | None:
        """Remove conditions with an empty body."""
        self.generic_visit(node)
        return node if node.body or node.orelse else None

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Remove the arguments of ``super`` and of functions that name what is read, and the numbers of poses."""
        name = ast.unparse(node.func).rpartition(".")[2]
        if name == "super" or name in _NAMED:
            node.args, node.keywords = [], []
            return node
        before = self._numbers_are_read
        self._numbers_are_read |= name in _POSES
        self.generic_visit(node)
        self._numbers_are_read = before
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        """Remove the factors of a reward."""
        self.generic_visit(node)
        if self._reward and isinstance(node.op, _ARITHMETIC):
            node.left, node.right = (_blank() if _is_number(side) else side for side in (node.left, node.right))
        return node

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        """Remove a number that is read."""
        return _blank() if self._numbers_are_read and _is_number(node) else node

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        """Remove the sign of a number that is read."""
        self.generic_visit(node)
        return node.operand if _is_blank(node.operand) else node

    def visit_List(self, node: ast.List) -> ast.AST:
        """Remove a list of numbers that are read, whatever its length."""
        self.generic_visit(node)
        return _blank() if node.elts and all(map(_is_blank, node.elts)) else node


def _blank() -> ast.Name:
    return ast.Name("LITERAL")


def _is_blank(node: ast.AST) -> bool:
    return isinstance(node, ast.Name) and node.id == "LITERAL"


def _is_literal(node: ast.expr) -> bool:
    try:
        ast.literal_eval(node)
    except ValueError:
        return False
    return True


def _plain(node: Any) -> Any:
    """Return a syntax tree as lists and strings, without what differs between versions of Python."""
    if isinstance(node, ast.AST):
        fields = [[name, _plain(value)] for name, value in ast.iter_fields(node)
                  if name not in _IGNORED_FIELDS and value is not None and value != []]  # fmt: skip
        return [type(node).__name__, *fields]
    return [_plain(item) for item in node] if isinstance(node, list) else repr(node)
