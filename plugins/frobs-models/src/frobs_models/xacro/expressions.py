"""Evaluates xacro expressions by walking their syntax tree, and never runs text from a file as Python code.

simpleeval evaluates the basic syntax. This module lists the allowed syntax and types of values, and
:mod:`frobs_models.xacro.library` the functions and methods. Everything else is rejected.
"""

from __future__ import annotations

import ast
from collections import ChainMap
from collections.abc import Callable, Iterator, Sequence
from threading import Lock
from types import NoneType
from typing import Any

from simpleeval import SimpleEval

from frobs_models.xacro.library import LENGTHS, METHODS, Function, Namespace, YamlDict, operators
from frobs_models.xacro.limits import Budget

_VALUES = frozenset(
    {int, float, complex, str, bool, NoneType, slice, list, tuple, range, dict, YamlDict, set, frozenset, Function}
)
_BUILT = (ast.List, ast.Tuple, ast.Set, ast.Dict, ast.ListComp, ast.GeneratorExp, ast.SetComp, ast.DictComp)


_CONSTRUCTING = Lock()
"""Held while ``SimpleEval`` is constructed, because it changes the filters of warnings, which all threads share."""


class Interpreter(SimpleEval):  # type: ignore[misc]  # simpleeval ships no types
    """Interpreter for the expressions of one file.

    Args:
        budget: Counter for the work.
        namespace: Type of the namespaces that ``<xacro:include ns="…">`` creates. Names in such a namespace are
            accessed as attributes.
    """

    def __init__(self, budget: Budget, namespace: type[Any]) -> None:
        with _CONSTRUCTING:
            super().__init__(operators(budget), functions={}, names={})
        self.names: ChainMap[str, Any] = ChainMap()
        self._budget, self._namespaces = budget, (Namespace, namespace)
        self._trees: dict[str, ast.expr] = {}
        inherited = (ast.Constant, ast.UnaryOp, ast.BinOp, ast.BoolOp, ast.Compare, ast.IfExp, ast.Slice)
        self.nodes: dict[type[ast.AST], Callable[[Any], Any]] = {kind: self.nodes[kind] for kind in inherited} | {
            ast.Name: self._eval_name,
            ast.Attribute: self._eval_attribute,
            ast.Subscript: self._eval_subscript,
            ast.Call: self._eval_call,
            ast.Lambda: self._eval_lambda,
            ast.List: lambda node: list(self._elements(node.elts)),
            ast.Tuple: lambda node: tuple(self._elements(node.elts)),
            ast.Set: lambda node: set(self._elements(node.elts)),
            ast.Dict: self._eval_dict,
            **dict.fromkeys((ast.ListComp, ast.GeneratorExp, ast.SetComp, ast.DictComp), self._eval_comprehension),
        }

    def evaluate(self, expression: str, names: Any) -> Any:
        """Return the value of an expression.

        Args:
            expression: Expression in Python syntax.
            names: Values by name. Looking up a missing name must raise KeyError.

        Raises:
            ModelFileError: A limit is exceeded.
            NameError: A name is not defined.
            SyntaxError: The text is not an expression.
            ValueError: The expression uses syntax or a name that is not supported.
            Exception: An operation in the expression fails, for example with TypeError or ZeroDivisionError.
        """
        text = expression.strip()
        tree = self._trees.get(text)
        if tree is None:
            self._budget.meter.check("characters of one expression", len(text))
            self._budget.spend(len(text))
            try:
                tree = ast.parse(text, mode="eval").body
            except MemoryError as error:  # raised by Python's parser if expressions are nested too deeply
                raise SyntaxError("it is nested too deeply") from error
            self._trees[text] = tree
        return self._within(ChainMap({}, names), self._eval, tree)

    def _within(self, names: ChainMap[str, Any], evaluate: Callable[[Any], Any], node: ast.expr) -> Any:
        """Return the value of a node whose names are looked up in a mapping."""
        outer, self.names = self.names, names
        try:
            return evaluate(node)
        finally:
            self.names = outer

    def _eval(self, node: ast.expr, other_types: tuple[type, ...] = ()) -> Any:
        """Return the value of a node. Objects that are not values, such as namespaces and XML blocks, are rejected."""
        if not isinstance(node, (ast.BinOp, ast.UnaryOp, ast.Compare)):  # their operators count as work
            self._budget.spend(1)
        if type(node) not in self.nodes:
            raise ValueError(f"{type(node).__name__} is not allowed in expressions")
        value = self.nodes[type(node)](node)
        if type(value) not in _VALUES and not isinstance(value, other_types):
            raise ValueError(f"a {type(value).__name__} is not a value that expressions can use")
        if type(value) is int or isinstance(node, _BUILT):
            self._budget.weigh(value)
        return value

    def _eval_name(self, node: ast.Name) -> Any:
        try:
            return self.names[node.id]
        except KeyError:
            raise NameError(f"name '{node.id}' is not defined") from None

    def _eval_attribute(self, node: ast.Attribute) -> Any:
        value, name = self._eval(node.value, self._namespaces), node.attr
        if isinstance(value, self._namespaces):
            try:
                return value[name]
            except KeyError:
                raise NameError(f"name '{name}' is not defined") from None
        if method := METHODS.get(type(value), {}).get(name):
            if name == "get":  # its work does not depend on the size of the mapping
                return Function(name, value.get, self._budget)
            return Function(name, method, self._budget, (value,), LENGTHS.get(name))
        if type(value) is not YamlDict or name.startswith("__"):
            raise ValueError(f"'{name}' is not allowed in expressions")
        if name not in value:
            raise AttributeError(f"The yaml dictionary has no key '{name}'")
        return value[name]

    def _eval_subscript(self, node: ast.Subscript) -> Any:
        value, key = self._eval(node.value), self._eval(node.slice)
        self._budget.weigh(key)
        item = value[key]
        if isinstance(key, slice):
            self._budget.weigh(item)
        return item

    def _eval_call(self, node: ast.Call) -> Any:
        function = self._eval(node.func)
        if not isinstance(function, Function):
            raise TypeError(f"{function!r} is not a function")
        keywords: dict[str, Any] = {}
        for keyword in node.keywords:
            if keyword.arg is None:
                keywords |= {str(name): value for name, value in self._unpacked(keyword.value).items()}
            else:
                keywords[keyword.arg] = self._eval(keyword.value)
        return function(*self._elements(node.args), **keywords)

    def _eval_lambda(self, node: ast.Lambda) -> Function:
        given, scope = node.args, self.names
        names = [argument.arg for argument in (*given.posonlyargs, *given.args)]
        if given.vararg or given.kwarg or given.kwonlyargs or given.defaults:
            raise ValueError("a lambda may only have positional arguments without defaults")

        def call(*args: Any, **keywords: Any) -> Any:
            values = dict(zip(names, args, strict=False)) | keywords
            if len(args) + len(keywords) != len(names) or values.keys() != set(names):
                raise TypeError(f"a lambda takes {len(names)} arguments: {', '.join(names)}")
            return self._within(scope.new_child(values), self._eval, node.body)

        return Function("lambda", call, self._budget)

    def _eval_dict(self, node: ast.Dict) -> dict[Any, Any]:
        values: dict[Any, Any] = {}
        for key, value in zip(node.keys, node.values, strict=True):
            values |= self._unpacked(value) if key is None else {self._eval(key): self._eval(value)}
        return values

    def _elements(self, nodes: Sequence[ast.expr]) -> Iterator[Any]:
        for node in nodes:
            if isinstance(node, ast.Starred):
                yield from self._unpacked(node.value)
            else:
                yield self._eval(node)

    def _unpacked(self, node: ast.expr) -> Any:
        """Return the value of a node after ``*`` or ``**``, and count each of its items as work."""
        value = self._eval(node)
        self._budget.check_items(len(value))
        return value

    def _eval_comprehension(self, node: ast.expr) -> Any:
        return self._within(self.names.new_child(), self._collected, node)

    def _collected(self, node: Any) -> Any:
        rows = self._rows(node.generators)
        if isinstance(node, ast.DictComp):
            return {self._eval(node.key): self._eval(node.value) for _ in rows}
        return (set if isinstance(node, ast.SetComp) else list)(self._eval(node.elt) for _ in rows)

    def _rows(self, generators: Sequence[ast.comprehension]) -> Iterator[None]:
        """Assign each combination of items to the names of ``for … in … if …`` in turn."""
        first, *rest = generators
        for item in self._eval(first.iter):
            self._assign(first.target, item)
            if all(self._eval(test) for test in first.ifs):
                yield from self._rows(rest) if rest else [None]

    def _assign(self, target: ast.expr, value: Any) -> None:
        if isinstance(target, ast.Name):
            self.names[target.id] = value
        elif isinstance(target, (ast.Tuple, ast.List)):
            for part, item in zip(target.elts, value, strict=True):
                self._assign(part, item)
        else:
            raise ValueError(f"'{ast.unparse(target)}' cannot be assigned in expressions")
