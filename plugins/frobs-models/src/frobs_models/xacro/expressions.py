"""A custom interpreter for xacro expressions, which never runs text from a file as Python code.

This module and :mod:`frobs_models.xacro.library` list all syntax, functions and methods that an expression may
use. Everything else is rejected. Values are numbers, strings, lists, mappings and functions. Expressions cannot access
or modify other Python objects.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections import ChainMap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import NoneType
from typing import Any, NoReturn

from frobs_models.xacro.limits import MAX_INTEGER, Budget


class YamlDict(dict[Any, Any]):
    """A mapping from a YAML file, whose keys can also be accessed as attributes: ``limits.elbow.lower``."""


@dataclass(frozen=True, eq=False)
class Function:
    """A function that expressions may call.

    Attributes:
        name: Name for messages.
        call: Python function that receives the interpreter and the arguments.
        kind: Python type that the function represents in ``isinstance``, or None.
    """

    name: str
    call: Callable[..., Any]
    kind: type | None = None

    def __repr__(self) -> str:
        return f"<function {self.name}>"


@dataclass(frozen=True, eq=False)
class Library:
    """A namespace of functions and constants: ``math``, ``python`` or ``xacro``.

    Attributes:
        name: Name for messages.
        members: Members, by name.
    """

    name: str
    members: Mapping[str, Any]


@dataclass(frozen=True, repr=False, eq=False)
class _Method:
    name: str
    value: Any

    def __repr__(self) -> str:
        return f"<method {self.name}>"


@dataclass(frozen=True, repr=False, eq=False)
class _Lambda:
    node: ast.Lambda
    scope: ChainMap[str, Any]

    def __repr__(self) -> str:
        return "<lambda>"


_FUNCTIONS = (Function, _Method, _Lambda)
_SEQUENCES = (str, list, tuple)
_ITERABLES = (str, list, tuple, range, dict, YamlDict, set, frozenset)
_VALUES = frozenset({int, float, complex, str, bool, NoneType, slice, *_ITERABLES})

_BINARY: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
    ast.LShift: operator.lshift,
    ast.RShift: operator.rshift,
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
    ast.BitXor: operator.xor,
}
_UNARY: Mapping[type[ast.unaryop], Callable[[Any], Any]] = {
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
    ast.Invert: operator.invert,
}
_COMPARE: Mapping[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
    ast.In: lambda value, container: value in container,
    ast.NotIn: lambda value, container: value not in container,
}
_WIDE = re.compile(r"%[^a-zA-Z%]*(\*|\d{4})")  # formats such as '%9999d' and '%*d' can create strings of any length

Scope = ChainMap[str, Any]


class Interpreter:
    """Interpreter for the expressions of one file.

    Args:
        budget: Counter for the work.
        methods: Allowed methods for each type. Each method receives the interpreter, the value and the arguments.
        namespace: Type of the namespaces that ``<xacro:include ns="…">`` creates. Names in such a namespace are
            accessed as attributes.
    """

    def __init__(
        self, budget: Budget, methods: Mapping[type, Mapping[str, Callable[..., Any]]], namespace: type[Any]
    ) -> None:
        self.budget = budget
        self._methods = methods
        self._namespace = namespace
        self._trees: dict[str, ast.expr] = {}
        self._evaluators: dict[type[ast.AST], Callable[[Any, Scope], Any]] = {
            getattr(ast, name): getattr(self, f"_{name.lower()}") for name in _SYNTAX
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
            self.budget.meter.check("characters of one expression", len(text))
            self.budget.spend(len(text))
            try:
                tree = ast.parse(text, mode="eval").body
            except MemoryError as error:  # raised by Python's parser if expressions are nested too deeply
                raise SyntaxError("it is nested too deeply") from error
            self._trees[text] = tree
        return self._eval(tree, ChainMap({}, names))

    def call(self, function: Any, args: Sequence[Any], keywords: Mapping[str, Any] | None = None) -> Any:
        """Return the result of a function call, checked against the limits."""
        keywords = keywords or {}
        for value in (*args, *keywords.values()):
            self.budget.weigh(value)
        self.budget.spend(1)
        if isinstance(function, Function):
            return self._made(function.call(self, *args, **keywords))
        if isinstance(function, _Method):
            if function.name != "get":  # which accesses only one item
                self.budget.weigh(function.value)
            method = self._methods[type(function.value)][function.name]
            return self._made(method(self, function.value, *args, **keywords))
        if isinstance(function, _Lambda):
            return self._call_lambda(function, args, keywords)
        raise TypeError(f"{function!r} is not a function")

    def items(self, value: Any) -> Iterator[Any]:
        """Yield the items of a value, and count each item as one unit of work."""
        if type(value) not in _ITERABLES:
            raise TypeError(f"{value!r} is not a list")
        for item in value:
            self.budget.spend(1)
            yield item

    def add(self, left: Any, right: Any) -> Any:
        """Return a sum, checked against the limits."""
        return self._binary(ast.Add, left, right)

    def multiply(self, left: Any, right: Any) -> Any:
        """Return a product, checked against the limits."""
        return self._binary(ast.Mult, left, right)

    def _eval(self, node: ast.expr, scope: Scope) -> Any:
        value = self._raw(node, scope)
        if isinstance(value, (Library, self._namespace)):
            raise ValueError("a namespace is not a value; use one of its members")
        return value

    def _raw(self, node: ast.expr, scope: Scope) -> Any:
        """Return the value or namespace of a node. Namespaces only support attribute access."""
        self.budget.spend(1)
        evaluator = self._evaluators.get(type(node))
        if evaluator is None:
            raise ValueError(f"{type(node).__name__} is not allowed in expressions")
        return evaluator(node, scope)

    def _made(self, value: Any) -> Any:
        """Return a new value after checking its type and size."""
        if type(value) not in _VALUES and not isinstance(value, _FUNCTIONS):
            raise ValueError(f"a {type(value).__name__} is not supported in expressions")
        self.budget.weigh(value)
        return value

    def _known(self, value: Any, name: str) -> Any:
        """Return the value of a name. Objects that are not values, such as blocks of XML, are rejected."""
        kind = type(value)
        if kind is int:
            self.budget.weigh(value)
        elif kind not in _VALUES and not isinstance(value, (*_FUNCTIONS, Library, self._namespace)):
            raise ValueError(f"'{name}' is not a value that expressions can use")
        return value

    def _constant(self, node: ast.Constant, _: Scope) -> Any:
        return self._made(node.value)

    def _name(self, node: ast.Name, scope: Scope) -> Any:
        if node.id.startswith("__"):
            _forbid(node.id)
        try:
            value = scope[node.id]
        except KeyError:
            raise NameError(f"name '{node.id}' is not defined") from None
        return self._known(value, node.id)

    def _attribute(self, node: ast.Attribute, scope: Scope) -> Any:
        value, name = self._raw(node.value, scope), node.attr
        if name.startswith("__"):
            _forbid(name)
        if isinstance(value, (Library, self._namespace)):
            try:
                member = value.members[name] if isinstance(value, Library) else value[name]
            except KeyError:
                raise NameError(f"name '{name}' is not defined") from None
            return self._known(member, name)
        if name in self._methods.get(type(value), ()):
            return _Method(name, value)
        if type(value) is YamlDict:
            if name not in value:
                raise AttributeError(f"The yaml dictionary has no key '{name}'")
            return value[name]
        return _forbid(name)

    def _subscript(self, node: ast.Subscript, scope: Scope) -> Any:
        value, key = self._eval(node.value, scope), self._eval(node.slice, scope)
        if type(value) not in _ITERABLES:
            raise TypeError(f"{value!r} has no items")
        self.budget.weigh(key)
        item = value[key]
        return self._made(item) if isinstance(key, slice) else item

    def _slice(self, node: ast.Slice, scope: Scope) -> Any:
        return slice(*(None if end is None else self._eval(end, scope) for end in (node.lower, node.upper, node.step)))

    def _call(self, node: ast.Call, scope: Scope) -> Any:
        function = self._eval(node.func, scope)
        keywords: dict[str, Any] = {}
        for keyword in node.keywords:
            value = self._eval(keyword.value, scope)
            if keyword.arg is None:
                if not isinstance(value, dict):
                    raise TypeError("** requires a mapping")
                keywords |= {str(name): value[name] for name in self.items(value)}
            else:
                keywords[keyword.arg] = value
        return self.call(function, list(self._elements(node.args, scope)), keywords)

    def _call_lambda(self, function: _Lambda, args: Sequence[Any], keywords: Mapping[str, Any]) -> Any:
        given = function.node.args
        names = [argument.arg for argument in (*given.posonlyargs, *given.args)]
        if given.vararg or given.kwarg or given.kwonlyargs or given.defaults:
            raise ValueError("a lambda may only have positional arguments without defaults")
        values = {**dict(zip(names, args, strict=False)), **keywords}
        if len(args) > len(names) or sorted(values) != sorted(names):
            raise TypeError(f"a lambda takes {len(names)} arguments: {', '.join(names)}")
        return self._eval(function.node.body, function.scope.new_child(values))

    def _lambda(self, node: ast.Lambda, scope: Scope) -> Any:
        return _Lambda(node, scope)

    def _elements(self, nodes: Sequence[ast.expr], scope: Scope) -> Iterator[Any]:
        for node in nodes:
            if isinstance(node, ast.Starred):
                yield from self.items(self._eval(node.value, scope))
            else:
                yield self._eval(node, scope)

    def _list(self, node: ast.List, scope: Scope) -> Any:
        return self._made(list(self._elements(node.elts, scope)))

    def _tuple(self, node: ast.Tuple, scope: Scope) -> Any:
        return self._made(tuple(self._elements(node.elts, scope)))

    def _set(self, node: ast.Set, scope: Scope) -> Any:
        return self._made(set(self._elements(node.elts, scope)))

    def _dict(self, node: ast.Dict, scope: Scope) -> Any:
        made: dict[Any, Any] = {}
        for key, value in zip(node.keys, node.values, strict=True):
            content = self._eval(value, scope)
            if key is None:
                made |= {item: content[item] for item in self.items(content)}
            else:
                made[self._eval(key, scope)] = content
        return self._made(made)

    def _ifexp(self, node: ast.IfExp, scope: Scope) -> Any:
        return self._eval(node.body if self._eval(node.test, scope) else node.orelse, scope)

    def _boolop(self, node: ast.BoolOp, scope: Scope) -> Any:
        value: Any = None
        for part in node.values:
            value = self._eval(part, scope)
            if bool(value) == isinstance(node.op, ast.Or):
                break
        return value

    def _compare(self, node: ast.Compare, scope: Scope) -> Any:
        left = self._eval(node.left, scope)
        result: Any = True
        for op, part in zip(node.ops, node.comparators, strict=True):
            right = self._eval(part, scope)
            self.budget.weigh(left)
            self.budget.weigh(right)
            result = _COMPARE[type(op)](left, right)
            if not result:
                break
            left = right
        return result

    def _unaryop(self, node: ast.UnaryOp, scope: Scope) -> Any:
        return self._made(_UNARY[type(node.op)](self._eval(node.operand, scope)))

    def _binop(self, node: ast.BinOp, scope: Scope) -> Any:
        return self._binary(type(node.op), self._eval(node.left, scope), self._eval(node.right, scope))

    def _binary(self, op: type[ast.operator], left: Any, right: Any) -> Any:
        if op not in _BINARY:
            _forbid(op.__name__)
        weights = self.budget.weigh(left), self.budget.weigh(right)
        if op is ast.Mult:
            for sequence, count in ((left, right), (right, left)):
                if isinstance(sequence, _SEQUENCES) and isinstance(count, int):
                    check = self.budget.check_length if isinstance(sequence, str) else self.budget.check_items
                    check(len(sequence) * max(0, count))
        elif op is ast.Mod and isinstance(left, str):
            if _WIDE.search(left):
                self.budget.refuse("a format width exceeds the limit of 999")
            self.budget.check_length(len(left) + left.count("%") * 16 * weights[1])
        elif isinstance(left, int) and isinstance(right, int) and right > 0:
            too_large = op is ast.Pow and abs(left) > 1 and right * math.log2(abs(left)) > math.log2(MAX_INTEGER)
            if too_large or (op is ast.LShift and right >= math.log2(MAX_INTEGER)):
                self.budget.refuse("an integer exceeds the limit of 2**63")
        return self._made(_BINARY[op](left, right))

    def _comprehension(self, generators: Sequence[ast.comprehension], scope: Scope) -> Iterator[Scope]:
        if not generators:
            yield scope
            return
        first, *rest = generators
        if first.is_async:
            _forbid("async")
        for item in self.items(self._eval(first.iter, scope)):
            inner = scope.new_child()
            self._bind(first.target, item, inner)
            if all(self._eval(test, inner) for test in first.ifs):
                yield from self._comprehension(rest, inner)

    def _bind(self, target: ast.expr, value: Any, scope: Scope) -> None:
        if isinstance(target, ast.Name):
            scope[target.id] = value
        elif isinstance(target, (ast.Tuple, ast.List)):
            values = list(self.items(value))
            if len(values) != len(target.elts):
                raise ValueError(f"{len(values)} values for {len(target.elts)} names")
            for part, item in zip(target.elts, values, strict=True):
                self._bind(part, item, scope)
        else:
            _forbid(type(target).__name__)

    def _listcomp(self, node: ast.ListComp | ast.GeneratorExp, scope: Scope) -> Any:
        return self._made([self._eval(node.elt, inner) for inner in self._comprehension(node.generators, scope)])

    _generatorexp = _listcomp

    def _setcomp(self, node: ast.SetComp, scope: Scope) -> Any:
        return self._made({self._eval(node.elt, inner) for inner in self._comprehension(node.generators, scope)})

    def _dictcomp(self, node: ast.DictComp, scope: Scope) -> Any:
        scopes = self._comprehension(node.generators, scope)
        return self._made({self._eval(node.key, inner): self._eval(node.value, inner) for inner in scopes})


_SYNTAX = [
    "Constant",
    "Name",
    "Attribute",
    "Subscript",
    "Slice",
    "Call",
    "Lambda",
    "List",
    "Tuple",
    "Set",
    "Dict",
    "IfExp",
    "BoolOp",
    "Compare",
    "UnaryOp",
    "BinOp",
    "ListComp",
    "GeneratorExp",
    "SetComp",
    "DictComp",
]
"""Supported kinds of syntax."""


def _forbid(name: str) -> NoReturn:
    raise ValueError(f"'{name}' is not allowed in expressions")
