"""Evaluates Python expressions from their syntax, without importing or executing the package's code."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
import numpy as np

_MOST = 4096
"""Maximum number of elements in a list or an array, which is sufficient for the spaces of any robot."""

_CONSTANTS = {"np.pi": math.pi, "numpy.pi": math.pi, "math.pi": math.pi, "np.inf": np.inf, "numpy.inf": np.inf,
              "math.inf": math.inf}  # fmt: skip
_DTYPES = {f"{module}.{name}": name for module in ("np", "numpy")
           for name in ("float32", "float64", "int32", "int64", "int8", "uint8")}  # fmt: skip

_OPERATORS: Mapping[type, Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow, ast.USub: operator.neg,
    ast.UAdd: operator.pos, ast.Not: operator.not_,
}  # fmt: skip


class UnknownValueError(Exception):
    """The value of an expression is unknown. The error message contains the part of the expression that is unknown."""


def _small(shape: Any) -> Any:
    if int(np.prod(shape)) > _MOST:
        raise UnknownValueError(f"an array of the shape {shape}")
    return shape


_FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    **dict.fromkeys(("array", "asarray"), lambda value, dtype=None: np.asarray(value, dtype)),
    "zeros": lambda shape, dtype=float: np.zeros(_small(shape), dtype),
    "ones": lambda shape, dtype=float: np.ones(_small(shape), dtype),
    "full": lambda shape, value, dtype=None: np.full(_small(shape), value, dtype),
    "concatenate": lambda parts, axis=0: np.concatenate([np.atleast_1d(part) for part in parts], axis),
    "hstack": np.hstack,
    "append": np.append,
    "deg2rad": np.deg2rad,
    "radians": np.deg2rad,
    "sqrt": np.sqrt,
    "linspace": lambda start, stop, num=50: np.linspace(start, stop, _small(num)),
    **{function.__name__: function for function in (float, int, bool, str, list, tuple, dict, len, abs, max, min)},
}
_MODULES = ("np", "numpy", "math", "")


def _box(low: Any, high: Any, shape: Any = None, dtype: Any = np.float32) -> gymnasium.spaces.Box:
    return gymnasium.spaces.Box(np.asarray(low, dtype)[()], np.asarray(high, dtype)[()], shape, dtype)


_SPACES: Mapping[str, Callable[..., Any]] = {"Box": _box, "Discrete": gymnasium.spaces.Discrete,
           "MultiDiscrete": gymnasium.spaces.MultiDiscrete, "MultiBinary": gymnasium.spaces.MultiBinary}  # fmt: skip


class Evaluator:
    """Determines the values of expressions.

    Args:
        names: Values by names such as ``"LENGTH"`` or ``"self.max_joint_values"``. Callers may add values later.
        parameters: Function that returns the value of a ROS parameter by name, or raises KeyError.
    """

    def __init__(self, names: dict[str, Any], parameters: Callable[[str], Any]) -> None:
        self.names = names
        self._parameters = parameters

    def value(self, node: ast.expr) -> Any:
        """Return the value of an expression.

        Raises:
            UnknownValueError: The value is unknown.
        """
        try:
            return self._value(node)
        except UnknownValueError:
            raise
        except (ArithmeticError, LookupError, TypeError, ValueError, AttributeError, AssertionError) as error:
            raise UnknownValueError(f"{ast.unparse(node)} ({type(error).__name__}: {error})") from error

    def _value(self, node: ast.expr) -> Any:
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            raise UnknownValueError(ast.unparse(node))
        return method(node)

    def _constant(self, node: ast.Constant) -> Any:
        return node.value

    def _name(self, node: ast.Name) -> Any:
        if node.id not in self.names:
            raise UnknownValueError(node.id)
        return self.names[node.id]

    def _attribute(self, node: ast.Attribute) -> Any:
        text = ast.unparse(node)
        for known in (self.names, _CONSTANTS, _DTYPES):
            if text in known:
                return known[text]
        raise UnknownValueError(text)

    def _list(self, node: ast.List) -> Any:
        return [self._value(item) for item in node.elts]

    def _tuple(self, node: ast.Tuple) -> Any:
        return tuple(self._value(item) for item in node.elts)

    def _dict(self, node: ast.Dict) -> Any:
        return {self._value(key): self._value(value) for key, value in zip(node.keys, node.values, strict=True) if key}

    def _unaryop(self, node: ast.UnaryOp) -> Any:
        return _OPERATORS[type(node.op)](self._value(node.operand))

    def _binop(self, node: ast.BinOp) -> Any:
        left, right = self._value(node.left), self._value(node.right)
        huge = isinstance(node.op, ast.Pow) and (np.max(np.abs(right)) > 64 or np.max(np.abs(left)) > 1e6)
        repeated = isinstance(node.op, ast.Mult) and any(isinstance(part, str | list | tuple) for part in (left, right))
        if repeated:
            sequence, times = (left, right) if isinstance(right, int) else (right, left)
            huge = len(sequence) * times > _MOST
        if huge:
            raise UnknownValueError(ast.unparse(node))
        return _OPERATORS[type(node.op)](left, right)

    def _subscript(self, node: ast.Subscript) -> Any:
        return self._value(node.value)[self._value(node.slice)]

    def _slice(self, node: ast.Slice) -> slice:
        return slice(*(None if part is None else self._value(part) for part in (node.lower, node.upper, node.step)))

    def _call(self, node: ast.Call) -> Any:
        name = ast.unparse(node.func)
        arguments = [self._value(argument) for argument in node.args]
        keywords = {keyword.arg: self._value(keyword.value) for keyword in node.keywords if keyword.arg}
        module, _, function = name.rpartition(".")
        if name in ("rospy.get_param", "get_param"):
            return self._parameter(node, *arguments)
        if function in _SPACES:
            return _SPACES[function](*arguments, **keywords)
        if module in _MODULES and function in _FUNCTIONS:
            return _FUNCTIONS[function](*arguments, **keywords)
        raise UnknownValueError(ast.unparse(node))

    def _parameter(self, node: ast.Call, name: str, *default: Any) -> Any:
        try:
            return self._parameters(name)
        except KeyError:
            if default:
                return default[0]
            raise UnknownValueError(f"the parameter {name}") from None
