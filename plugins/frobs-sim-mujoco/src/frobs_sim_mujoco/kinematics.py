"""Computes poses, velocities and ray distances for a single environment, without dynamics and batch overhead."""

from __future__ import annotations

import mujoco
import numpy as np
from mujoco.batch import Batch

from frobs_core.util.arrays import Floats, read_only

_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


class Kinematics:
    """Computes poses and velocities after the state has been written or steps have been recorded.

    The results are bit-identical to those of the batch's forward pass. The forward pass is slower, because it also
    detects collisions and computes mass matrices, which tasks and sensors do not need.

    Args:
        batch: A batch with one environment.
    """

    def __init__(self, batch: Batch) -> None:
        self._batch = batch
        self._model = batch.get_model(0)
        self._data = mujoco.MjData(self._model)
        self._model_is_stale = False

    def mark_model_stale(self) -> None:
        """Mark the model's parameters as changed, so that :meth:`update` reads them again."""
        self._model_is_stale = True

    def update(self) -> None:
        """Compute poses and velocities from the batch's state."""
        if self._model_is_stale:
            self._batch.get_model(0, self._model)
            self._model_is_stale = False
        mujoco.mj_setState(self._model, self._data, self._batch.state[0], _STATE)
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        mujoco.mj_comVel(self._model, self._data)

    def field(self, name: str) -> Floats:
        """Return a view of an MjData field that :meth:`update` computes, (1, …)."""
        return read_only(getattr(self._data, name)[None])

    def rays(self, origin: Floats, directions: Floats, max_range: float, seen: np.ndarray) -> Floats:
        """Cast rays from one point, using the poses from the last :meth:`update`.

        Args:
            origin: (3,) [m] in the world frame.
            directions: (k, 3) unit vectors.
            max_range: Length of the rays [m], which is also returned for rays that hit nothing.
            seen: Mask of the geom groups that rays hit, (mjNGROUP,) uint8.

        Returns:
            Distance at which each ray hits something, (1, k) [m].
        """
        k = len(directions)
        distances, geoms, vectors = np.empty(k), np.empty(k, np.int32), directions.ravel()
        mujoco.mj_multiRay(
            self._model, self._data, origin, vectors, seen, True, -1, geoms, distances, None, k, max_range
        )
        distances[distances < 0] = max_range
        return np.minimum(distances, max_range, out=distances)[None]
