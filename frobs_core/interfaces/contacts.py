"""State of the contacts that a scene declares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from frobs_core.arrays import Floats, Mask, rows_of
from frobs_core.interfaces.scene import Scene


class ContactState:
    """State of a scene's declared contacts in the last control step, in the order of ``scene.contacts``.

    A simulator that supports contacts stores one as :attr:`Simulation.contacts` and updates its arrays in each
    ``step``.

    Args:
        scene: Scene that declares the contacts.
        num_envs: ≥ 1.
        arrays: Arrays to use, named as in :meth:`fields`, or None to allocate new ones.

    Attributes:
        scene: Scene that declares the contacts.
        closed: (num_envs, contacts) bool, whether a contact was closed in any physics step.
        normal_force: (num_envs, contacts) [N] largest normal force.
        resultant: (num_envs, contacts, 3) [N] total force on the first side, in the world, averaged over the physics
            steps.
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
        """Return each array's shape for one environment and its dtype, by its name in a snapshot."""
        count = len(scene.contacts)
        return {"contact": ((count,), "?"), "contact_force": ((count,), "f8"), "contact_resultant": ((count, 3), "f8")}

    def clear(self, mask: Mask | None = None) -> None:
        """Open all contacts in some environments."""
        for array in self._arrays.values():
            array[rows_of(mask)] = 0

    def reduce(self, closed: Mask, normal_force: Floats, resultant: Floats) -> None:
        """Update the contacts from all physics steps of a control step.

        Args:
            closed: (num_envs, decimation, contacts)
            normal_force: (num_envs, decimation, contacts) [N]
            resultant: (num_envs, decimation, contacts, 3) [N]
        """
        self.closed[:] = closed.any(axis=1)
        self.normal_force[:] = normal_force.max(axis=1)
        np.divide(resultant.sum(axis=1), resultant.shape[1], out=self.resultant)

    def merge(self, steps: Sequence[Mapping[str, np.ndarray[Any, Any]]]) -> None:
        """Update a control step's contacts from the snapshots of its physics steps."""
        self.reduce(*(np.stack([step[name] for step in steps], axis=1) for name in self._arrays))

    def snapshot(self) -> dict[str, np.ndarray[Any, Any]]:
        """Return copies of the arrays."""
        return {name: array.copy() for name, array in self._arrays.items()}

    def restore(self, snapshot: Mapping[str, np.ndarray[Any, Any]]) -> None:
        """Restore a snapshot. Arrays that it does not contain are set to zero."""
        for name, array in self._arrays.items():
            array[:] = snapshot.get(name, 0)
