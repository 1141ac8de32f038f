"""Objects that store state between steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

Snapshot: TypeAlias = dict[str, np.ndarray[Any, Any]]
"""Complete state: arrays of shape (num_envs, …), by name."""


class Stateful:
    """Base class of objects that store state between steps. By default, they store nothing."""

    def stored_arrays(self) -> Snapshot:
        """Return the arrays that :meth:`snapshot` copies and :meth:`restore` overwrites, (num_envs, …), by name."""
        return {}

    def stored_parts(self) -> Mapping[str, Any]:
        """Return further objects with a state. The names of their arrays in a snapshot begin with ``"name/"``."""
        return {}

    def snapshot(self) -> Snapshot:
        """Return a copy of the state, which for a task or a controller excludes the simulation's state."""
        own = {name: array.copy() for name, array in self.stored_arrays().items()}
        parts = self.stored_parts().items()
        return own | {f"{name}/{key}": array for name, part in parts for key, array in part.snapshot().items()}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot. Entries that belong to other objects are ignored."""
        for name, array in self.stored_arrays().items():
            array[...] = snapshot[name]
        for name, part in self.stored_parts().items():
            start = f"{name}/"
            part.restore({key.removeprefix(start): array for key, array in snapshot.items() if key.startswith(start)})
