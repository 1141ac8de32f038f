"""A simulation in NumPy alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

import numpy as np

from acme_sim_ideal.robot import IdealRobot
from frobs_core.arrays import Floats, Mask
from frobs_core.errors import ConfigurationError, RenderingUnavailableError, SimulationError, UnknownNameError
from frobs_core.interfaces import Body, BodyHandle, Marker, Placement, Scene, Simulation, Snapshot


class IdealBody(BodyHandle):
    """A body that stays where the scene puts it."""

    def __init__(self, name: str, body: Body, num_envs: int) -> None:
        self.name = name
        self._pos = np.tile(body.pose.pos, (num_envs, 1))
        self._quat = np.tile(body.pose.quat_wxyz, (num_envs, 1))

    @property
    def pose(self) -> tuple[Floats, Floats]:
        """pos and quat_wxyz in the world."""
        return self._pos.copy(), self._quat.copy()

    @property
    def twist(self) -> tuple[Floats, Floats]:
        """Zero."""
        return np.zeros_like(self._pos), np.zeros_like(self._pos)

    def write_pose(self, pos: Floats, quat_wxyz: Floats | None = None, mask: Mask | None = None) -> None:
        """Refuse: the simulator does not claim 'teleport'."""
        raise SimulationError(f"body '{self.name}' stays where the scene puts it.")


class IdealSimulation(Simulation):
    """Robots whose joints follow; see :class:`frobs_core.interfaces.Simulation`."""

    def __init__(
        self,
        robots: Mapping[str, Placement],
        scene: Scene,
        *,
        num_envs: int,
        physics_timestep: float,
        num_threads: int = 0,
    ) -> None:
        _check(scene, robots)
        self.num_envs, self.physics_timestep = num_envs, physics_timestep
        self.robots = {name: IdealRobot(name, one, num_envs, physics_timestep) for name, one in robots.items()}
        self.bodies = {name: IdealBody(name, body, num_envs) for name, body in scene.bodies.items()}
        self._steps = np.zeros(num_envs, np.int64)

    @property
    def native(self) -> None:
        """There is no engine."""
        return

    @property
    def time(self) -> Floats:
        """(num_envs,) [s] since the reset."""
        return self._steps * self.physics_timestep

    @property
    def diverged(self) -> None:
        """Nothing ever does."""
        return

    def reset(self, mask: Mask | None = None) -> None:
        """Go home."""
        rows = slice(None) if mask is None else mask
        for robot in self.robots.values():
            robot.go_home(rows)
        self._steps[rows] = 0

    def step(self, decimation: int) -> None:
        """Follow the commands."""
        for robot in self.robots.values():
            robot.advance(decimation)
        self._steps += decimation

    def contact(self, name: str) -> NoReturn:
        """Refuse: nothing touches."""
        raise UnknownNameError("declared contact", name, ())

    def contact_force(self, name: str) -> NoReturn:
        """Refuse: nothing touches."""
        raise UnknownNameError("declared contact", name, ())

    def rays(self, origins: Floats, directions: Floats, max_range: float) -> NoReturn:
        """Refuse: there are no rays."""
        raise SimulationError("there are no rays here.")

    def apply_wrench(self, body: str, force_world: Floats, torque_world: Floats, mask: Mask | None = None) -> NoReturn:
        """Refuse: nothing can be pushed."""
        raise SimulationError("nothing can be pushed here.")

    def parameter(self, name: str, target: str = "") -> NoReturn:
        """Refuse: there are none."""
        raise UnknownNameError("parameter", name, ())

    def write_parameter(self, name: str, target: str, values: Floats, mask: Mask | None = None) -> NoReturn:
        """Refuse: there are none."""
        raise UnknownNameError("parameter", name, ())

    def snapshot(self) -> Snapshot:
        """Return the complete state."""
        state: Snapshot = {"steps": self._steps.copy()}
        for name, robot in self.robots.items():
            state |= {f"{name}/{key}": array for key, array in robot.snapshot().items()}
        return state

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""
        self._steps = snapshot["steps"].copy()
        for name, robot in self.robots.items():
            keys = [key for key in snapshot if key.startswith(f"{name}/")]
            robot.restore({key.removeprefix(f"{name}/"): snapshot[key] for key in keys})

    def render(
        self,
        mask: Mask | None = None,
        camera: str | None = None,
        size: tuple[int, int] = (480, 640),
        modality: str = "rgb",
        markers: Sequence[Marker] = (),
    ) -> np.ndarray[Any, Any]:
        """Refuse: it cannot draw."""
        raise RenderingUnavailableError("the simulator 'ideal' cannot draw", "nothing")

    def open_viewer(self) -> None:
        """Refuse: it cannot draw."""
        raise RenderingUnavailableError("the simulator 'ideal' cannot draw", "nothing")

    def close(self) -> None:
        """There is nothing to release."""


def _check(scene: Scene, robots: Mapping[str, Placement]) -> None:
    for name, body in scene.bodies.items():
        if body.kinematic and body.mass is not None:
            raise ConfigurationError(f"body '{name}' is kinematic, and has a mass; give one of them.")
    if scene.contacts:
        raise ConfigurationError(f"there are no contacts here, and the scene wants {', '.join(scene.contacts)}.")
    for name, camera in scene.cameras.items():
        robot, _, link = (camera.frame or "").partition("/")
        if robot and (robot not in robots or link not in [one.name for one in robots[robot].model.links]):
            raise ConfigurationError(f"camera '{name}' is fixed to '{camera.frame}', which is not here.")
