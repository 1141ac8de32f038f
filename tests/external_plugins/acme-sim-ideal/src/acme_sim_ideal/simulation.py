"""A simulation in NumPy alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from acme_sim_ideal.robot import IdealRobot
from frobs_core.arrays import Floats, Mask, rows_of
from frobs_core.errors import UnknownNameError
from frobs_core.interfaces import Body, BodyHandle, Placement, Scene, Simulation, Snapshot


class IdealBody(BodyHandle):
    """A body that stays where the scene puts it."""

    def __init__(self, name: str, body: Body, num_envs: int) -> None:
        self.name = name
        self._pos = np.tile(body.pose.pos, (num_envs, 1))
        self._quat = np.tile(body.pose.quat_wxyz, (num_envs, 1))

    @property
    def pose(self) -> tuple[Floats, Floats]:
        """pos and quat_wxyz in the world frame."""
        return self._pos.copy(), self._quat.copy()

    @property
    def twist(self) -> tuple[Floats, Floats]:
        """Zero."""
        return np.zeros_like(self._pos), np.zeros_like(self._pos)


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
        scene.check(robots, lacking=("contacts", "attachments"))
        self.num_envs, self.physics_timestep = num_envs, physics_timestep
        self.robots = {name: IdealRobot(name, one, num_envs, physics_timestep) for name, one in robots.items()}
        self.bodies = {name: IdealBody(name, body, num_envs) for name, body in scene.bodies.items()}
        self._steps = np.zeros(num_envs, np.int64)
        self._wind = np.zeros((num_envs, 1))  # [m/s] along x

    @property
    def time(self) -> Floats:
        """(num_envs,) [s] since the reset."""
        return self._steps * self.physics_timestep

    def reset(self, mask: Mask | None = None) -> None:
        """Go home."""
        rows = rows_of(mask)
        for robot in self.robots.values():
            robot.go_home(rows)
        self._steps[rows] = 0

    def step(self, decimation: int) -> None:
        """Follow the commands."""
        for robot in self.robots.values():
            robot.advance(decimation)
        self._steps += decimation

    def wind_velocity(self) -> Floats:
        """(num_envs, 3) [m/s]: the wind, which blows along x."""
        return self._wind * np.array([1.0, 0.0, 0.0])

    def parameter_targets(self, name: str) -> Sequence[str]:
        """Return the targets of the parameters of this distribution."""
        return ["world"] if name == "wind_speed" else []

    def parameter(self, name: str, target: str = "") -> Floats:
        """Return the speed of the wind, (num_envs,) [m/s]."""
        if name != "wind_speed":
            raise UnknownNameError("parameter", name, ["wind_speed"])
        return self._wind[:, 0].copy()

    def write_parameter(self, name: str, target: str, values: Floats, mask: Mask | None = None) -> None:
        """Change the speed of the wind."""
        if name != "wind_speed":
            raise UnknownNameError("parameter", name, ["wind_speed"])
        self._wind[rows_of(mask), 0] = values

    def snapshot(self) -> Snapshot:
        """Return the complete state."""
        state: Snapshot = {"steps": self._steps.copy(), "wind": self._wind.copy()}
        for name, robot in self.robots.items():
            state |= {f"{name}/{key}": array for key, array in robot.snapshot().items()}
        return state

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""
        self._steps, self._wind = snapshot["steps"].copy(), snapshot["wind"].copy()
        for name, robot in self.robots.items():
            keys = [key for key in snapshot if key.startswith(f"{name}/")]
            robot.restore({key.removeprefix(f"{name}/"): snapshot[key] for key in keys})
