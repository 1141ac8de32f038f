"""Grid that represents the reachable parts of a box."""

from __future__ import annotations

import itertools

import numpy as np

from frobs_core.util.arrays import Floats, Mask
from frobs_tasks_reach.sampling import in_box

_CELL = 0.05  # [m] edge length of a cell; enough joint vectors are sampled to cover cells of this size
_MAX_CELLS = 40  # maximum number of cells along an axis, which limits the computing time for a large box


class Workspace:
    """Grid cells of a box that contain at least one of many reachable tool positions.

    Args:
        low: Minimum corner of the box, (3,) [m].
        high: Maximum corner of the box, (3,) [m].
        reached: Reachable tool positions, (k, 3) [m].
    """

    def __init__(self, low: Floats, high: Floats, reached: Floats) -> None:
        counts = np.clip(np.ceil((high - low) / _CELL - 1e-9), 1, _MAX_CELLS).astype(int)
        self._low, self._high = low, high
        self._cell: Floats = (high - low) / counts
        self._cells = np.zeros(counts, bool)
        self._cells[self._index(reached[in_box(reached, low, high)])] = True
        self._fill_holes()

    def shrink(self, margin: float) -> None:
        """Keep only cells from which all motions of up to ``margin`` [m] along each axis stay in reachable cells."""
        steps = np.ceil(margin / self._cell - 1e-9).astype(int)
        padded = np.pad(self._cells, [(s, s) for s in steps])  # cells outside the box are unreachable
        shape = self._cells.shape
        for shift in itertools.product(*(range(2 * s + 1) for s in steps)):
            self._cells &= padded[tuple(slice(s, s + n) for s, n in zip(shift, shape, strict=True))]

    @property
    def is_empty(self) -> bool:
        """Whether no cells remain."""
        return not self._cells.any()

    def contains(self, positions: Floats) -> Mask:
        """Return whether positions (..., 3) [m] are in the remaining cells, (...) bool."""
        inside = in_box(positions, self._low, self._high)
        inside[inside] = self._cells[self._index(positions[inside])]
        return inside

    def _fill_holes(self) -> None:
        """Mark cells with at least 5 reachable neighbors as reachable, because sampling can miss reachable cells."""
        padded = np.pad(self._cells, 1).astype(int)
        x, y, z = self._cells.shape
        faces = [(0, 1, 1), (2, 1, 1), (1, 0, 1), (1, 2, 1), (1, 1, 0), (1, 1, 2)]
        self._cells |= sum(padded[i : i + x, j : j + y, k : k + z] for i, j, k in faces) >= 5

    def _index(self, positions: Floats) -> tuple[np.ndarray, ...]:
        index = ((positions - self._low) / self._cell).astype(int)
        return tuple(np.minimum(index, np.array(self._cells.shape) - 1).T)
