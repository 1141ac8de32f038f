"""The side-effect-free functions, constants, methods and operators that xacro's documentation allows in expressions.

``type``, ``vars``, ``hash``, ``format`` and all methods that modify a value are omitted. Functions that return
iterators in Python return lists here.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Iterator, Mapping, MappingView
from dataclasses import dataclass
from functools import reduce
from typing import Any

from simpleeval import DEFAULT_OPERATORS

from frobs_models.xacro.limits import Budget

_MAX_DIGITS = 400  # maximum number of digits for round(); a float does not have more
_MAX_FACTORIAL = 20  # 20! is the largest factorial below 2**63
_MAX_CHOICE = 66  # comb(66, 33) is the largest central binomial coefficient below 2**63

_WIDE = re.compile(r"%(\([^()]*\))?[^a-zA-Z%]*(\*|\d{4})|%\([^()]*\(")
"""Formats such as ``%9999d``, ``%*d`` and ``%(key)9999d``, which can create text of any length."""

_KINDS = (list, dict, str, float, int, bool, complex, set, frozenset, tuple, range)
_ITERATIONS = (map, filter, sorted, min, max, all, any, enumerate, reversed, zip)
_OTHERS = (len, abs, divmod, ord, repr, slice)
_LAZY: Any = (Iterator, MappingView)
_BARE = ("list", "dict", "map", "len", "str", "float", "int", "bool", "min", "max", "round")


class YamlDict(dict[Any, Any]):
    """A mapping from a YAML file, whose keys can also be accessed as attributes: ``limits.elbow.lower``."""


class Namespace(dict[str, Any]):
    """Functions and constants that are accessed as attributes: ``math``, ``python`` or ``xacro``."""


@dataclass(frozen=True, eq=False, repr=False)
class Function:
    """A function that expressions may call.

    Each call counts as work, and so do the sizes of the arguments and of the result. Iterators and views become lists.

    Attributes:
        name: Name for messages.
        call: The Python function.
        budget: Counter for the work.
        bound: First arguments, such as the value whose method this is.
        length: Function that estimates the work of a method from its arguments, as the length of a text, or None if the
            work is proportional to the sizes of the arguments.
    """

    name: str
    call: Callable[..., Any]
    budget: Budget
    bound: tuple[Any, ...] = ()
    length: Callable[..., int] | None = None

    def __repr__(self) -> str:
        return f"<function {self.name}>"

    def __call__(self, *args: Any, **keywords: Any) -> Any:
        """Return the result, checked against the limits."""
        args = (*self.bound, *args)
        for value in (*args, *keywords.values()):
            self.budget.weigh(value)
        self.budget.spend(1)
        if self.length is not None:
            self.budget.check_length(self.length(*args, **keywords))
        result = self.call(*args, **keywords)
        if isinstance(result, _LAZY):
            result = list(result)
        self.budget.weigh(result)
        return result


def operators(budget: Budget) -> dict[type[ast.AST], Function]:
    """Return the operators by their syntax. Those that can create large values check the size first."""

    def multiply(left: Any, right: Any) -> Any:
        for sequence, count in ((left, right), (right, left)):
            if isinstance(sequence, (str, list, tuple)) and isinstance(count, int):
                check = budget.check_length if isinstance(sequence, str) else budget.check_items
                check(len(sequence) * max(0, count))
        return left * right

    def modulo(left: Any, right: Any) -> Any:
        if isinstance(left, str):
            if _WIDE.search(left):
                budget.refuse("a format width exceeds the limit of 999")
            budget.check_length(len(left) + left.count("%") * 16 * budget.weigh(right))
        return left % right

    def power(base: Any, exponent: Any) -> Any:
        if isinstance(base, int) and isinstance(exponent, int) and abs(base) > 1:
            exponent = min(exponent, 64)  # results of 2**64 and more are rejected
        return base**exponent

    def shift(value: int, count: int) -> int:
        return value << min(count, 64)

    guarded = {ast.Add: operator.add, ast.Mult: multiply, ast.Mod: modulo, ast.Pow: power, ast.LShift: shift}
    return {kind: Function(kind.__name__, call, budget) for kind, call in (DEFAULT_OPERATORS | guarded).items()}


def global_names(budget: Budget, xacro: Mapping[str, Callable[..., Any]]) -> dict[str, Any]:
    """Return a new table of the names that are predefined in expressions ``${…}``."""
    python, mathematics = _python(budget), _mathematics(budget)
    of_xacro = Namespace(_functions(budget, {"dotify": YamlDict, "tokenize": _tokenize, **xacro}))
    return {
        **{name: python[name] for name in (*_BARE, "True", "False", "sorted", "range")},
        "python": python,
        **mathematics,
        "math": mathematics,
        **{name: of_xacro[name] for name in ("load_yaml", "abs_filename", "dotify")},
        "xacro": of_xacro,
    }


def eval_names(budget: Budget, functions: Mapping[str, Callable[..., Any]]) -> dict[str, Any]:
    """Return a new table of the names that are predefined in ``$(eval …)``."""
    python = _python(budget)
    names = {name: python[name] for name in (*_BARE, "abs")}
    return {**_mathematics(budget), **names, "true": True, "false": False, **_functions(budget, functions)}


def _functions(budget: Budget, table: Mapping[str, Callable[..., Any]]) -> dict[str, Any]:
    return {name: Function(name, call, budget) for name, call in table.items()}


def _python(budget: Budget) -> Namespace:
    add = operators(budget)[ast.Add]
    native = {function.__name__: function for function in (*_KINDS, *_ITERATIONS, *_OTHERS)}
    special: dict[str, Callable[..., Any]] = {
        "sum": lambda values, start=0: reduce(add, values, start),
        "round": _round,
        "isinstance": lambda value, kinds: isinstance(value, _kinds(kinds)),
        "issubclass": lambda kind, kinds: issubclass(kind.call, _kinds(kinds)),
    }
    return Namespace({"True": True, "False": False, **_functions(budget, native | special)})


def _mathematics(budget: Budget) -> Namespace:
    multiply = operators(budget)[ast.Mult]
    special: dict[str, Callable[..., Any]] = {
        "factorial": _limited(math.factorial, _MAX_FACTORIAL),
        "comb": _limited(math.comb, _MAX_CHOICE),
        "perm": _limited(math.perm, _MAX_FACTORIAL),
        "prod": lambda values, *, start=1: reduce(multiply, values, start),
        "lcm": lambda *numbers: reduce(lambda a, b: multiply(a, abs(b) // (math.gcd(a, b) or 1)), numbers, 1),
    }
    members = {name: member for name, member in vars(math).items() if not name.startswith("_")} | special
    return Namespace(
        {name: Function(name, member, budget) if callable(member) else member for name, member in members.items()}
    )


def _kinds(kinds: Any) -> Any:
    """Return the Python types of the functions ``int``, ``str`` and similar, as ``isinstance`` accepts them."""
    return tuple(map(_kinds, kinds)) if isinstance(kinds, tuple) else kinds.call


def _round(number: Any, digits: int | None = None) -> Any:
    if digits is not None and abs(digits) > _MAX_DIGITS:
        raise ValueError(f"round supports at most {_MAX_DIGITS} digits")
    return round(number, digits)


def _limited(function: Callable[..., int], limit: int) -> Callable[..., int]:
    def limited(*args: int) -> int:
        if args[0] > limit:
            raise ValueError(f"{function.__name__} supports at most {limit}")
        return function(*args)

    return limited


def _tokenize(text: str, sep: str = ",; ", skip_empty: bool = True) -> list[str]:
    words = text.translate({ord(other): sep[0] for other in sep}).split(sep[0])
    return [word for word in words if word or not skip_empty]


def _methods(kind: type, names: str) -> dict[str, Callable[..., Any]]:
    return {name: getattr(kind, name) for name in names.split()}


_OF_MAPPINGS = _methods(dict, "get keys values items")
_OF_SETS = "union intersection difference symmetric_difference issubset issuperset isdisjoint"

METHODS: Mapping[type, Mapping[str, Callable[..., Any]]] = {
    str: _methods(
        str,
        "capitalize casefold center count endswith find index isalnum isalpha isdecimal isdigit isidentifier islower "
        "isnumeric isspace istitle isupper join ljust lower lstrip partition removeprefix removesuffix replace rfind "
        "rindex rjust rpartition rsplit rstrip split splitlines startswith strip swapcase title upper zfill",
    ),
    list: _methods(list, "count index copy"),
    tuple: _methods(tuple, "count index"),
    dict: {**_OF_MAPPINGS, "copy": dict},
    YamlDict: {**_OF_MAPPINGS, "copy": YamlDict},
    set: _methods(set, _OF_SETS),
    frozenset: _methods(frozenset, _OF_SETS),
    float: _methods(float, "is_integer"),
}
"""Methods of each type."""


def _product(text: str, part: str | None = None, *_: Any) -> int:
    return len(text) * len(part or "")


LENGTHS: Mapping[str, Callable[..., int]] = {
    "join": lambda text, words: sum(len(text) + len(word) for word in words),
    "replace": lambda text, old, new, count=-1: len(text) + text.count(old) * len(new),
    **dict.fromkeys(("zfill", "ljust", "rjust", "center"), lambda text, width, fill=" ": width),
    **dict.fromkeys(("lstrip", "rstrip", "strip", "rfind", "rindex", "rpartition", "rsplit"), _product),
}
"""Functions that estimate the work of a method from the text and its arguments, as the length of a text."""
