"""Determines the values that constructors set by following their statements without running them."""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from frobs_rl_compat.migrate.expressions import Evaluator, UnknownValueError
from frobs_rl_compat.migrate.python_files import ROOTS, OldClass
from frobs_rl_compat.ros.robot_settings import RobotSettings

PARAMETERS = RobotSettings.names()
"""Parameters of ``RobotBasicEnv``, in order."""


@dataclass
class Constructed:
    """Values that an environment's constructor sets.

    Attributes:
        values: Known values, by names such as ``"self.action_space"``.
        unknown: Expression and its unknown part, for each name whose value is unknown.
        parameters: Known arguments of ``RobotBasicEnv``, by parameter name.
        unknown_parameters: Expression of each argument of ``RobotBasicEnv`` whose value is unknown.
    """

    values: dict[str, Any] = field(default_factory=dict)
    unknown: dict[str, tuple[str, str]] = field(default_factory=dict)
    parameters: dict[str, Any] = field(default_factory=dict)
    unknown_parameters: dict[str, str] = field(default_factory=dict)


def construct(lineage: Sequence[OldClass], ros_parameter: Callable[[str], Any]) -> Constructed:
    """Return the values that a class's constructor sets.

    Args:
        lineage: The class, followed by its base classes from the same package.
        ros_parameter: Function that returns the value of a ROS parameter, or raises KeyError.
    """
    walk = _Walk(lineage, ros_parameter)
    for old in reversed(lineage):
        walk.statements(old.tree.body)
    walk.method("__init__", 0)
    return walk.found


class _Walk:
    def __init__(self, lineage: Sequence[OldClass], ros_parameter: Callable[[str], Any]) -> None:
        self.found = Constructed()
        self._lineage = lineage
        self._evaluator = Evaluator(self.found.values, ros_parameter)
        self._open: list[str] = []
        self._at = 0

    def method(self, name: str, begin: int) -> bool:
        """Follow the statements of the first method ``name`` in ``lineage[begin:]``, and return whether it exists."""
        for place, old in enumerate(self._lineage[begin:], begin):
            if name in old.methods:
                key = f"{old.name}.{name}"
                if key in self._open:
                    return True
                self._open.append(key)
                before, self._at = self._at, place
                self.statements(old.methods[name].body)
                self._at = before
                self._open.pop()
                return True
        return False

    def statements(self, body: Sequence[ast.stmt]) -> None:
        for node in body:
            if isinstance(node, ast.Assign):
                for target in node.targets:
                    self._assign(target, node.value)
            elif isinstance(node, ast.AnnAssign) and node.value is not None:
                self._assign(node.target, node.value)
            elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
                self._call(node.value)
            elif isinstance(node, ast.If):
                self._branch(node)
            elif not isinstance(
                node, ast.Pass | ast.Import | ast.ImportFrom | ast.ClassDef | ast.FunctionDef | ast.Expr
            ):
                self._forget(node)

    def _branch(self, node: ast.If) -> None:
        try:
            holds = bool(self._evaluator.value(node.test))
        except UnknownValueError:
            self._forget(node)
        else:
            self.statements(node.body if holds else node.orelse)

    def _assign(self, target: ast.expr, value: ast.expr) -> None:
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple) and len(target.elts) == len(value.elts):
            for inner, part in zip(target.elts, value.elts, strict=True):
                self._assign(inner, part)
            return
        name = ast.unparse(target)
        try:
            self.found.values[name] = self._evaluator.value(value)
            self.found.unknown.pop(name, None)
        except UnknownValueError as error:
            self.found.values.pop(name, None)
            self.found.unknown[name] = (ast.unparse(value), str(error))

    def _forget(self, statement: ast.stmt) -> None:
        """Mark as unknown all names to which a statement may assign values."""
        for node in ast.walk(statement):
            if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
                name = ast.unparse(node)
                self.found.values.pop(name, None)
                self.found.unknown[name] = ("set in a condition or a loop", type(statement).__name__)

    def _call(self, call: ast.Call) -> None:
        function = call.func
        if not isinstance(function, ast.Attribute):
            return
        owner = ast.unparse(function.value)
        if function.attr == "__init__":
            arguments = call.args if owner.startswith("super") else call.args[1:]
            if not self.method("__init__", self._at + 1) and self._inherits_root():
                self._parameters(arguments, call.keywords)
        elif owner == "self":
            self.method(function.attr, 0)

    def _inherits_root(self) -> bool:
        return any(base in ROOTS for base in self._lineage[self._at].bases)

    def _parameters(self, arguments: Sequence[ast.expr], keywords: Sequence[ast.keyword]) -> None:
        given = dict(zip(PARAMETERS, arguments, strict=False))
        given |= {keyword.arg: keyword.value for keyword in keywords if keyword.arg}
        for name, value in given.items():
            try:
                self.found.parameters[name] = self._evaluator.value(value)
            except UnknownValueError as error:
                self.found.unknown_parameters[name] = f"{ast.unparse(value)}: {error}"
