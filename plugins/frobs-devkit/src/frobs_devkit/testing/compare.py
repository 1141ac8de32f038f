"""Comparing observations and states bit for bit, with a message that says where they differ."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from typing import Any

import numpy as np

from frobs_devkit.testing.checks import CheckFailure


def leaves(value: Any, path: str = "") -> dict[str, np.ndarray[Any, Any]]:
    """Return the arrays of a nested observation or state by their path; ``""`` where it is an array itself."""
    if isinstance(value, Mapping):
        items = [(f"{path}[{key!r}]", item) for key, item in value.items()]
    elif isinstance(value, tuple | list) and not all(isinstance(item, int | float) for item in value):
        items = [(f"{path}[{i}]", item) for i, item in enumerate(value)]
    else:
        return {path: np.asarray(value)}
    return {name: leaf for key, item in items for name, leaf in leaves(item, key).items()}


def row(value: Any, i: int) -> Any:
    """Return environment ``i`` of a batched observation, as a copy of its own."""
    if isinstance(value, Mapping):
        return {key: row(item, i) for key, item in value.items()}
    if isinstance(value, tuple):
        return tuple(row(item, i) for item in value)
    return deepcopy(value[i])


def difference(expected: Any, actual: Any) -> str | None:
    """Return where and how ``actual`` differs from ``expected`` by a bit, a dtype or a shape; None if it does not."""
    wanted, found = leaves(expected), leaves(actual)
    if wanted.keys() != found.keys():
        return f"the parts are {sorted(found)} instead of {sorted(wanted)}"
    for path, a in wanted.items():
        b = found[path]
        if a.dtype != b.dtype or a.shape != b.shape:
            return f"{path or 'it'} is {b.dtype}{list(b.shape)} instead of {a.dtype}{list(a.shape)}"
        if a.tobytes() != b.tobytes():
            return _where(path, a, b)
    return None


def expect_same(expected: Any, actual: Any, what: str) -> None:
    """Raise CheckFailure unless both are equal bit for bit.

    Args:
        expected: An array, or a nested dictionary or tuple of them.
        actual: What should equal it.
        what: How the message begins: what should equal what.
    """
    text = difference(expected, actual)
    if text:
        raise CheckFailure(f"{what}: {text}.")


def expect_close(expected: Any, actual: Any, tolerance: float, what: str) -> None:
    """Raise CheckFailure unless two arrays are within ``tolerance`` of each other everywhere."""
    a, b = np.asarray(expected, np.float64), np.asarray(actual, np.float64)
    if a.shape != b.shape:
        raise CheckFailure(f"{what}: the shape is {b.shape} instead of {a.shape}.")
    error = np.abs(a - b)
    if not np.all(error <= tolerance):  # also where it is NaN
        index = np.unravel_index(int(np.nanargmax(np.where(np.isnan(error), np.inf, error))), error.shape)
        place = f" at {list(map(int, index))}" if index else ""
        raise CheckFailure(
            f"{what}: {b[index]:.10g} instead of {a[index]:.10g}{place}, off by {error[index]:.3g}; "
            f"allowed is {tolerance:.3g}."
        )


def _where(path: str, a: np.ndarray[Any, Any], b: np.ndarray[Any, Any]) -> str:
    if a.dtype == object or a.ndim == 0:
        return f"{path or 'it'} is {b!r} instead of {a!r}"
    differs = np.argwhere(~((a == b) | ((a != a) & (b != b))))
    if not len(differs):
        return f"{path or 'it'} differs in the sign of a zero or the bits of a NaN"
    index = tuple(differs[0])
    return (
        f"{path or 'it'}{list(map(int, index))} is {b[index]!r} instead of {a[index]!r}, "
        f"and {len(differs)} of {a.size} elements differ"
    )
