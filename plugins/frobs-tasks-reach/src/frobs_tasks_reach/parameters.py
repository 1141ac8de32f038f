"""Checking the parameters that users give, each in one place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from frobs_core.arrays import Floats
from frobs_core.errors import ConfigurationError


def positive(name: str, value: float) -> float:
    """Return a parameter that must be a finite number above 0.

    Raises:
        ConfigurationError: It is not.
    """
    number = finite(name, value)
    if number <= 0.0:
        raise ConfigurationError(f"{name} is {value}; it must be above 0.")
    return number


def finite(name: str, value: float) -> float:
    """Return a parameter that must be a finite number.

    Raises:
        ConfigurationError: It is not.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not np.isfinite(value):
        raise ConfigurationError(f"{name} is {value!r}; it must be a finite number.")
    return float(value)


def vector3(name: str, values: Sequence[float]) -> Floats:
    """Return a parameter that must be three finite numbers, (3,) float64.

    Raises:
        ConfigurationError: It is not.
    """
    try:
        array: npt.NDArray[np.float64] = np.asarray(values, np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise ConfigurationError(f"{name} is {values!r}; it must be three finite numbers (x, y, z) in metres.")
    return array


def numbers(vector: Floats) -> str:
    """Return a vector as messages show it: ``(0.5, -0.25, 1)``."""
    return "(" + ", ".join(f"{number:.4g}" for number in vector) + ")"
