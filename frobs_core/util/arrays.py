"""Type aliases and small helper functions for arrays."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]
"""float64."""

Mask: TypeAlias = npt.NDArray[np.bool_]
"""Boolean mask of the selected environments, (num_envs,). Functions that also accept None treat None as a mask of all
environments.
"""

Action: TypeAlias = npt.NDArray[Any]
"""Actions in the batched action space, (num_envs, …)."""


_Array = TypeVar("_Array", bound=np.ndarray[Any, Any])


def rows_of(mask: Mask | None) -> Mask | slice:
    """Return an array index for the environments selected by ``mask``, or for all environments if ``mask`` is None."""
    return slice(None) if mask is None else mask


def widened(rows: np.ndarray[Any, Any], shape: Iterable[int]) -> np.ndarray[Any, Any]:
    """Zero-pad ``rows`` with the shape (n, …) to ``(n, *shape)``.

    Padding is needed because two snapshots of the same engine may contain states of different sizes.
    """
    return np.pad(rows, [(0, 0), *((0, wide - here) for here, wide in zip(rows.shape[1:], shape, strict=True))])


def read_only(array: _Array) -> _Array:
    """Return a read-only view of an array of any shape."""
    view = array.view()
    view.flags.writeable = False
    return view
