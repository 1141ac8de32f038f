"""Strict parsers for numbers, arrays, schedules and noise in the text next to a pickle.

Each parser returns a value or raises :class:`Unreadable` with the reason, because the text is untrusted.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
from stable_baselines3.common.noise import ActionNoise, NormalActionNoise, OrnsteinUhlenbeckActionNoise
from stable_baselines3.common.utils import LinearSchedule

MAX_VALUES = 2**24
"""Maximum number of elements in an array."""

MAX_TEXT = 2**20
"""Maximum number of characters in the text of an array. NumPy's text omits the middle of large arrays."""

_NUMBER = r"[-+]?(?:\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?|inf)"
_TOKEN = re.compile(rf"\s*(?:({_NUMBER})|([\[\],])|(\.\.\.))")


class Unreadable(Exception):  # noqa: N818  # internal signal: the caller adds the field's name
    """Raised if a value cannot be determined from the text."""


def number(text: Any) -> float:
    """Return a finite number from JSON or text."""
    if isinstance(text, bool) or not isinstance(text, int | float | str) or not re.fullmatch(_NUMBER, str(text)):
        raise Unreadable(f"{_short(text)} is not a number")
    value = float(text)
    if not math.isfinite(value):
        raise Unreadable(f"{_short(text)} is not finite")
    return value


def integer(text: Any, least: int = 0, most: int = 2**53) -> int:
    """Return an integer in [least, most] from JSON or text."""
    value = number(text)
    if value != int(value) or not least <= value <= most:
        raise Unreadable(f"{_short(text)} is not an integer in [{least}, {most}]")
    return int(value)


def shape(value: Any) -> tuple[int, ...]:
    """Return the shape of an array from a JSON list."""
    if not isinstance(value, list) or len(value) > 8:
        raise Unreadable(f"{_short(value)} is not a shape")
    result = tuple(integer(item, 0, MAX_VALUES) for item in value)
    if math.prod(result) > MAX_VALUES:
        raise Unreadable(f"the shape {result} has more than {MAX_VALUES:,} values")
    return result


def array(text: Any, of_shape: tuple[int, ...] | None = None) -> np.ndarray[Any, Any]:
    """Return a float64 array from NumPy's text (``"[-1.  0.5]"``, ``"[[0 0 ... 0 0]]"``) or from a number.

    NumPy writes eight decimal places, and replaces the middle of an array with more than a thousand elements with an
    ellipsis. Text with an ellipsis is accepted only if all its numbers are equal. If ``of_shape`` is None, the array
    has one dimension.
    """
    if isinstance(text, int | float) and not isinstance(text, bool):
        text = repr(text)
    if not isinstance(text, str) or len(text) > MAX_TEXT:
        raise Unreadable(f"{_short(text)} is not an array")
    values, shortened, place = [], False, 0
    text = text.strip()
    while place < len(text):
        token = _TOKEN.match(text, place)
        if token is None:
            raise Unreadable(f"{_short(text)} is not an array of numbers")
        place = token.end()
        if token[1] is not None:
            values.append(float(token[1]))
        shortened = shortened or token[3] is not None
    if shortened and len(set(values)) > 1:
        raise Unreadable("the text omits numbers")
    if of_shape is None:
        if shortened or not values:
            raise Unreadable(f"{_short(text)} does not specify how many values the array has")
        return np.array(values)
    if len(set(values)) == 1 and (shortened or not text.startswith("[")):
        return np.full(of_shape, values[0])
    if len(values) != math.prod(of_shape):
        raise Unreadable(f"{len(values)} numbers do not match the shape {of_shape}")
    return np.array(values, np.float64).reshape(of_shape)


def schedule(value: Any) -> float | Callable[[float], float]:
    """Return a number or a linear schedule from the text next to a pickled schedule."""
    if isinstance(value, int | float):
        return number(value)
    if not isinstance(value, dict):
        raise Unreadable(f"{_short(value)} is not a schedule")
    kind = class_name(value.get(":type:"))
    if kind == "stable_baselines3.common.utils.LinearSchedule":
        return _linear(*(value.get(name) for name in ("start", "end", "end_fraction")))
    if kind == "stable_baselines3.common.utils.ConstantSchedule":
        return number(value.get("val"))
    if kind == "stable_baselines3.common.utils.FloatSchedule":
        name, arguments = call(value.get("value_schedule"))
        if name == "ConstantSchedule":
            return number(arguments.get("val"))
        if name == "LinearSchedule":
            return _linear(*(arguments.get(key) for key in ("start", "end", "end_fraction")))
    raise Unreadable("the value is a function, which the file contains only as code")


def _linear(start: Any, end: Any, fraction: Any) -> LinearSchedule:
    share = number(fraction)
    if not 0.0 < share <= 1.0:
        raise Unreadable(
            f"{share} is not a valid fraction of the training run (expected a number above 0 and at most 1)"
        )
    return LinearSchedule(number(start), number(end), share)


def action_noise(value: Any) -> ActionNoise | None:
    """Return Gaussian or Ornstein-Uhlenbeck noise from the text next to pickled noise."""
    if value is None:
        return None
    kind = class_name(value.get(":type:")) if isinstance(value, dict) else ""
    if kind == "stable_baselines3.common.noise.NormalActionNoise":
        return NormalActionNoise(array(value.get("_mu")), array(value.get("_sigma")))
    if kind == "stable_baselines3.common.noise.OrnsteinUhlenbeckActionNoise" and value.get("initial_noise") is None:
        mean, sigma = array(value.get("_mu")), array(value.get("_sigma"))
        return OrnsteinUhlenbeckActionNoise(mean, sigma, number(value.get("_theta")), number(value.get("_dt")))
    raise Unreadable("the noise has an unsupported type, and the file contains it only as code")


def class_name(text: Any) -> str:
    """Return ``module.Class`` from ``"<class 'module.Class'>"``, or ``""`` for other text."""
    match = re.fullmatch(r"<class '([^']+)'>", text) if isinstance(text, str) else None
    return match[1] if match else ""


def call(text: Any) -> tuple[str, dict[str, str]]:
    """Return the name and the keyword arguments in ``"Name(key=value, key=value)"``, with the values as text.

    For other text, return ``("", {})``.
    """
    match = re.fullmatch(r"(\w+)\(([\w=., +-]*)\)", text) if isinstance(text, str) else None
    if match is None:
        return "", {}
    pairs = (part.partition("=") for part in match[2].split(","))
    return match[1], {key.strip(): value.strip() for key, _, value in pairs}


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}…"
