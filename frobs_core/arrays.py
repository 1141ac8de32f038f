"""Names for the arrays that cross the interfaces, and a read-only view of one."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]
"""float64."""

Mask: TypeAlias = npt.NDArray[np.bool_]
"""(num_envs,) bool: which environments are meant. Where None is allowed it means all."""

Action: TypeAlias = npt.NDArray[Any]
"""(num_envs, …) in the batched action space."""


_Array = TypeVar("_Array", bound=np.ndarray[Any, Any])


def rows_of(mask: Mask | None) -> Mask | slice:
    """Return what indexes the environments of a mask."""
    return slice(None) if mask is None else mask


def widened(rows: np.ndarray[Any, Any], shape: Iterable[int]) -> np.ndarray[Any, Any]:
    """Return rows (n, …) with zeros at the end, (n, …shape): engines write states into different numbers of bytes."""
    return np.pad(rows, [(0, 0), *((0, wide - here) for here, wide in zip(rows.shape[1:], shape, strict=True))])


def read_only(array: _Array) -> _Array:
    """Return a view that cannot be written to."""
    view = array.view()
    view.flags.writeable = False
    return view
