"""Physical parameters of models and scenes, for simulators whose engine does not store them per environment."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from frobs_core.contracts import Snapshot
from frobs_core.description import Placement, Scene
from frobs_core.models import Link
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import PhysicsParameterError, UnknownNameError, check_name

NAMES = ("mass", "friction", "stiffness", "damping", "joint_damping", "gravity")
"""Parameters supported by every simulator that uses ``WrittenParameters``. Simulators that can rebuild bodies also
support ``size``.
"""


class WrittenParameters(ABC):
    """Base class that implements ``parameter`` and ``write_parameter`` for a simulation.

    A subclass applies the changes to its engine.

    Args:
        placements: The robots of the scene.
        scene: The rest of the scene.
        robots: Handles of the robots, which also have the array ``joint_damping``, (num_envs, dof), and a method
            ``write_gains(which, rows, values)`` that sets Kp (``which=0``) or Kd (``which=1``). The caller may fill the
            mapping after constructing the object.
        num_envs: ≥ 1.

    Attributes:
        names: Names of the supported parameters.
        written: Written values, (num_envs, …) each, by (parameter, target).
    """

    names: Sequence[str] = NAMES

    def __init__(
        self, placements: Mapping[str, Placement], scene: Scene, robots: Mapping[str, Any], num_envs: int
    ) -> None:
        self._placements, self._scene, self._robots, self._num_envs = placements, scene, robots, num_envs
        self.written: dict[tuple[str, str], Floats] = {}

    @abstractmethod
    def apply(self, name: str, target: str, mask: Mask | None) -> None:
        """Apply a written mass, friction, size or gravity to the engine.

        For the arguments, see :meth:`frobs_core.contracts.Simulation.write_parameter`.
        """

    def collides(self, target: str) -> bool:
        """Return whether ``target``, a scene body or a ``robot/link``, has a shape that can collide."""
        if target in self._scene.bodies:
            return bool(self._scene.bodies[target].collisions)
        return bool(self._link(target).collisions)

    def check_body(self, name: str) -> None:
        """Verify that ``name`` is a scene body or a ``robot/link``.

        Raises:
            UnknownNameError: The body does not exist.
        """
        links = [f"{robot}/{link.name}" for robot, placed in self._placements.items() for link in placed.model.links]
        check_name("body", name, [*self._scene.bodies, *links])

    def read(self, name: str, target: str) -> Floats:
        """Return a parameter's value in each environment, (num_envs, …).

        For the arguments and errors, see :meth:`frobs_core.contracts.Simulation.parameter`.
        """
        match name:
            case "stiffness" | "damping":
                return np.array(self._robot(target).drive_gains()[name == "damping"])
            case "joint_damping":
                return np.array(self._robot(target).joint_damping)
            case "mass" | "friction" | "gravity" | "size" if name in self.names:
                nominal = self._nominal(name, target)
                written = self.written.get((name, target))
                return np.repeat(nominal[None], self._num_envs, axis=0) if written is None else written.copy()
        raise UnknownNameError("parameter", name, self.names)

    def write(self, name: str, target: str, values: Floats, mask: Mask | None) -> None:
        """Change a parameter in the environments selected by ``mask``.

        For the arguments, see :meth:`frobs_core.contracts.Simulation.write_parameter`.

        Raises:
            UnknownNameError: The parameter or target does not exist.
            PhysicsParameterError: A value is out of range, or the body's size cannot be changed.
        """
        check_name("parameter", name, self.names)
        values = np.asarray(values, np.float64)
        if name != "gravity" and not (values >= 0).all():
            raise PhysicsParameterError(name, target, f"must not be negative or NaN: {values.min()}.")
        rows = slice(None) if mask is None else np.flatnonzero(mask)
        match name:
            case "stiffness" | "damping":
                self._robot(target).write_gains(int(name == "damping"), rows, values)
            case "joint_damping":
                self._robot(target).joint_damping[rows] = values
            case _:
                combined = self.read(name, target)
                if name == "mass" and not (values > 0).all():
                    raise PhysicsParameterError("mass", target, f"must be above 0: {values.min()}.")
                if name == "size":
                    self._scene.check_size(target, values)
                combined[rows] = values
                self.written[name, target] = combined
                self.apply(name, target, mask)

    def snapshot(self) -> Snapshot:
        """Return the written parameters and the drive gains."""
        state: Snapshot = {f"parameter/{name}:{target}": value.copy() for (name, target), value in self.written.items()}
        for name, robot in self._robots.items():
            state[f"stiffness/{name}"], state[f"damping/{name}"] = (gain.copy() for gain in robot.drive_gains())
        return state

    def restore(self, state: Snapshot) -> None:
        """Restore a snapshot.

        Parameters that the snapshot does not contain are reset to their values in the scene and the models.
        """
        saved = {
            (name, target): value
            for key, value in state.items()
            if key.startswith("parameter/")
            for name, _, target in [key.removeprefix("parameter/").partition(":")]
        }
        for name, target in {*saved, *self.written}:
            nominal = np.repeat(self._nominal(name, target)[None], self._num_envs, axis=0)
            value = np.asarray(saved.get((name, target), nominal))
            if (value != self.read(name, target)).any():
                self.write(name, target, value, None)
        for name, robot in self._robots.items():
            stiffness, damping = robot.drive_gains()
            stiffness[:], damping[:] = state[f"stiffness/{name}"], state[f"damping/{name}"]
            robot.refresh_gains()

    def _nominal(self, name: str, target: str) -> Floats:
        scene = self._scene
        if name == "gravity":
            return np.array(scene.gravity, np.float64)
        if name == "size":
            scene.check_size(target)
            return np.ones(())
        if name == "friction" and target == "floor" and scene.floor:
            return np.array(scene.floor_friction)
        self.check_body(target)
        if name == "friction" and not self.collides(target):
            raise PhysicsParameterError("friction", target, "cannot be changed, because this body does not collide.")
        if target in scene.bodies:
            body = scene.bodies[target]
            friction, inertial = body.friction, body.inertial
        else:
            robot, _, name_of_link = target.partition("/")
            friction = self._placements[robot].robot.friction.get(name_of_link, 1.0)
            inertial = self._link(target).inertial
        if name == "friction":
            return np.array(friction)
        if inertial is None:
            raise PhysicsParameterError("mass", target, "cannot be changed, because this body has no mass.")
        return np.array(inertial.mass)

    def _link(self, target: str) -> Link:
        robot, _, name = target.partition("/")
        return next(link for link in self._placements[robot].model.links if link.name == name)

    def _robot(self, name: str) -> Any:
        return self._robots[check_name("robot", name, self._robots)]
