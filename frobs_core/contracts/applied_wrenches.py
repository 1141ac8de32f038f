"""The forces and torques that act on bodies during the next step."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from frobs_core.util.arrays import Floats, Mask, rows_of

Wrench: TypeAlias = tuple[str, Floats, Floats, Mask | None]
"""Arguments of :meth:`~frobs_core.contracts.Simulation.apply_wrench`."""

_PREFIX = "applied_wrench/"


class AppliedWrenches(dict[str, Floats]):
    """The sum of the wrenches that act on each body during the next step, by body, (num_envs, 6) [N, N·m].

    A simulator can use this class to implement :meth:`~frobs_core.contracts.Simulation.apply_wrench`. ``clear()``
    removes all wrenches after a step.

    Args:
        num_envs: Number of environments.
    """

    def __init__(self, num_envs: int) -> None:
        super().__init__()
        self._num_envs = num_envs

    def add(self, body: str, force_world: Floats, torque_world: Floats, mask: Mask | None = None) -> None:
        """Add a wrench. For the arguments, see :meth:`~frobs_core.contracts.Simulation.apply_wrench`."""
        wrench = self.setdefault(body, np.zeros((self._num_envs, 6)))
        rows = rows_of(mask)
        wrench[rows, :3] += force_world
        wrench[rows, 3:] += torque_world

    def wrenches(self) -> list[Wrench]:
        """Return one wrench per body, with a mask of the environments in which the wrench is not 0."""
        found: list[Wrench] = []
        for body, wrench in self.items():
            mask = np.asarray(wrench.any(axis=1))
            found.append((body, wrench[mask, :3], wrench[mask, 3:], mask))
        return found

    def reset(self, mask: Mask | None) -> None:
        """Remove the wrenches in the environments that a mask selects."""
        for wrench in self.values():
            wrench[rows_of(mask)] = 0.0

    def snapshot(self) -> dict[str, np.ndarray[Any, Any]]:
        """Return the wrenches as a part of a simulation's snapshot."""
        return {_PREFIX + body: wrench.copy() for body, wrench in self.items()}

    def restore(self, snapshot: dict[str, np.ndarray[Any, Any]]) -> None:
        """Replace the wrenches with those in a simulation's snapshot."""
        self.clear()
        for name, wrench in snapshot.items():
            if name.startswith(_PREFIX):
                self[name.removeprefix(_PREFIX)] = wrench.copy()
