"""The loop that lets a policy act on a robot: at its rate, and never on old measurements."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from frobs_core.arrays import Floats
from frobs_core.errors import FrobsError
from frobs_deploy import Policy
from frobs_ros.mirror import Mirror, State

if TYPE_CHECKING:
    from frobs_ros.ros_robot import RosRobot

_POLL = 0.001
"""[s] between two looks at the clock: the robot's may be a simulation's, and stand still."""


class RobotSilentError(FrobsError):
    """A robot does not say, or says no more, what it measures.

    Args:
        missing: What is not measured.
        seconds: How long it has been waited for.
    """

    def __init__(self, missing: str, seconds: float) -> None:
        self.missing, self.seconds = missing, seconds
        super().__init__(
            f"no {missing} for {seconds:.2g} s; the robot was told to stay. See that it runs and publishes them, or allow "
            "more time with --timeout."
        )


@dataclass
class Report:
    """What a policy did.

    Attributes:
        late: Steps that came later than half a control step after their time.
        restarts: New goals, and times that the clock went back.
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
    """Let a policy act on a robot until the robot is over, the time is up, or Ctrl-C; then tell the robot to stay.

    Args:
        robot: That measures and obeys.
        mirror: Of the policy's bundle.
        policy: It.
        goal: (3,) [m] of the task; a robot on wheels uses x and y. None: the task draws one, until the robot hears of another.
        timeout: For how long the robot may be silent [s].
        seconds: By the robot's clock; None: for ever.
        on_step: Called behind each step.

    Raises:
        RobotSilentError: The robot is silent for too long.
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
            if new is not None or now < last:  # a clock goes back where a simulation is reset
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
            due = max(due + period, now)  # what was missed is not made up for
            if on_step is not None:
                on_step(report)
        report.is_success = mirror.is_success()
    finally:
        robot.send(mirror.hold(robot.state() or state), period)
    return report


def _first(robot: RosRobot, timeout: float) -> State:
    """Wait until everything has been measured once."""
    while (state := robot.state()) is None:
        _watch(robot, timeout)
        time.sleep(_POLL)
    return state


def _watch(robot: RosRobot, timeout: float) -> None:
    what, seconds = robot.silent()
    if seconds > timeout:
        raise RobotSilentError(what, seconds)
