"""The spaces of a bundle: equivalents of Gymnasium's spaces, without Gymnasium."""

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
"""Maximum number of values in an element of a space; larger ones would only fill the memory."""


@dataclass(frozen=True)
class Space:
    """A space whose elements are arrays; infinite bounds are ±inf."""

    type: str  # ``"Box"``, ``"Discrete"``, ``"MultiDiscrete"`` or ``"MultiBinary"``
    shape: tuple[int, ...]  # ``()`` for a Discrete
    dtype: np.dtype[Any]
    low: Array
    high: Array

    @property
    def discrete(self) -> bool:
        """Whether its elements are discrete choices."""
        return self.type != "Box"

    def middle(self) -> Array:
        """Return an element in the middle of the bounds."""
        low, high = np.maximum(self.low, -1.0), np.minimum(self.high, 1.0)
        return np.clip(0.5 * (low + high), self.low, self.high).astype(self.dtype)

    def complaint(self, value: Array) -> str | None:
        """Return what is wrong with a batch of elements, (n, …); None if it is valid.

        A Box value outside the bounds is valid, because sensors can exceed them.
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
    """Return an argument as an array, float64.

    Raises:
        PolicyArgumentError: The argument does not consist of numbers.
    """
    try:
        return np.asarray(value, np.float64)
    except (TypeError, ValueError, OverflowError):
        raise PolicyArgumentError(f"{name}={value!r:.80}: it must contain only numbers.") from None


def space_to_json(type: str, shape: tuple[int, ...], dtype: np.dtype[Any], low: Array, high: Array) -> dict[str, Any]:
    """Return a space as JSON: a uniform bound is one number, an infinite bound null."""
    return {"type": type, "shape": list(shape), "dtype": dtype.name, "low": _bound(low), "high": _bound(high)}


def space_from_json(data: Mapping[str, Any]) -> Space:
    """Return the space that :func:`space_to_json` wrote; a KeyError, TypeError or ValueError means damage."""
    shape, dtype = tuple(int(size) for size in data["shape"]), np.dtype(str(data["dtype"]))
    if data["type"] not in (*_SHAPED, "Discrete") or dtype.kind not in "fiub" or any(size < 0 for size in shape):
        raise ValueError(f"{data['type']} {shape} {dtype} is not a space")
    if math.prod(shape) > MAX_SIZE:
        raise ValueError(f"a space of shape {shape} has more than {MAX_SIZE:,} numbers")
    low, high = (_array(data[name], shape, default) for name, default in (("low", -math.inf), ("high", math.inf)))
    return Space(data["type"], shape, dtype, low, high)


def _bound(values: Array) -> Any:
    flat = [value if math.isfinite(value) else None for value in np.asarray(values, float).ravel().tolist()]
    return flat[0] if len(set(flat)) == 1 else flat


def _array(values: Any, shape: tuple[int, ...], default: float) -> Array:
    flat = [default if value is None else float(value) for value in (values if isinstance(values, list) else [values])]
    array = np.array(flat, np.float64)
    # A single value for all bounds of a large image takes no memory.
    filled = np.broadcast_to(array[0], shape) if len(array) == 1 else array.reshape(shape)
    filled.setflags(write=False)
    return filled


def _range(values: Array, pick: Any) -> str:
    return f"{pick(values.ravel().tolist()):g}"
