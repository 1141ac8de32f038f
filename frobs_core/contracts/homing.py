"""Drives the robots of a paced simulation home, slowly."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from frobs_core.contracts.robot_handle import RobotHandle
from frobs_core.description.robot import CommandMode
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import SimulationError

_AT_HOME = 0.05  # [rad or m] largest distance from home, and [rad/s or m/s] largest velocity there


def drive_home(
    robots: Mapping[str, RobotHandle], advance: Callable[[], float], period: float, speed: float, timeout: float
) -> None:
    """Command a slow motion to the home positions, and return when the robots have stopped there.

    Args:
        robots: The robots, by name.
        advance: Function that sends the commands, waits for one period, and returns the time since the start [s].
        period: Time between commands [s].
        speed: Largest velocity of a joint [rad/s or m/s].
        timeout: Time after which the motion has failed [s].

    Raises:
        SimulationError: The robots do not reach home in time.
    """
    modes = {name: robot.command_modes for name, robot in robots.items()}
    for robot in robots.values():
        robot.set_command_mode(CommandMode.POSITION)
    targets = {name: robot.joint_positions.copy() for name, robot in robots.items()}
    while not all(_is_home(robot, targets[name]) for name, robot in robots.items()):
        for name, robot in robots.items():
            step = period * np.minimum(speed, 0.5 * robot.velocity_limit)
            targets[name] += np.clip(robot.home - targets[name], -step, step)
            robot.command(targets[name])
        if advance() > timeout:
            far = ", ".join(
                f"{joint} by {off:.2g}"
                for robot in robots.values()
                for joint, off in zip(robot.joint_names, np.abs(robot.joint_positions - robot.home)[0], strict=True)
                if off > _AT_HOME
            )
            raise SimulationError(
                f"the robots did not stop at their home positions within {timeout:g} s of a reset (off: {far or 'none'})."
            )
    for name, robot in robots.items():
        if modes[name] != robot.command_modes:
            robot.set_command_mode(modes[name])


def _is_home(robot: RobotHandle, target: Floats) -> bool:
    return (
        np.array_equal(target, robot.home)
        and np.abs(robot.joint_positions - robot.home).max(initial=0.0) <= _AT_HOME
        and np.abs(robot.joint_velocities).max(initial=0.0) <= _AT_HOME
    )
