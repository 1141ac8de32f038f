"""Parameters that change only images, for simulators whose renderer does not store them per environment."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from frobs_core.contracts import Snapshot
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.errors import PhysicsParameterError, check_name


class WrittenLooks(ABC):
    """Base class that stores the looks of each environment. The renderer applies them when it draws.

    Args:
        num_envs: ≥ 1.

    Attributes:
        names: Names of the supported parameters.
        limits: Minimum and maximum of parameters, by name. Colors beyond them are clipped.
        values: Values that differ from the scene, (num_envs, …) each, by (parameter, target).
        sky: Target of the parameter ``color`` for the background.
    """

    sky: ClassVar[str] = "sky"

    names: ClassVar[Sequence[str]] = ("color", "light", "camera_position", "camera_rotation", "camera_fov")
    limits: ClassVar[Mapping[str, tuple[float, float]]] = {
        "color": (0.0, 1.0),
        "light": (0.0, np.inf),
        "camera_fov": (1.0, 170.0),
    }

    def __init__(self, num_envs: int) -> None:
        self._num_envs = num_envs
        self.values: dict[tuple[str, str], Floats] = {}

    @abstractmethod
    def targets(self, name: str) -> Sequence[str]:
        """Return the targets of the parameter ``name``."""

    @abstractmethod
    def nominal(self, name: str, target: str) -> Any:
        """Return the value of the parameter ``name`` of ``target`` in the scene."""

    def read(self, name: str, target: str) -> Floats:
        """Return the values of the parameter ``name`` of ``target``, (num_envs, …).

        Raises:
            UnknownNameError: The parameter has no such target.
        """
        check_name(f"target of the parameter '{name}'", target, self.targets(name))
        current = self.values.get((name, target))
        if current is not None:
            return current.copy()
        nominal = np.asarray(self.nominal(name, target), np.float64)
        return np.broadcast_to(nominal, (self._num_envs, *nominal.shape)).copy()

    def write(self, name: str, target: str, values: Floats, mask: Mask | None) -> None:
        """Change a parameter in the environments selected by ``mask``.

        Args:
            name: Name of the parameter.
            target: Target of the parameter.
            values: New values, which broadcast to those of the n selected environments, (n, …).
            mask: Mask of the environments, (num_envs,) bool, or None for all.

        Raises:
            PhysicsParameterError: A value is not finite, or out of range.
            UnknownNameError: The parameter has no such target.
        """
        if not np.isfinite(values).all():
            raise PhysicsParameterError(name, target, "must be finite.")
        low, high = self.limits.get(name, (-np.inf, np.inf))
        if name != "color" and not ((values >= low) & (values <= high)).all():
            raise PhysicsParameterError(name, target, f"must be in [{low:.7g}, {high:.7g}].")
        if (name, target) not in self.values:
            self.values[name, target] = self.read(name, target)
        self.values[name, target][rows_of(mask)] = np.clip(values, low, high)

    def sky_color(self, env: int) -> np.ndarray[Any, np.dtype[np.uint8]] | None:
        """Return the color of the background, (3,) in [0, 255], or None if it was never written.

        Args:
            env: Index of the environment.
        """
        color = self.values.get(("color", self.sky))
        return None if color is None else (255.0 * color[env]).round().astype(np.uint8)

    def snapshot(self) -> Snapshot:
        """Return all values that differ from the scene."""
        return {f"looks/{name}/{target}": values.copy() for (name, target), values in self.values.items()}

    def restore(self, state: Snapshot) -> None:
        """Restore a snapshot. Values that it does not contain are those of the scene again."""
        for (name, target), current in self.values.items():
            current[:] = self.nominal(name, target)
        for key, values in state.items():
            if key.startswith("looks/"):
                name, _, target = key.removeprefix("looks/").partition("/")
                self.values[name, target] = np.array(values)
