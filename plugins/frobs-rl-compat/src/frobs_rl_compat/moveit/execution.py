"""Executes trajectories with the controllers that MoveIt's parameters define."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from frobs_rl_compat.moveit.errors import MoveItCommanderException
from frobs_rl_compat.moveit.joints import JointStates
from frobs_rl_compat.moveit.node import group_parameters, resolve
from frobs_ros.ros.processes import wait_for

LOG = logging.getLogger("rosout.moveit_commander")

SETTINGS: dict[str, float | bool] = {
    "allowed_execution_duration_scaling": 1.1,
    "allowed_goal_duration_margin": 0.5,  # [s]
    "allowed_start_tolerance": 0.01,  # [rad or m]
    "execution_duration_monitoring": True,
}
"""MoveIt's default settings, which the service ``/move_group/trajectory_execution/set_parameters`` changes."""

_CONNECT = 5.0  # [s] maximum time to wait for a controller's action server
_LOST = 0.5  # [s] time after the final status of a goal at which a missing result is considered lost
_CANCEL = 1.0  # [s] maximum time to wait until a controller has canceled a motion
_PERIOD = 0.05  # [s]


class Execution:
    """Sends trajectories to the controllers of ``move_group`` as goals of the ``follow_joint_trajectory`` action."""

    def __init__(self, namespace: str, states: JointStates) -> None:
        self._namespace, self._states = namespace, states
        self._clients: dict[str, Any] = {}
        self._goals: list[Any] = []
        self._changed, self._stopped = threading.Event(), threading.Event()

    def execute(self, trajectory: Any, *, wait: bool) -> bool:
        """Execute a ``trajectory_msgs/JointTrajectory`` that starts at the robot's current state.

        Returns:
            Whether the controllers finished the trajectory or, if ``wait`` is False, whether the trajectory was sent.
        """
        parameters = group_parameters(self._namespace)
        settings = {**SETTINGS, **parameters.get("trajectory_execution", {})}
        if not trajectory.points:
            return True
        if not self._starts_here(trajectory, float(settings["allowed_start_tolerance"])):
            return False
        parts = self._split(trajectory, parameters.get("controller_list"))
        clients = {action: self._client(action) for action in parts}
        self._stopped.clear()
        self._changed.clear()
        self._goals = [clients[action].send_goal(goal, self._transition) for action, goal in parts.items()]
        if not wait:
            return True
        limit = None
        if settings["execution_duration_monitoring"]:
            planned = trajectory.points[-1].time_from_start.to_sec()
            scaling, margin = settings["allowed_execution_duration_scaling"], settings["allowed_goal_duration_margin"]
            limit = planned * float(scaling) + float(margin)
        return self._wait(limit)

    def stop(self) -> None:
        """Cancel the motion, and wait until the controllers hold the robot at its current position."""
        goals, self._goals = self._goals, []
        for goal in goals:
            if not _has_ended(goal):
                goal.cancel()
        self._stopped.set()
        self._changed.set()
        if not wait_for(lambda: all(map(_has_ended, goals)), _CANCEL):
            LOG.error("The controllers did not confirm within %.3g s that they canceled the motion.", _CANCEL)

    def _transition(self, _: Any) -> None:
        self._changed.set()

    def _starts_here(self, trajectory: Any, tolerance: float) -> bool:
        if tolerance <= 0.0:
            return True
        current = self._states.current(trajectory.joint_names)
        for name, planned in zip(trajectory.joint_names, trajectory.points[0].positions, strict=True):
            if abs(planned - current[name]) > tolerance:
                LOG.error(
                    "The trajectory was not executed, because it starts with the joint %s at %.4g, but the joint is at "
                    "%.4g. Plan the motion again.",
                    name, planned, current[name],
                )  # fmt: skip
                return False
        return True

    def _split(self, trajectory: Any, controllers: Any) -> dict[str, Any]:
        """Split a trajectory into one goal per controller, and return the goals by action name."""
        from control_msgs.msg import FollowJointTrajectoryGoal
        from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

        names, parts = list(trajectory.joint_names), {}
        for action, joints in choose(names, controllers, resolve(self._namespace, "move_group")).items():
            columns = [names.index(joint) for joint in joints]
            part = JointTrajectory(joint_names=joints)
            for point in trajectory.points:
                fields = {
                    field: np.array(values)[columns].tolist()
                    for field in ("positions", "velocities", "accelerations")
                    if (values := getattr(point, field))
                }
                part.points.append(JointTrajectoryPoint(time_from_start=point.time_from_start, **fields))
            parts[resolve(self._namespace, action)] = FollowJointTrajectoryGoal(trajectory=part)
        return parts

    def _client(self, action: str) -> Any:
        import rospy
        from actionlib import ActionClient
        from control_msgs.msg import FollowJointTrajectoryAction

        if action not in self._clients:
            client = ActionClient(action, FollowJointTrajectoryAction)
            end = time.monotonic() + _CONNECT
            while not _is_connected(client):  # the client's wait method uses the robot's clock, which may be paused
                time.sleep(0.01)
                if time.monotonic() > end or rospy.is_shutdown():
                    raise MoveItCommanderException(
                        f"no controller provides the action {action}; load and start the controller, or correct "
                        "controller_list."
                    )
            self._clients[action] = client
        return self._clients[action]

    def _wait(self, limit: float | None) -> bool:
        """Wait until all goals have ended, or cancel them after a time limit [s].

        The goals are canceled only if the limit is exceeded on both the robot's clock and this computer's clock. In a
        simulation that runs 20 times faster than real time, a message that arrives 50 ms late appears to be one second
        late on the robot's clock.
        """
        import rospy
        from actionlib_msgs.msg import GoalStatus

        goals, begin, began = self._goals, self._states.stamp, time.monotonic()
        ended_at = math.inf  # when the final statuses of all goals were noticed
        while not all(map(_is_done, goals)):
            if rospy.is_shutdown() or self._stopped.is_set():
                return False
            if limit is not None and min(self._states.stamp - begin, time.monotonic() - began) > limit:
                LOG.error("The controllers did not finish within %.3g s; the motion was stopped.", limit)
                self.stop()
                return False
            if all(map(_has_ended, goals)):
                ended_at = min(ended_at, time.monotonic())
                if time.monotonic() - ended_at > _LOST:
                    break
            self._changed.wait(_PERIOD)
            self._changed.clear()
        # Results may arrive before the joint states from the end of the motion, at which the next plan starts.
        ended = [result.header.stamp.to_sec() for goal in goals if (result := goal.comm_state_machine.latest_result)]
        self._states.current((), since=max(ended, default=0.0))
        failed = [goal for goal in goals if goal.get_goal_status() != GoalStatus.SUCCEEDED]
        for goal in failed:
            text = getattr(goal.get_result(), "error_string", "") or goal.get_goal_status_text() or "no reason given"
            LOG.error("A controller did not finish the motion: %s", text)
        return not failed


def choose(names: Sequence[str], controllers: Any, owner: str) -> dict[str, list[str]]:
    """Choose controllers for joints from ``controller_list``, and return the joints of each by action name."""
    if not isinstance(controllers, list) or not controllers:
        raise MoveItCommanderException(
            f"the parameter {owner}/controller_list is missing; load the controllers' YAML file from the MoveIt "
            "package into the same namespace."
        )
    chosen: dict[str, list[str]] = {}
    for name in names:
        entries = [entry for entry in controllers if isinstance(entry, Mapping) and name in entry.get("joints", ())]
        usable = [entry for entry in entries if entry.get("type") == "FollowJointTrajectory"]
        if not usable:
            others = f"; controllers of the type {entries[0].get('type')} are not supported" if entries else ""
            raise MoveItCommanderException(
                f"no controller of the type FollowJointTrajectory in {owner}/controller_list moves the joint "
                f"'{name}'{others}."
            )
        best = max(usable, key=lambda entry: bool(entry.get("default")))
        action = "/".join(filter(None, (best["name"], best.get("action_ns", ""))))
        chosen.setdefault(action, []).append(name)
    return chosen


def _is_connected(client: Any) -> bool:
    connections = client.pub_goal.get_num_connections(), client.result_sub.get_num_connections()
    return client.last_status_msg is not None and all(connections)


def _has_ended(goal: Any) -> bool:
    """Return whether the final status of a goal has arrived, even if its result has not.

    A publisher of rospy confirms a connection before it sends messages over this connection. If a motion ends in
    between, its result is lost, but the controller publishes the status again.
    """
    from actionlib import CommState

    return goal.get_comm_state() in (CommState.WAITING_FOR_RESULT, CommState.DONE)


def _is_done(goal: Any) -> bool:
    """Return whether the final status and the result of a goal have arrived."""
    from actionlib import CommState

    return bool(goal.get_comm_state() == CommState.DONE)
