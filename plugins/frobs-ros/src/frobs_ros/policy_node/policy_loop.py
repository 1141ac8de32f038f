"""Runs a policy on a robot at the policy's control rate, and stops the robot when measurements are outdated."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import FrobsError
from frobs_deploy import Policy
from frobs_ros.policy_node.mirror import Mirror, State

if TYPE_CHECKING:
    from frobs_ros.policy_node.robot import RosRobot

_POLL = 0.001
"""Time between two reads of the ROS clock [s]. The clock does not advance while a simulation is paused."""


class RobotSilentError(FrobsError):
    """A robot does not publish its measurements, or has stopped publishing them.

    Args:
        missing: Name of the missing measurement.
        seconds: Time since the measurement was last received [s].
    """

    def __init__(self, missing: str, seconds: float) -> None:
        self.missing, self.seconds = missing, seconds
        super().__init__(
            f"no {missing} received for {seconds:.2g} s; the robot was commanded to hold its position. Check that the "
            "robot publishes its measurements, or allow more time with --timeout."
        )


@dataclass
class Report:
    """Statistics about running a policy on a robot.

    Attributes:
        steps: Number of commands that were sent.
        late: Number of commands that were more than half a control step late.
        restarts: Number of times that an episode was restarted because of a new goal or a reset of the clock.
        is_success: Whether the task was successful at the end.
    """

    steps: int = 0
    late: int = 0
    restarts: int = 0
    is_success: bool = False


def act(
    robot: RosRobot,
    mirror: Mirror,
    policy: Policy,
    *,
    goal: Floats | None = None,
    timeout: float = 0.5,
    seconds: float | None = None,
    on_step: Callable[[Report], None] | None = None,
) -> Report:
    """Run a policy on a robot, and then command the robot to hold its position.

    The run ends when the node shuts down, when ``seconds`` have passed, or on Ctrl-C.

    Args:
        robot: Robot to control.
        mirror: Mirror that was created from the policy's bundle.
        policy: Policy to run.
        goal: Goal of the task, (3,) [m]. A wheeled robot uses only x and y. By default, the task samples a goal, which
            is used until a goal is received.
        timeout: Maximum time without measurements [s].
        seconds: Maximum duration according to the robot's clock [s]. Unlimited by default.
        on_step: Function that is called with the report after each step.

    Raises:
        RobotSilentError: The robot has not sent measurements for longer than ``timeout``.
        RosError: The command to hold the position could not be sent.
    """
    period = mirror.env.control_timestep
    state = _first(robot, timeout)
    report = Report()

    def begin(goal: Floats | None) -> None:
        mirror.begin(state, {} if goal is None else {"goal": goal[: mirror.goal_size]})
        policy.reset()

    try:
        begin(goal)
        start = due = last = robot.now()
        while not robot.is_over():
            _watch(robot, timeout)
            now = robot.now()
            state = robot.state() or state
            new = robot.new_goal()
            if new is not None or now < last:  # resetting a simulation sets the clock back
                goal = goal if new is None else new
                begin(goal)
                report.restarts += 1
                due, start = now, min(start, now)
            last = now
            if seconds is not None and now - start >= seconds:
                break
            if now < due:
                time.sleep(_POLL)
                continue
            report.late += now - due > 0.5 * period
            robot.send(mirror.act(policy.act(mirror.observe(state))), period)
            report.steps += 1
            due = max(due + period, now)  # missed steps are skipped
            if on_step is not None:
                on_step(report)
        report.is_success = mirror.is_success()
    finally:
        robot.hold(mirror.hold(robot.state() or state), period)
    return report


def _first(robot: RosRobot, timeout: float) -> State:
    """Wait until all measurements have been received once, and return the state."""
    while (state := robot.state()) is None:
        _watch(robot, timeout)
        time.sleep(_POLL)
    return state


def _watch(robot: RosRobot, timeout: float) -> None:
    what, seconds = robot.silent()
    if seconds > timeout:
        raise RobotSilentError(what, seconds)
