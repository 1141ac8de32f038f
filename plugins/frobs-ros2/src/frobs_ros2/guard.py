"""Applies the safety rules to the robots of a paced simulation."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.contracts import CommandMode, RobotHandle
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ParameterValueError, UnsuitableRobotError, check_keys
from frobs_core.util.validation import non_negative, number_list, positive
from frobs_ros2.safety import Limits, SafetyFilter

_log = logging.getLogger(__name__)

SETTINGS: Mapping[str, Any] = {
    "speed": 1.0,
    "acceleration": None,
    "workspace": None,
    "slow_start": 2.0,
    "max_age": 0.2,
    "log": None,
}
"""Settings of the rules, with their defaults: the fields of :class:`frobs_ros2.safety.Limits`, and the file of the log."""


def safety_filter(handle: RobotHandle, rules: Mapping[str, Any]) -> SafetyFilter:
    """Return the rules of a robot, with the limits of its model file.

    Args:
        handle: Handle of the robot.
        rules: Settings; see :data:`SETTINGS`.

    Raises:
        ConfigurationError: A setting is unknown or out of range, or the joints have different command modes.
    """
    if len({*handle.command_modes}) > 1:
        what = (
            "has joints with different command modes, which the safety rules do not support; choose other controllers."
        )
        raise UnsuitableRobotError(handle.robot.name, what)
    check_keys("safety", rules, SETTINGS)
    given = {**SETTINGS, **rules}
    workspace = given["workspace"]
    if workspace is not None:
        if CommandMode.EFFORT in handle.command_modes:
            rule = "omitted, because an effort does not say where the tool moves"
            raise ParameterValueError("safety: workspace", workspace, rule)
        corners = list(workspace) if isinstance(workspace, Iterable) else []
        if len(corners) != 2:
            raise ParameterValueError("safety: workspace", workspace, "a lower and an upper corner [m]")
        workspace = np.array([number_list("safety: workspace", corner, 3) for corner in corners])
    for name in ("speed", "acceleration", "max_age"):
        if given[name] is not None:
            positive(f"safety: {name}", given[name])
    if given["speed"] > 1.0:
        raise ParameterValueError("safety: speed", given["speed"], "at most 1, the fraction of the velocity limits")
    non_negative("safety: slow_start", given["slow_start"], "s")
    limits = Limits(
        joint_names=handle.joint_names,
        lower=handle.position_lower[0],
        upper=handle.position_upper[0],
        velocity=handle.velocity_limit[0],
        effort=handle.effort_limit[0],
        acceleration=given["acceleration"],
        workspace=workspace,
        speed=given["speed"],
        slow_start=given["slow_start"],
        max_age=given["max_age"],
    )
    log = None if given["log"] is None else Path(given["log"])
    return SafetyFilter(limits, 1.0, lambda q: handle.planned_frame_pose("tcp", q[None])[0][0], log)


class GuardedRobot(RobotHandle):
    """A robot whose commands pass the safety rules when a step begins.

    Attributes:
        rules: The rules.
    """

    rules: SafetyFilter

    def safe_command(self, decimation: int, duration: float, now: float, fault: str) -> tuple[CommandMode, Floats]:
        """Return the command of the next step, as the rules allow it.

        Args:
            decimation: Number of physics steps.
            duration: Duration of the step [s].
            now: Current time [s].
            fault: Reason for which the robot must hold, or an empty text.

        Returns:
            The mode and the command at the end of the step, (dof,).
        """
        asked, mode = self._take_commands(decimation)[0, -1], self.command_mode
        rules, was_held = self.rules, self.rules.held
        rules.timestep = duration
        values = rules.hold(str(mode), fault, now) if fault else rules.command(str(mode), asked, now)
        if rules.held and not was_held:
            _log.warning("Robot '%s' holds: %s.", self.name, rules.held)
        return mode, np.asarray(values)

    def hold_command(self, reason: str, now: float) -> tuple[CommandMode, Floats]:
        """Return the command that makes the robot hold.

        Args:
            reason: Why the robot must hold.
            now: Current time [s].
        """
        return self.command_mode, np.asarray(self.rules.hold(str(self.command_mode), reason, now))
