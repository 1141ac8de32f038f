"""The actions of ros2_control. They need the types of control_msgs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from frobs_core.contracts import CommandMode
from frobs_ros2.ros import Node

if TYPE_CHECKING:
    from frobs_ros2.serve.robot import ServedRobot

_FINGERS_AT_GOAL = 0.005  # [m or rad]


class Pause:
    """Awaitable that lets the executor run other callbacks once."""

    def __await__(self) -> Any:
        """Yield once."""
        yield


def offer_follow(robot: ServedRobot, node: Node, kind: Any) -> None:
    """Offer ``joint_trajectory_controller/follow_joint_trajectory``.

    Args:
        robot: The robot that follows.
        node: Node of the server.
        kind: The type ``control_msgs/action/FollowJointTrajectory``.
    """

    async def execute(goal: Any) -> Any:
        before = robot.commands
        robot.follow(goal.request.trajectory)
        result, mine = kind.Result(), robot.commands
        if mine == before:
            goal.abort()
            result.error_code, result.error_string = kind.Result.INVALID_GOAL, "the log of the server has the reason"
            return result
        while not robot.is_done:
            if goal.is_cancel_requested:
                robot.hold()
                goal.canceled()
                return result
            if robot.commands != mine:
                goal.abort()
                result.error_code, result.error_string = kind.Result.INVALID_GOAL, "another command replaced the goal"
                return result
            await Pause()
        goal.succeed()
        result.error_code = kind.Result.SUCCESSFUL
        return result

    _serve(node, kind, f"{robot.namespace}joint_trajectory_controller/follow_joint_trajectory", execute)


def offer_gripper(robot: ServedRobot, node: Node, kind: Any, columns: list[int]) -> None:
    """Offer ``gripper_controller/gripper_cmd``, whose position is that of every finger joint.

    Args:
        robot: The robot with the gripper.
        node: Node of the server.
        kind: The type ``control_msgs/action/GripperCommand``.
        columns: Columns of the finger joints.
    """

    async def execute(goal: Any) -> Any:
        position, start = goal.request.command.position, robot.time
        robot.set_command(CommandMode.POSITION, columns, [position] * len(columns))
        while robot.time - start < 2.0 and not goal.is_cancel_requested:
            if abs(robot.handle.joint_positions[0, columns[0]] - position) < _FINGERS_AT_GOAL:
                break
            await Pause()
        result = kind.Result()
        result.position = float(robot.handle.joint_positions[0, columns[0]])
        result.reached_goal = abs(result.position - position) < _FINGERS_AT_GOAL
        result.stalled = not result.reached_goal
        if goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.succeed()
        return result

    _serve(node, kind, f"{robot.namespace}gripper_controller/gripper_cmd", execute)


def _serve(node: Node, kind: Any, name: str, execute: Any) -> None:
    from rclpy.action import ActionServer, CancelResponse

    ActionServer(node.node, kind, name, execute, cancel_callback=lambda goal: CancelResponse.ACCEPT)
