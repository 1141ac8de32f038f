"""The side-effect-free functions, constants and methods that xacro's documentation allows in expressions.

``type``, ``vars``, ``hash``, ``format`` and all methods that modify a value are omitted. Functions that return
iterators in Python return lists here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import reduce
from typing import Any

from frobs_models.xacro.expressions import Function, Interpreter, Library, YamlDict

_MAX_DIGITS = 400  # maximum number of digits for round(); a float does not have more
_MAX_FACTORIAL = 20  # 20! is the largest factorial below 2**63
_MAX_CHOICE = 66  # comb(66, 33) is the largest central binomial coefficient below 2**63


def _simple(function: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a function that does not need the interpreter to count its work, which depends only on its arguments."""
    return lambda _, *args, **keywords: function(*args, **keywords)


def _list(machine: Interpreter, values: Any = ()) -> list[Any]:
    return list(machine.items(values))


def _dict(machine: Interpreter, values: Any = (), **keywords: Any) -> dict[Any, Any]:
    if isinstance(values, dict):
        return {**values, **keywords}
    pairs = [tuple(machine.items(pair)) for pair in machine.items(values)]
    return {**dict(pairs), **keywords}


def _range(machine: Interpreter, *ends: int) -> range:
    made = range(*ends)
    if made:
        machine.budget.meter.check("values of one list", len(made))
    return made


def _map(machine: Interpreter, function: Any, *lists: Any) -> list[Any]:
    return [machine.call(function, args) for args in zip(*map(machine.items, lists), strict=False)]


def _filter(machine: Interpreter, function: Any, values: Any) -> list[Any]:
    return [item for item in machine.items(values) if (item if function is None else machine.call(function, [item]))]


def _ranked(machine: Interpreter, values: Any, key: Any) -> list[tuple[Any, int, Any]]:
    """Return each item with its sort key, and charge the cost of sorting to the work budget."""
    items = list(machine.items(values))
    machine.budget.spend(machine.budget.weigh(items) * len(items).bit_length())
    keys = items if key is None else [machine.call(key, [item]) for item in items]
    machine.budget.weigh(keys)
    return [(ranked, i, item) for i, (ranked, item) in enumerate(zip(keys, items, strict=True))]


def _sorted(machine: Interpreter, values: Any, *, key: Any = None, reverse: bool = False) -> list[Any]:
    return [row[2] for row in sorted(_ranked(machine, values, key), key=lambda row: row[0], reverse=bool(reverse))]


def _extreme(choose: Callable[..., Any]) -> Callable[..., Any]:
    def extreme(machine: Interpreter, *args: Any, key: Any = None) -> Any:
        ranked = _ranked(machine, args[0] if len(args) == 1 else list(args), key)
        return choose(ranked, key=lambda row: row[0])[2]

    return extreme


def _sum(machine: Interpreter, values: Any, start: Any = 0) -> Any:
    if isinstance(start, str):
        raise TypeError("sum does not support strings; use ''.join")
    return reduce(machine.add, machine.items(values), start)


def _prod(machine: Interpreter, values: Any, *, start: Any = 1) -> Any:
    return reduce(machine.multiply, machine.items(values), start)


def _round(_: Interpreter, number: Any, digits: int | None = None) -> Any:
    if digits is not None and abs(digits) > _MAX_DIGITS:
        raise ValueError(f"round supports at most {_MAX_DIGITS} digits")
    return round(number, digits)


def _isinstance(_: Interpreter, value: Any, kinds: Any) -> bool:
    return any(isinstance(value, kind.kind) for kind in (kinds if isinstance(kinds, tuple) else (kinds,)))


def _issubclass(_: Interpreter, kind: Any, kinds: Any) -> bool:
    return any(issubclass(kind.kind, other.kind) for other in (kinds if isinstance(kinds, tuple) else (kinds,)))


def _limited(function: Callable[..., int], limit: int) -> Callable[..., Any]:
    def limited(_: Interpreter, *args: int) -> int:
        if args[0] > limit:
            raise ValueError(f"{function.__name__} supports at most {limit}")
        return function(*args)

    return limited


def _lcm(machine: Interpreter, *numbers: int) -> Any:
    made = 1
    for number in numbers:
        made = machine.multiply(made, abs(number) // math.gcd(made, number)) if number else 0
    return made


def _join(machine: Interpreter, text: str, values: Any) -> str:
    words = list(machine.items(values))
    machine.budget.check_length(sum(len(text) + len(word) for word in words))
    return text.join(words)


def _replace(machine: Interpreter, text: str, old: str, new: str, count: int = -1) -> str:
    machine.budget.check_length(len(text) + text.count(old) * len(new))
    return text.replace(old, new, count)


def _padded(name: str) -> Callable[..., Any]:
    def padded(machine: Interpreter, text: str, width: int, *fill: str) -> Any:
        machine.budget.check_length(width)
        return getattr(text, name)(width, *fill)

    return padded


def _dotify(machine: Interpreter, values: Any) -> YamlDict:
    return YamlDict(_dict(machine, values))


def _functions(table: Mapping[str, Callable[..., Any]], kinds: Iterable[type] = ()) -> dict[str, Function]:
    by_name = {kind.__name__: kind for kind in kinds}
    return {name: Function(name, call, by_name.get(name)) for name, call in table.items()}


_TYPES = (list, dict, str, float, int, bool, complex, set, frozenset, tuple, range)

PYTHON: Mapping[str, Any] = {
    "True": True,
    "False": False,
    **_functions(
        {
            **{kind.__name__: _simple(kind) for kind in (str, float, int, bool, complex)},
            "list": _list,
            "tuple": lambda machine, values=(): tuple(_list(machine, values)),
            "set": lambda machine, values=(): set(_list(machine, values)),
            "frozenset": lambda machine, values=(): frozenset(_list(machine, values)),
            "dict": _dict,
            "range": _range,
            "map": _map,
            "filter": _filter,
            "sorted": _sorted,
            "min": _extreme(min),
            "max": _extreme(max),
            "sum": _sum,
            "round": _round,
            "len": _simple(len),
            "abs": _simple(abs),
            "all": lambda machine, values: all(machine.items(values)),
            "any": lambda machine, values: any(machine.items(values)),
            "divmod": _simple(divmod),
            "ord": _simple(ord),
            "repr": _simple(repr),
            "slice": _simple(slice),
            "enumerate": lambda machine, values, start=0: list(enumerate(machine.items(values), start)),
            "reversed": lambda machine, values: _list(machine, values)[::-1],
            "zip": lambda machine, *lists: list(zip(*map(machine.items, lists), strict=False)),
            "isinstance": _isinstance,
            "issubclass": _issubclass,
        },
        _TYPES,
    ),
}
"""The namespace ``python``."""

_COUNTING: Mapping[str, Callable[..., Any]] = {
    "factorial": _limited(math.factorial, _MAX_FACTORIAL),
    "comb": _limited(math.comb, _MAX_CHOICE),
    "perm": _limited(math.perm, _MAX_FACTORIAL),
    "prod": _prod,
    "lcm": _lcm,
}
MATH: Mapping[str, Any] = {
    name: value if isinstance(value, float) else Function(name, _COUNTING.get(name, _simple(value)))
    for name, value in vars(math).items()
    if not name.startswith("_")
}
"""The namespace ``math``."""

XACRO: Mapping[str, Any] = _functions(
    {"dotify": _dotify, "tokenize": lambda machine, text, sep=",; ", skip_empty=True: _tokenize(text, sep, skip_empty)}
)
"""The part of the namespace ``xacro`` that does not depend on the file."""

_BARE = ("list", "dict", "map", "len", "str", "float", "int", "bool", "True", "False", "min", "max", "round")
_BARE_TOO = ("sorted", "range")  # deprecated by xacro


def global_names(xacro: Mapping[str, Any]) -> dict[str, Any]:
    """Return a new table of the names that are predefined in expressions ``${…}``.

    Args:
        xacro: The namespace ``xacro``.
    """
    return {
        **{name: PYTHON[name] for name in (*_BARE, *_BARE_TOO)},
        "python": Library("python", PYTHON),
        **MATH,
        "math": Library("math", MATH),
        **{name: xacro[name] for name in ("load_yaml", "abs_filename", "dotify")},
        "xacro": Library("xacro", xacro),
    }


def eval_names() -> dict[str, Any]:
    """Return a new table of the names predefined in ``$(eval …)``, without ``arg``, ``find`` and similar functions."""
    names = ("list", "dict", "map", "str", "float", "int", "bool", "len", "min", "max", "round", "abs")
    return {**MATH, **{name: PYTHON[name] for name in names}, "true": True, "false": False}


def _tokenize(text: str, separators: str, skip_empty: bool) -> list[str]:
    for other in separators[1:]:
        text = text.replace(other, separators[0])
    words = text.split(separators[0])
    return [word for word in words if word or not skip_empty]


def _methods(kind: type, names: str) -> dict[str, Callable[..., Any]]:
    return {name: _simple(getattr(kind, name)) for name in names.split()}


_OF_TEXT: Mapping[str, Callable[..., Any]] = {
    **_methods(
        str,
        "capitalize casefold count endswith find index isalnum isalpha isdecimal isdigit isidentifier islower isnumeric "
        "isspace istitle isupper lower lstrip partition removeprefix removesuffix rfind rindex rpartition rsplit rstrip "
        "split splitlines startswith strip swapcase title upper",
    ),
    "join": _join,
    "replace": _replace,
    **{name: _padded(name) for name in ("zfill", "ljust", "rjust", "center")},
}
_OF_DICT: Mapping[str, Callable[..., Any]] = {
    "get": lambda _, values, key, default=None: values.get(key, default),
    "keys": lambda _, values: list(values),
    "values": lambda _, values: list(values.values()),
    "items": lambda _, values: list(values.items()),
    "copy": lambda _, values: type(values)(values),
}
_OF_SET = "union intersection difference symmetric_difference issubset issuperset isdisjoint"

METHODS: Mapping[type, Mapping[str, Callable[..., Any]]] = {
    str: _OF_TEXT,
    list: _methods(list, "count index copy"),
    tuple: _methods(tuple, "count index"),
    dict: _OF_DICT,
    YamlDict: _OF_DICT,
    set: _methods(set, _OF_SET),
    frozenset: _methods(frozenset, _OF_SET),
    float: _methods(float, "is_integer"),
}
"""Methods of each type."""
