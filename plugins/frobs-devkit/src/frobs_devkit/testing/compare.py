"""Bitwise comparison of observations and states, with messages that describe the differences."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import quat_multiply, quat_rotate
from frobs_devkit.testing.checks import CheckFailure


def leaves(value: Any, path: str = "") -> dict[str, np.ndarray[Any, Any]]:
    """Return the arrays of a nested observation or state as a dictionary with their paths as keys.

    The path of an array that is not nested is ``""``.
    """
    if isinstance(value, Mapping):
        items = [(f"{path}[{key!r}]", item) for key, item in value.items()]
    elif isinstance(value, tuple | list) and not all(isinstance(item, int | float) for item in value):
        items = [(f"{path}[{i}]", item) for i, item in enumerate(value)]
    else:
        return {path: np.asarray(value)}
    return {name: leaf for key, item in items for name, leaf in leaves(item, key).items()}


def row(value: Any, i: int) -> Any:
    """Return a copy of the part of a batched observation that belongs to environment ``i``."""
    if isinstance(value, Mapping):
        return {key: row(item, i) for key, item in value.items()}
    if isinstance(value, tuple):
        return tuple(row(item, i) for item in value)
    return deepcopy(value[i])


def batch_of_one(observation: Any) -> Any:
    """Add a batch axis of size 1 to the observation of one environment."""
    if isinstance(observation, Mapping):
        return {key: batch_of_one(item) for key, item in observation.items()}
    return np.asarray(observation)[None]


def difference(expected: Any, actual: Any) -> str | None:
    """Return how ``actual`` differs from ``expected`` in bits, dtype or shape, or None if they are identical."""
    expected_leaves, actual_leaves = leaves(expected), leaves(actual)
    if expected_leaves.keys() != actual_leaves.keys():
        return f"the parts are {sorted(actual_leaves)} instead of {sorted(expected_leaves)}"
    for path, a in expected_leaves.items():
        b = actual_leaves[path]
        if a.dtype != b.dtype or a.shape != b.shape:
            return f"{path or 'the value'} is {b.dtype}{list(b.shape)} instead of {a.dtype}{list(a.shape)}"
        if a.tobytes() != b.tobytes():
            return _where(path, a, b)
    return None


def expect_same(expected: Any, actual: Any, what: str) -> None:
    """Raise CheckFailure unless ``expected`` and ``actual`` are bit-identical."""
    text = difference(expected, actual)
    if text:
        raise CheckFailure(f"{what}: {text}.")


def expect_array(array: Any, shape: tuple[int, ...], dtype: Any, what: str) -> None:
    """Raise CheckFailure unless the value is an array of the given shape and dtype."""
    if not isinstance(array, np.ndarray):
        raise CheckFailure(f"{what} is {type(array).__name__}, not an array.")
    actual, expected = f"{array.dtype}{list(array.shape)}", f"{np.dtype(dtype)}{list(shape)}"
    if actual != expected:
        raise CheckFailure(f"{what} is {actual}, not {expected}.")


def expect_rows(arrays: Mapping[str, Any], num_envs: int, what: str) -> None:
    """Raise CheckFailure unless each array in a snapshot has one row of numbers for each environment."""
    for name, array in leaves(arrays).items():
        if array.shape[:1] != (num_envs,) or array.dtype.kind == "O":
            actual = f"{array.dtype}{list(array.shape)}"
            raise CheckFailure(f"{what}{name} is {actual}; expected an array of numbers with shape (num_envs, …).")


def expect_close(expected: Any, actual: Any, tolerance: float, what: str) -> None:
    """Raise CheckFailure unless two arrays differ by at most ``tolerance`` everywhere."""
    a, b = np.asarray(expected, np.float64), np.asarray(actual, np.float64)
    if a.shape != b.shape:
        raise CheckFailure(f"{what}: the shape is {b.shape} instead of {a.shape}.")
    error = np.abs(a - b)
    if not np.all(error <= tolerance):  # also fails for NaN
        index = np.unravel_index(int(np.nanargmax(np.where(np.isnan(error), np.inf, error))), error.shape)
        place = f" at {list(map(int, index))}" if index else ""
        raise CheckFailure(
            f"{what}: expected {a[index]:.10g}, got {b[index]:.10g}{place}; the difference of {error[index]:.3g} "
            f"exceeds the tolerance of {tolerance:.3g}."
        )


def placed(base: tuple[Any, Any], pose: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Transform poses from a base's frame to the frame in which the base's pose is expressed.

    Poses consist of positions (n, 3) [m] and quaternions (n, 4).
    """
    return base[0] + quat_rotate(base[1], pose[0]), quat_multiply(base[1], pose[1])


def expect_same_pose(
    expected: tuple[Floats, Floats], actual: tuple[Floats, Floats], tolerance: float, what: str
) -> None:
    """Raise CheckFailure unless positions (n, 3) [m] and quaternions (n, 4) agree within ``tolerance``.

    The quaternions q and −q represent the same rotation.
    """
    expect_close(expected[0], actual[0], tolerance, f"{what}: the position [m]")
    sign = np.where((expected[1] * actual[1]).sum(-1, keepdims=True) < 0, -1.0, 1.0)
    expect_close(expected[1], sign * actual[1], tolerance, f"{what}: quat_wxyz")


def _where(path: str, a: np.ndarray[Any, Any], b: np.ndarray[Any, Any]) -> str:
    if a.dtype == object or a.ndim == 0:
        return f"{path or 'the value'} is {b!r} instead of {a!r}"
    differs = np.argwhere(~((a == b) | ((a != a) & (b != b))))
    if not len(differs):
        return f"{path or 'the value'} differs in the sign of a zero or the bits of a NaN"
    index = tuple(differs[0])
    return (
        f"{path or 'the value'}{list(map(int, index))} is {b[index]!r} instead of {a[index]!r}, "
        f"and {len(differs)} of {a.size} elements differ"
    )
