"""The simulator ``safe``: the safety rules around any paced simulation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from frobs_core.contracts import RobotHandle, Simulation
from frobs_core.description import Placement, Scene
from frobs_core.kernel.robot_config import find_record
from frobs_core.plugins.records import SimulatorRecord
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import ConfigurationError, SimulationError
from frobs_ros2.guard import GuardedRobot, safety_filter
from frobs_ros2.safety import REPEATED

_MOST_REFUSALS = 50  # steps in a row without a usable measurement after which a step fails


class SafeRobot(GuardedRobot):
    """A robot of another simulation, whose commands pass the safety rules.

    Args:
        inner: Handle of the robot in the other simulation.
        placement: Placement of the robot.
        safety: Settings of the safety rules.
    """

    def __init__(self, inner: RobotHandle, placement: Placement, safety: Mapping[str, Any]) -> None:
        self.describe(inner.name, placement, 1)
        self.inner, self.base = inner, inner.base
        self.rules = safety_filter(self, safety)

    @property
    def joint_positions(self) -> Floats:
        """(1, dof) [rad or m]."""
        return self.inner.joint_positions

    @property
    def joint_velocities(self) -> Floats:
        """(1, dof) [rad/s or m/s]."""
        return self.inner.joint_velocities

    @property
    def joint_efforts(self) -> Floats:
        """(1, dof) [N·m or N]."""
        return self.inner.joint_efforts

    def forward(self, values: Floats) -> None:
        """Send a command (dof,) to the robot of the other simulation."""
        if self.inner.command_modes != self.command_modes:
            self.inner.set_command_mode(self.command_modes)
        self.inner.command(values[None])


class SafeSimulation(Simulation):
    """A paced simulation with safety rules around it.

    Args:
        inner: Name or record of the paced simulator.
        inner_kwargs: Keywords of the paced simulator.
        safety: Settings of the safety rules: ``speed``, ``acceleration`` [rad/s²], ``workspace`` (two corners [m]),
            ``slow_start`` [s], ``max_age`` [s] and ``log`` (a file).

    Raises:
        ConfigurationError: The simulator is not paced, or a setting is invalid.
    """

    render_modalities = ()

    def __init__(
        self,
        robots: Mapping[str, Placement],
        scene: Scene,
        *,
        num_envs: int,
        physics_timestep: float,
        num_threads: int = 0,
        inner: str | SimulatorRecord = "ros2",
        inner_kwargs: Mapping[str, Any] | None = None,
        safety: Mapping[str, Any] | None = None,
    ) -> None:
        record = find_record(SimulatorRecord, inner)
        if not record.is_paced or record.name == "safe":
            raise ConfigurationError(f"inner is '{record.name}', which is not a paced simulator; choose one that is.")
        self.num_envs, self.physics_timestep = num_envs, physics_timestep
        engine = record.load()
        self._inner: Simulation = engine(
            robots, scene, num_envs=num_envs, physics_timestep=physics_timestep, **(inner_kwargs or {})
        )
        self._refusals = 0
        try:
            self.robots = self._robots = {
                name: SafeRobot(self._inner.robots[name], one, safety or {}) for name, one in robots.items()
            }
        except BaseException:
            self._inner.close()
            raise
        self.bodies, self.pacer, self.contacts = self._inner.bodies, self._inner.pacer, self._inner.contacts

    @property
    def time(self) -> Floats:
        """(1,) [s] since the reset."""
        return self._inner.time

    @property
    def measurement_age(self) -> Floats:
        """Age of the measured joint states, (1,) [s]."""
        return self._inner.measurement_age

    def reset(self, mask: Mask | None = None) -> None:
        """Reset the paced simulation."""
        self._inner.reset(mask)
        for robot in self._robots.values():
            robot.rules.start(robot.joint_positions[0], 0.0)
            robot.command(robot.holding_command(robot.joint_positions))

    def step(self, decimation: int) -> None:
        """Check the measurements, send the commands that the rules allow, and wait until the step is over.

        Raises:
            SimulationError: There were no usable measurements for many steps.
        """
        now, age = float(self._inner.time[0]), float(self.measurement_age[0])
        for robot in self._robots.values():
            reason = REPEATED
            if age < robot.rules.age(now):  # otherwise, it is the measurement of the step before
                reason = robot.rules.measure(now - age, robot.joint_positions[0], robot.joint_velocities[0], now)
            if reason == REPEATED and age <= robot.rules.limits.max_age:
                reason = ""
            _, values = robot.safe_command(decimation, decimation * self.physics_timestep, now, reason)
            if reason:
                self._refusals += 1
                if self._refusals > _MOST_REFUSALS:
                    self._inner.hold()
                    raise SimulationError(f"no measurement could be used for {_MOST_REFUSALS} steps: {reason}.")
            else:
                self._refusals = 0
            robot.forward(np.asarray(values))
        self._inner.step(decimation)

    def hold(self) -> None:
        """Command all robots to hold, immediately."""
        self._inner.hold()

    def close(self) -> None:
        """Close the paced simulation."""
        self._inner.close()
