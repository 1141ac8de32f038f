"""Checking the parameters that users give, each in one place."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.errors import ConfigurationError


def finite(name: str, value: Any) -> float:
    """Return a parameter that must be a finite number.

    Raises:
        ConfigurationError: It is not.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not np.isfinite(value):
        raise ConfigurationError(f"{name} is {value!r}; it must be a finite number.")
    return float(value)


def positive(name: str, value: Any) -> float:
    """Return a parameter that must be a finite number above 0.

    Raises:
        ConfigurationError: It is not.
    """
    if finite(name, value) <= 0.0:
        raise ConfigurationError(f"{name} is {value}; it must be above 0.")
    return float(value)


def non_negative(name: str, value: Any) -> float:
    """Return a parameter that must be a finite number, 0 or above.

    Raises:
        ConfigurationError: It is not.
    """
    if finite(name, value) < 0.0:
        raise ConfigurationError(f"{name} is {value}; it must not be below 0.")
    return float(value)


def whole_number(name: str, value: Any, lowest: int = 0) -> int:
    """Return a parameter that must be a whole number of at least ``lowest``.

    Raises:
        ConfigurationError: It is not.
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < lowest:
        raise ConfigurationError(f"{name} is {value!r}; it must be a whole number of at least {lowest}.")
    return int(value)


def choice(name: str, value: Any, choices: Iterable[str]) -> str:
    """Return a parameter that must be one of some names.

    Raises:
        ConfigurationError: It is not.
    """
    known = list(choices)
    if value not in known:
        raise ConfigurationError(f"{name} is {value!r}; it must be one of {', '.join(map(repr, known))}.")
    return str(value)


def boolean(name: str, value: Any) -> bool:
    """Return a parameter that must be true or false.

    Raises:
        ConfigurationError: It is not.
    """
    if not isinstance(value, bool | np.bool_):
        raise ConfigurationError(f"{name} is {value!r}; it must be true or false.")
    return bool(value)


def number_list(name: str, value: Any, count: int | None = None) -> tuple[float, ...]:
    """Return a parameter that must be a list of finite numbers.

    Args:
        name: For the message.
        value: What was given.
        count: How many there must be; None: at least one.

    Raises:
        ConfigurationError: It is not.
    """
    given = list(value) if isinstance(value, Iterable) and not isinstance(value, str | bytes | dict) else []
    if not given or count not in (None, len(given)):
        wanted = "a list of numbers" if count is None else f"{count} numbers"
        raise ConfigurationError(f"{name} is {value!r}; it must be {wanted}.")
    return tuple(finite(f"{name}[{i}]", number) for i, number in enumerate(given))


def box(low_name: str, low: Any, high_name: str, high: Any) -> tuple[Floats, Floats]:
    """Return the corners of a box, (3,) [m] each.

    Raises:
        ConfigurationError: One is not three finite numbers, or the first is not below the second.
    """
    lowest, highest = np.array(number_list(low_name, low, 3)), np.array(number_list(high_name, high, 3))
    if not (lowest < highest).all():
        raise ConfigurationError(
            f"{low_name} {numbers(lowest)} must be below {high_name} {numbers(highest)} on every axis."
        )
    return lowest, highest


def numbers(vector: Floats) -> str:
    """Return a vector as messages show it: ``(0.5, -0.25, 1)``."""
    return "(" + ", ".join(f"{number:.4g}" for number in vector) + ")"
