"""Parses Gymnasium spaces from the readable text next to their pickles.

The text contains the bounds of a Box with eight decimal places, which is sufficient for predictions. If a model is
opened with an environment, the environment's exact bounds are used instead.
"""

from __future__ import annotations

import re
from collections import OrderedDict
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from frobs_algos_sb3.model_files import text
from frobs_algos_sb3.model_files.text import Unreadable

MAX_DEPTH = 8
"""Maximum nesting of Dict spaces."""

_DTYPES = (
    "float16",
    "float32",
    "float64",
    "int8",
    "int16",
    "int32",
    "int64",
    "uint8",
    "uint16",
    "uint32",
    "uint64",
    "bool",
)
_DTYPE = re.compile(rf"^(?:<class 'numpy\.)?({'|'.join(_DTYPES)})(?:'>)?$")
_KEY = re.compile(r"\s*(?:'([^'\\]*)'|\"([^\"\\]*)\")\s*([:,])\s*")
_SEPARATOR = re.compile(r"\s*,\s*")


def read_space(value: Any) -> gym.Space[Any]:
    """Return the space that a pickle's readable text describes. Spaces of the old ``gym`` are supported."""
    if not isinstance(value, dict):
        raise Unreadable("it is not a space")
    module, _, kind = text.class_name(value.get(":type:")).rpartition(".")
    if module.split(".")[0] not in ("gymnasium", "gym"):
        raise Unreadable(f"{value.get(':type:')} is not a space of Gymnasium")
    if kind == "Box":
        of_shape = text.shape(value.get("_shape", value.get("shape")))
        return _box(value.get("low"), value.get("high"), of_shape, value.get("dtype"))
    if kind == "Discrete":
        return _discrete(value.get("n"), value.get("start", 0), value.get("dtype", "int64"))
    if kind == "MultiDiscrete":
        return _multi_discrete(value.get("nvec"), value.get("start"), value.get("dtype", "int64"))
    if kind == "MultiBinary":
        return _multi_binary(value.get("n"))
    if kind == "Dict" and isinstance(value.get("spaces"), str):
        written = value["spaces"].strip()
        reader = _Reader(written)
        if written.startswith("OrderedDict("):
            reader.expect("OrderedDict([")
            items = reader.items(pairs=True, depth=0)
            reader.expect("])")
        else:
            reader.expect("{")
            items = reader.items(pairs=False, depth=0)
            reader.expect("}")
        reader.end()
        return spaces.Dict(items)
    raise Unreadable(f"a space of the type {kind or value.get(':type:')} cannot be read")


class _Reader:
    """Parser for spaces written as text, such as ``Dict('a': Box(-1.0, 1.0, (3,), float32), 'b': Discrete(2))``."""

    def __init__(self, written: str) -> None:
        self._text = written
        self._place = 0

    def expect(self, literal: str) -> None:
        if not self._text.startswith(literal, self._place):
            raise Unreadable(f"'{literal}' is missing in the text of the space")
        self._place += len(literal)

    def end(self) -> None:
        """Raise Unreadable unless the end of the text is reached."""
        if self._text[self._place :].strip():
            raise Unreadable("there are unexpected characters after the text of the space")

    def items(self, pairs: bool, depth: int) -> OrderedDict[str, gym.Space[Any]]:
        """Parse keys and spaces, which have the form ``('key', space)`` if ``pairs`` is set."""
        if depth > MAX_DEPTH:
            raise Unreadable(f"the space has more than {MAX_DEPTH} levels of nesting")
        items: OrderedDict[str, gym.Space[Any]] = OrderedDict()
        while True:
            if pairs:
                self.expect("(")
            key = _KEY.match(self._text, self._place)
            if key is None or key[3] != ("," if pairs else ":"):
                raise Unreadable("a key is missing in the text of the space")
            self._place = key.end()
            name = key[1] if key[1] is not None else key[2]
            if name in items:
                raise Unreadable(f"the key '{name}' occurs twice in the text of the space")
            items[name] = self.space(depth + 1)
            if pairs:
                self.expect(")")
            separator = _SEPARATOR.match(self._text, self._place)
            if separator is None:
                return items
            self._place = separator.end()

    def space(self, depth: int) -> gym.Space[Any]:
        kind = re.compile(r"(Box|Discrete|MultiDiscrete|MultiBinary|Dict)\(").match(self._text, self._place)
        if kind is None:
            raise Unreadable("the text of the space contains an unknown type of space")
        self._place = kind.end()
        if kind[1] == "Dict":
            items = self.items(pairs=False, depth=depth)
            self.expect(")")
            return spaces.Dict(items)
        arguments = self._arguments()
        named = {key.strip(): item for key, _, item in (a.partition("=") for a in arguments if "=" in a)}
        plain = [argument for argument in arguments if "=" not in argument]
        if kind[1] == "Box" and len(plain) == 4:
            size = [int(item) for item in re.findall(r"\d{1,9}", plain[2])]
            return _box(plain[0], plain[1], text.shape(size), plain[3])
        if kind[1] == "Discrete" and len(plain) == 1:
            return _discrete(plain[0], named.get("start", 0), named.get("dtype", "int64"))
        if kind[1] == "MultiDiscrete" and len(plain) == 1:
            return _multi_discrete(plain[0], named.get("start"), "int64")
        if kind[1] == "MultiBinary" and len(plain) == 1:
            sizes = [int(item) for item in re.findall(r"\d{1,9}", plain[0])]
            return _multi_binary(sizes if "[" in plain[0] or "(" in plain[0] else sizes[0])
        raise Unreadable(f"the text of a {kind[1]} space does not have Gymnasium's format")

    def _arguments(self) -> list[str]:
        """Parse the arguments of a call up to its closing bracket."""
        depth, start, arguments = 0, self._place, []
        for place in range(self._place, len(self._text)):
            letter = self._text[place]
            if letter in "([":
                depth += 1
            elif letter in ")]" and depth > 0:
                depth -= 1
            elif letter == ")" or (letter == "," and depth == 0):
                arguments.append(self._text[start:place].strip())
                start = place + 1
                if letter == ")":
                    self._place = start
                    return arguments
        raise Unreadable("a bracket is missing in the text of the space")


def _dtype(written: Any) -> np.dtype[Any]:
    match = _DTYPE.match(written) if isinstance(written, str) else None
    if match is None:
        raise Unreadable(f"{written!r} is not a type of numbers")
    return np.dtype(match[1])


def _box(low: Any, high: Any, of_shape: tuple[int, ...], dtype: Any) -> spaces.Box:
    kind = _dtype(dtype)
    lower, upper = text.array(low, of_shape), text.array(high, of_shape)
    if kind.kind != "f":
        limits = (0, 1) if kind.kind == "b" else (np.iinfo(kind).min, np.iinfo(kind).max)
        if np.any(lower < limits[0]) or np.any(upper > limits[1]):
            raise Unreadable(f"the bounds of the space are not of the type {kind}")
    if np.any(lower > upper):
        raise Unreadable("a lower bound of the space is above the upper bound")
    return spaces.Box(lower.astype(kind), upper.astype(kind), of_shape, kind.type)


def _discrete(n: Any, start: Any, dtype: Any) -> spaces.Discrete:
    return spaces.Discrete(
        text.integer(n, 1, text.MAX_VALUES), start=text.integer(start, -(2**31)), dtype=_dtype(dtype).type
    )


def _multi_discrete(nvec: Any, start: Any, dtype: Any) -> spaces.MultiDiscrete:
    if (isinstance(nvec, str) and "\n" in nvec) or str(nvec).count("[") > 1:
        raise Unreadable("a MultiDiscrete space with several dimensions cannot be read")
    counts = [text.integer(float(value), 1, text.MAX_VALUES) for value in text.array(nvec)]
    first = None if start is None else text.array(start, (len(counts),)).astype(np.int64)
    return spaces.MultiDiscrete(counts, dtype=_dtype(dtype).type, start=first)


def _multi_binary(n: Any) -> spaces.MultiBinary:
    if isinstance(n, list):
        return spaces.MultiBinary(text.shape(n))
    return spaces.MultiBinary(text.integer(n, 1, text.MAX_VALUES))


def same_space(written: gym.Space[Any], real: gym.Space[Any]) -> bool:
    """Return whether a space read from text equals an environment's space, within the precision of the text."""
    if type(written) is not type(real) or written.shape != real.shape:
        return False
    if isinstance(written, spaces.Dict) and isinstance(real, spaces.Dict):
        return list(written.spaces) == list(real.spaces) and all(
            same_space(inner, real.spaces[key]) for key, inner in written.spaces.items()
        )
    if isinstance(written, spaces.Box) and isinstance(real, spaces.Box):
        bounds = ((written.low, real.low), (written.high, real.high))
        return written.dtype == real.dtype and all(np.allclose(a, b, rtol=1e-6, atol=1e-7) for a, b in bounds)
    return written == real
