"""Type aliases for arrays, and small helpers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]
"""float64."""

Mask: TypeAlias = npt.NDArray[np.bool_]
"""(num_envs,) bool: the selected environments. If None is allowed, it selects all."""

Action: TypeAlias = npt.NDArray[Any]
"""(num_envs, …) in the batched action space."""


_Array = TypeVar("_Array", bound=np.ndarray[Any, Any])


def rows_of(mask: Mask | None) -> Mask | slice:
    """Return the index that selects the environments of a mask."""
    return slice(None) if mask is None else mask


def widened(rows: np.ndarray[Any, Any], shape: Iterable[int]) -> np.ndarray[Any, Any]:
    """Return rows (n, …) padded with zeros to (n, …shape), because engines store states of different sizes."""
    return np.pad(rows, [(0, 0), *((0, wide - here) for here, wide in zip(rows.shape[1:], shape, strict=True))])


def read_only(array: _Array) -> _Array:
    """Return a read-only view."""
    view = array.view()
    view.flags.writeable = False
    return view
