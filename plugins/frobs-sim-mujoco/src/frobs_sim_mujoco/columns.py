"""Indexing of MuJoCo's state arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats, Mask


def numbers_of(mask: Mask | None) -> slice | np.ndarray:
    """Return the indices of the environments that a mask selects, or a full slice if the mask is None."""
    return slice(None) if mask is None else np.flatnonzero(mask)


def columns_of(addresses: Sequence[int]) -> Any:
    """Return a slice if the addresses are consecutive, so that indexing returns a view; otherwise, return an array."""
    first = int(addresses[0]) if addresses else 0
    if [int(address) for address in addresses] == list(range(first, first + len(addresses))):
        return slice(first, first + len(addresses))
    return np.array(addresses)


def put(state: Floats, rows: slice | np.ndarray, columns: slice | np.ndarray, values: Floats | float) -> None:
    """Write values with shape (rows, columns, …) to a state array."""
    if isinstance(rows, slice) or isinstance(columns, slice):
        state[rows, columns] = values
    else:
        state[rows[:, None], columns] = values
