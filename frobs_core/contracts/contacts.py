"""State of the contacts that a scene declares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from frobs_core.contracts.stateful import Snapshot, Stateful
from frobs_core.description.scene import Scene
from frobs_core.util.arrays import Floats, Mask, rows_of


class ContactState(Stateful):
    """State of a scene's declared contacts during the last control step, in the order of ``scene.contacts``.

    A simulator that supports contacts stores an instance of this class as :attr:`Simulation.contacts` and updates its
    arrays at each ``step``.

    Args:
        scene: Scene that declares the contacts.
        num_envs: ≥ 1.
        arrays: Arrays to use, with the names returned by :meth:`fields`, or None to allocate new arrays.

    Attributes:
        scene: Scene that declares the contacts.
        closed: Whether each contact was closed in any physics step, (num_envs, contacts) bool.
        normal_force: Largest normal force of each contact, (num_envs, contacts) [N].
        resultant: Total force on the first side of each contact, in the world frame and averaged over the physics
            steps, (num_envs, contacts, 3) [N].
    """

    def __init__(self, scene: Scene, num_envs: int, arrays: Mapping[str, np.ndarray[Any, Any]] | None = None) -> None:
        self.scene = scene
        fields = self.fields(scene)
        if arrays is None:
            arrays = {name: np.zeros((num_envs, *shape), dtype) for name, (shape, dtype) in fields.items()}
        self._arrays = {name: arrays[name] for name in fields}
        self.closed: Mask = self._arrays["contact"]
        self.normal_force: Floats = self._arrays["contact_force"]
        self.resultant: Floats = self._arrays["contact_resultant"]

    @staticmethod
    def fields(scene: Scene) -> dict[str, tuple[tuple[int, ...], str]]:
        """Return the shape (for one environment) and the dtype of each array, by the array's name in a snapshot."""
        count = len(scene.contacts)
        return {"contact": ((count,), "?"), "contact_force": ((count,), "f8"), "contact_resultant": ((count, 3), "f8")}

    def clear(self, mask: Mask | None = None) -> None:
        """Mark all contacts as open, with zero force, in the environments selected by ``mask``."""
        for array in self._arrays.values():
            array[rows_of(mask)] = 0

    def reduce(self, closed: Mask, normal_force: Floats, resultant: Floats) -> None:
        """Compute a control step's contact state from the contacts in its physics steps.

        Args:
            closed: (num_envs, decimation, contacts)
            normal_force: (num_envs, decimation, contacts) [N]
            resultant: (num_envs, decimation, contacts, 3) [N]
        """
        self.closed[:] = closed.any(axis=1)
        self.normal_force[:] = normal_force.max(axis=1)
        np.divide(resultant.sum(axis=1), resultant.shape[1], out=self.resultant)

    def merge(self, steps: Sequence[Mapping[str, np.ndarray[Any, Any]]]) -> None:
        """Compute a control step's contact state from snapshots of its physics steps."""
        self.reduce(*(np.stack([step[name] for step in steps], axis=1) for name in self._arrays))

    def stored_arrays(self) -> Snapshot:
        return self._arrays

    def restore(self, snapshot: Mapping[str, np.ndarray[Any, Any]]) -> None:
        """Restore a snapshot. Arrays that the snapshot does not contain are set to zero."""
        for name, array in self._arrays.items():
            array[:] = snapshot.get(name, 0)
