"""Looks up the values that the task of a recognized package uses."""

from __future__ import annotations

from typing import Any

import numpy as np

from frobs_rl_compat.migrate.package import OldPackage


class UntranslatableError(Exception):
    """A value in a recognized package is unknown, or FRobs's equivalent task does not support the value."""


def value_of(package: OldPackage, name: str) -> Any:
    """Return the value that the constructor assigns to a name.

    Raises:
        UntranslatableError: The value is unknown.
    """
    values = package.constructed.values
    if name not in values:
        expression, missing = package.constructed.unknown.get(name, ("it is not assigned", ""))
        raise UntranslatableError(f"{name} is unknown: {missing or expression}")
    return values[name]


def bounds_of(package: OldPackage, name: str) -> tuple[list[float], list[float]]:
    """Return the bounds of a ``Box`` that the constructor assigns to a name, without float32 rounding errors.

    Raises:
        UntranslatableError: The bounds are unknown.
    """
    space = value_of(package, name)
    low, high = ([round(float(value), 6) for value in bound] for bound in (space.low, space.high))
    return low, high


def check_any_heading(low: float, high: float) -> None:
    """Check that headings between two angles [rad] cover the full circle.

    Raises:
        UntranslatableError: The headings do not cover the full circle.
    """
    if abs(low + np.pi) > 1e-3 or abs(high - np.pi) > 1e-3:
        raise UntranslatableError(
            f"episodes begin with headings between {low:g} and {high:g} rad; only −π to π is supported"
        )
