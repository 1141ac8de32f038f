"""Recognizes FRobs_RL's example tasks by the structure of their methods.

The file ``known_tasks.yaml`` contains only fingerprints of the original code. A fingerprint ignores comments,
docstrings, log messages, visualization markers, and the literals that :mod:`frobs_rl_compat.migrate.examples` reads.
Therefore, a package whose numbers were changed is still recognized, but a package whose code was changed is not.
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

from frobs_core.util.yaml import load_yaml
from frobs_rl_compat.migrate.package import OldPackage
from frobs_rl_compat.migrate.python_files import OldClass

KNOWN_TASKS = Path(__file__).with_name("known_tasks.yaml")

_SETTINGS = ("__init__", "get_params")
"""Methods that assign numbers to variables. These numbers are looked up by variable name."""

_NAMED = ("get_param", "has_param", "ros_load_yaml_from_pkg", "urdf_parse_from_pkg")
"""Functions whose arguments specify a parameter or a file to read."""

_POSES = ("gazebo_spawn_sdf_string", "gazebo_set_model_state")
"""Functions whose arguments contain model poses, which are read separately."""

_SILENT = ("rospy.log", "rospy.sleep", "print")
"""Prefixes of calls that have no effect on the task."""

_IGNORED_FIELDS = ("ctx", "kind", "type_comment", "type_params", "returns", "annotation")


@dataclass(frozen=True)
class Recognition:
    """The example task that is most similar to a package's task.

    Attributes:
        name: Key of the example task in ``known_tasks.yaml``, such as ``"maze"``.
        differing: Methods that differ from the example task, with their locations. Empty if no method differs.
    """

    name: str
    differing: list[str]


def recognize(package: OldPackage) -> Recognition | None:
    """Return the most similar example task, or None if more than half of the methods differ in every example."""
    known = load_yaml(KNOWN_TASKS)
    candidates = []
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
        candidates.append(Recognition(name, differing))
    return min(candidates, key=lambda each: len(each.differing), default=None)


def fingerprint(method: ast.FunctionDef) -> str:
    """Return 16 hexadecimal digits that identify a method's structure, independently of the Python version."""
    bare = _Structure(method.name).visit(copy.deepcopy(method))
    return hashlib.sha256(json.dumps(_plain(bare), allow_nan=False).encode()).hexdigest()[:16]


def factors(method: ast.FunctionDef) -> list[float]:
    """Return the literal numbers in a method's sums, differences and products, in source order."""
    sides = [side for node in ast.walk(method) if isinstance(node, ast.BinOp) and isinstance(node.op, _ARITHMETIC)
             for side in (node.left, node.right) if _is_number(side)]  # fmt: skip
    return [side.value for side in sorted(sides, key=lambda side: (side.lineno, side.col_offset))]  # type: ignore[attr-defined]


def _differing(old: OldClass, known: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the methods that are new, changed or missing compared with the example task."""
    changed = [
        old.place(name) for name, method in old.methods.items() if fingerprint(method) not in known.get(name, ())
    ]
    return changed + [f"{old.name}.{name}, which is missing" for name in known if name not in old.methods]


_ARITHMETIC = (ast.Add, ast.Sub, ast.Mult)


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool)


class _Structure(ast.NodeTransformer):
    """AST transformer that removes code that has no effect on the task, and literals that are read separately.

    Args:
        method: Name of the method.
    """

    def __init__(self, method: str) -> None:
        self._settings = method in _SETTINGS
        self._reward = method == "_get_reward"
        self._numbers_are_read = self._settings

    def visit_Expr(self, node: ast.Expr) -> ast.AST | None:
        """Remove docstrings, log messages, and calls that publish visualization markers."""
        text = ast.unparse(node.value)
        is_silent = isinstance(node.value, ast.Call) and (text.startswith(_SILENT) or ".pub_marker." in text)
        return None if is_silent or isinstance(node.value, ast.Constant) else self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> ast.AST | None:
        """Remove visualization markers, and the literals that a constructor assigns to local variables."""
        if "_marker" in ast.unparse(node.targets[0]):
            return None
        if self._settings and isinstance(node.targets[0], ast.Name) and _is_literal(node.value):
            node.value = _blank()
            return node
        return self.generic_visit(node)

    def visit_If(self, node: ast.If) -> ast.AST | None:
        """Remove ``if`` statements whose branches have become empty."""
        self.generic_visit(node)
        return node if node.body or node.orelse else None

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Remove the arguments of ``super`` and of functions that read parameters or files, and numbers in poses."""
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
        """Replace the literal numbers in a reward's arithmetic operations with placeholders."""
        self.generic_visit(node)
        if self._reward and isinstance(node.op, _ARITHMETIC):
            node.left, node.right = (_blank() if _is_number(side) else side for side in (node.left, node.right))
        return node

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        """If a number is read separately, replace the number with a placeholder."""
        return _blank() if self._numbers_are_read and _is_number(node) else node

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        """Remove the sign in front of a placeholder."""
        self.generic_visit(node)
        return node.operand if _is_blank(node.operand) else node

    def visit_List(self, node: ast.List) -> ast.AST:
        """Replace a list of placeholders with a single placeholder, regardless of the list's length."""
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
    """Convert a syntax tree to nested lists and strings, omitting the fields that differ between Python versions."""
    if isinstance(node, ast.AST):
        fields = [[name, _plain(value)] for name, value in ast.iter_fields(node)
                  if name not in _IGNORED_FIELDS and value is not None and value != []]  # fmt: skip
        return [type(node).__name__, *fields]
    return [_plain(item) for item in node] if isinstance(node, list) else repr(node)
