"""Represents a bundle's spaces without depending on Gymnasium."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from frobs_deploy.errors import PolicyArgumentError

Array = np.ndarray[Any, Any]

_SHAPED = ("Box", "MultiDiscrete", "MultiBinary")

MAX_SIZE = 2**24
"""Maximum number of values in an element of a space, so that a damaged bundle cannot exhaust memory."""


@dataclass(frozen=True)
class Space:
    """A space whose elements are arrays. Unbounded values have the bounds ±inf."""

    type: str  # ``"Box"``, ``"Discrete"``, ``"MultiDiscrete"`` or ``"MultiBinary"``
    shape: tuple[int, ...]  # ``()`` for a Discrete
    dtype: np.dtype[Any]
    low: Array
    high: Array

    @property
    def discrete(self) -> bool:
        """Whether the elements of the space are discrete choices."""
        return self.type != "Box"

    def middle(self) -> Array:
        """Return an element in the middle of the bounds."""
        low, high = np.maximum(self.low, -1.0), np.minimum(self.high, 1.0)
        return np.clip(0.5 * (low + high), self.low, self.high).astype(self.dtype)

    def complaint(self, value: Array) -> str | None:
        """Return the reason why a batch of elements, (n, …), is invalid, or None if the batch is valid.

        Values outside the bounds of a Box are valid, because sensor readings can exceed the bounds.
        """
        if value.shape[1:] != self.shape or value.ndim != len(self.shape) + 1:
            return f"has shape {value.shape[1:] if value.ndim else ()}, not {self.shape}"
        if value.dtype != self.dtype:
            return f"has the type {value.dtype}, not {self.dtype}; convert it with astype(np.{self.dtype})"
        if value.dtype.kind == "f" and not np.isfinite(value).all():
            where = np.argwhere(~np.isfinite(value))[0].tolist()
            return f"is not finite at {where[1:] or where}: {value[tuple(where)]}"
        if self.discrete and not ((value >= self.low) & (value <= self.high)).all():
            return f"is outside [{_range(self.low, min)}, {_range(self.high, max)}]"
        return None


def as_floats(name: str, value: Any) -> Array:
    """Convert an argument to a float64 array.

    Raises:
        PolicyArgumentError: The argument contains values that are not numbers.
    """
    try:
        return np.asarray(value, np.float64)
    except (TypeError, ValueError, OverflowError):
        raise PolicyArgumentError(f"{name} is {value!r:.80}; it must contain only numbers.") from None


def space_to_json(type: str, shape: tuple[int, ...], dtype: np.dtype[Any], low: Array, high: Array) -> dict[str, Any]:
    """Convert a space to JSON. A bound is stored as one number if it is uniform, and as null if it is infinite.

    Args:
        type: Class of the space, such as ``"Box"``.
        shape: Shape of the space.
        dtype: dtype of the space.
        low: Lower bounds, of that shape.
        high: Upper bounds, of that shape.
    """
    return {"type": type, "shape": list(shape), "dtype": dtype.name, "low": _bound(low), "high": _bound(high)}


def space_from_json(data: Mapping[str, Any]) -> Space:
    """Restore a space from the output of :func:`space_to_json`.

    Raises:
        KeyError: An entry is missing.
        TypeError: A value has the wrong type.
        ValueError: A value is invalid.
    """
    shape, dtype = tuple(int(size) for size in data["shape"]), np.dtype(str(data["dtype"]))
    if data["type"] not in (*_SHAPED, "Discrete") or dtype.kind not in "fiub" or any(size < 0 for size in shape):
        raise ValueError(f"{data['type']} {shape} {dtype} is not a space")
    if math.prod(shape) > MAX_SIZE:
        raise ValueError(f"a space of shape {shape} has more than {MAX_SIZE:,} numbers")
    low, high = (_array(data[name], shape, default) for name, default in (("low", -math.inf), ("high", math.inf)))
    if not (low <= high).all():  # also false for NaN
        raise ValueError(f"a bound of the space {data['type']} {shape} is not a number, or low exceeds high")
    return Space(data["type"], shape, dtype, low, high)


def _bound(values: Array) -> Any:
    flat = [value if math.isfinite(value) else None for value in np.asarray(values, float).ravel().tolist()]
    return flat[0] if len(set(flat)) == 1 else flat


def _array(values: Any, shape: tuple[int, ...], default: float) -> Array:
    flat = [default if value is None else float(value) for value in (values if isinstance(values, list) else [values])]
    array = np.array(flat, np.float64)
    # If all bounds are equal, a broadcast view of one value saves memory for large images.
    filled = np.broadcast_to(array[0], shape) if len(array) == 1 else array.reshape(shape)
    filled.setflags(write=False)
    return filled


def _range(values: Array, pick: Any) -> str:
    return f"{pick(values.ravel().tolist()):g}"
