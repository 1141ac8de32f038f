"""``MoveGroupCommander``, which plans and executes motions of one joint group."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from frobs_controllers_planning import Plan, Reason, ToolGoal
from frobs_core.models import compose
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import rpy_from_quat
from frobs_rl_compat.moveit import poses
from frobs_rl_compat.moveit.description import read_description
from frobs_rl_compat.moveit.errors import MoveItCommanderException, NotOfferedError, check_known
from frobs_rl_compat.moveit.execution import Execution
from frobs_rl_compat.moveit.joints import joint_states
from frobs_rl_compat.moveit.node import ensure_node
from frobs_rl_compat.moveit.planning import GroupPlanner
from frobs_rl_compat.moveit.scene_service import current_scene, wait_for_move_group

LOG = logging.getLogger("rosout.moveit_commander")

_ERROR_CODES = {
    Reason.PLANNED: "SUCCESS",
    Reason.START_OUTSIDE_LIMITS: "INVALID_ROBOT_STATE",
    Reason.START_IN_COLLISION: "START_STATE_IN_COLLISION",
    Reason.GOAL_OUTSIDE_LIMITS: "INVALID_GOAL_CONSTRAINTS",
    Reason.GOAL_IN_COLLISION: "GOAL_IN_COLLISION",
    Reason.GOAL_OUT_OF_REACH: "NO_IK_SOLUTION",
    Reason.NO_WAY_FOUND: "PLANNING_FAILED",
}
_BOUND = 1e-6  # [rad or m] maximum amount by which a target may exceed a limit due to rounding
_SPACING = 0.05  # [s] between the points of a motion
_LEAST = 10  # minimum number of points in a motion


def _accessors(
    name: str, meaning: str, most: float = math.inf
) -> tuple[Callable[[MoveGroupCommander], float], Callable[[MoveGroupCommander, float], None]]:
    """Return the getter and the setter of a setting, which must be above 0 and at most ``most``."""

    def get(self: MoveGroupCommander) -> float:
        return self._settings[name]

    def set(self: MoveGroupCommander, value: float) -> None:
        number = float(value)
        if not 0.0 < number <= most or math.isinf(number):
            limit = "" if math.isinf(most) else f" and at most {most:g}"
            raise MoveItCommanderException(f"the {name} is {value}; it must be above 0{limit}.")
        self._settings[name] = number

    get.__doc__, set.__doc__ = f"Return {meaning}.", f"Set {meaning}."
    return get, set


class MoveGroupCommander:
    """Plans and executes motions of one joint group, like MoveIt's class of the same name.

    Args:
        name: Name of the group.
        robot_description: Name of the parameter that contains the URDF.
        ns: Namespace of the parameters and of ``move_group``.
        wait_for_servers: Maximum time to wait for ``move_group`` [s].

    Raises:
        MoveItCommanderException: The group or a parameter does not exist, or ``move_group`` is not running.
    """

    def __init__(
        self, name: str, robot_description: str = "robot_description", ns: str = "", wait_for_servers: float = 5.0
    ) -> None:
        ensure_node()
        self._namespace = ns
        self._description = read_description(robot_description, ns)
        self._group = self._description.group(name)
        wait_for_move_group(ns, wait_for_servers)
        self._names = self._group.joint_names
        limits = {joint.name: joint.limits for joint in self._description.model.actuated_joints}
        self._lower = np.array([limits[joint].lower for joint in self._names])
        self._upper = np.array([limits[joint].upper for joint in self._names])
        self._endless = np.isinf(self._lower) & np.isinf(self._upper)
        self._planner = GroupPlanner(self._description, self._group)
        self._states = joint_states(ns)
        self._execution = Execution(ns, self._states)
        self._frame = self._description.semantics.planning_frame
        self._link = self._group.tip
        self._joint_target: Floats | None = None
        # The link, the link's target pose, and whether the rotation is constrained
        self._pose_target: tuple[str, Floats, bool] | None = None
        self._settings = {
            "joint tolerance": 1e-4,
            "position tolerance": 1e-4,
            "orientation tolerance": 1e-3,
            "velocity scaling factor": self._description.velocity_scaling,
            "acceleration scaling factor": self._description.acceleration_scaling,
            "planning time": 5.0,
        }
        self._random = np.random.default_rng()

    def __getattr__(self, name: str) -> Any:
        raise NotOfferedError("MoveGroupCommander", name, dir(self))

    # Description of the group

    def get_name(self) -> str:
        """Return the group's name."""
        return self._group.name

    def get_joints(self) -> list[str]:
        """Return the names of the group's movable joints."""
        return list(self._names)

    get_active_joints = get_joints

    def get_variable_count(self) -> int:
        """Return the number of movable joints in the group."""
        return len(self._names)

    def get_planning_frame(self) -> str:
        """Return the frame in which motions are planned."""
        return self._description.semantics.planning_frame

    def get_pose_reference_frame(self) -> str:
        """Return the default frame of pose targets."""
        return self._frame

    def set_pose_reference_frame(self, reference_frame: str) -> None:
        """Set the default frame of pose targets to the planning frame or to a link of the robot."""
        self._description.frame_pose(reference_frame, self._states)
        self._frame = reference_frame

    def has_end_effector_link(self) -> bool:
        """Return whether the group has an end-effector link."""
        return bool(self._link)

    def get_end_effector_link(self) -> str:
        """Return the link that pose targets refer to, or an empty string if the group has no such link."""
        return self._link

    def set_end_effector_link(self, link_name: str) -> None:
        """Set the link that pose targets refer to."""
        self._link = self._tool(link_name)

    # Current state of the robot

    def get_current_joint_values(self) -> list[float]:
        """Return the current joint positions [rad or m]."""
        current = self._states.current(self._names)
        return [current[name] for name in self._names]

    def get_current_pose(self, end_effector_link: str = "") -> Any:
        """Return the current pose of the end-effector link in the planning frame as ``geometry_msgs/PoseStamped``."""
        return self._stamped(self._tool_pose(end_effector_link))

    def get_current_rpy(self, end_effector_link: str = "") -> list[float]:
        """Return the roll, pitch and yaw angles of the end-effector link in the planning frame [rad]."""
        return list(rpy_from_quat(self._tool_pose(end_effector_link)[3:]))

    def get_random_joint_values(self) -> list[float]:
        """Return random joint positions within the limits [rad or m], without checking for collisions."""
        lower = np.where(np.isinf(self._lower), -math.pi, self._lower)
        upper = np.where(np.isinf(self._upper), math.pi, self._upper)
        drawn: list[float] = self._random.uniform(lower, upper).tolist()
        return drawn

    def get_random_pose(self, end_effector_link: str = "") -> Any:
        """Return the pose of the end-effector link at random joint positions as ``geometry_msgs/PoseStamped``."""
        positions = {**self._everything(), **dict(zip(self._names, self.get_random_joint_values(), strict=True))}
        return self._stamped(self._description.link_pose(self._tool(end_effector_link), positions))

    # Targets

    def set_joint_value_target(self, arg1: Any, arg2: Any = None, arg3: Any = None) -> None:
        """Set joint positions as the target.

        Args:
            arg1: A list of all positions in the group's joint order, a mapping of joint names to positions, a
                ``JointState``, the name of one joint, or a pose.
            arg2: The position of the joint if ``arg1`` is a joint name, or the end-effector link if ``arg1`` is a pose.
            arg3: Whether an approximate solution is sufficient. Approximate solutions are not supported.

        Raises:
            MoveItCommanderException: A joint does not exist, or a position exceeds its limits.
        """
        if isinstance(arg1, str):
            if arg2 is None:
                raise MoveItCommanderException(f"pass the position of the joint '{arg1}' as the second argument.")
            arg1 = {arg1: np.ravel(arg2)[0]}
        elif _is_pose(arg1):
            if arg3 or isinstance(arg2, bool):
                raise NotOfferedError("MoveGroupCommander", "set_joint_value_target(pose, approximate)", ())
            self.set_pose_target(arg1, arg2 or "")
            return
        elif hasattr(arg1, "name") and hasattr(arg1, "position"):
            if len(arg1.name) != len(arg1.position):
                raise MoveItCommanderException("a JointState must contain exactly one position for each joint name.")
            arg1 = {name: value for name, value in zip(arg1.name, arg1.position, strict=True) if name in self._names}
        self._joint_target = self._within(self._joint_vector(arg1))
        self._pose_target = None

    def get_joint_value_target(self) -> list[float]:
        """Return the target joint positions [rad or m], or the current joint positions if no target is set."""
        if self._joint_target is None:
            return self.get_current_joint_values()
        target: list[float] = self._joint_target.tolist()
        return target

    def set_pose_target(self, pose: Any, end_effector_link: str = "") -> None:
        """Set a pose of the end-effector link as the target.

        Args:
            pose: A ``Pose``, a ``PoseStamped``, or a list that contains x, y, z, followed by either roll, pitch, yaw or
                the quaternion x, y, z, w.
            end_effector_link: Name of the link. Defaults to the group's end-effector link.
        """
        self._pose_target = (self._tool(end_effector_link), self._pose(pose), True)
        self._joint_target = None

    def set_position_target(self, xyz: Sequence[float], end_effector_link: str = "") -> None:
        """Set a position of the end-effector link as the target, without constraining the link's rotation."""
        position = [float(value) for value in xyz]
        if len(position) != 3:
            raise MoveItCommanderException(f"a position has 3 numbers, not {len(position)}.")
        pose = self._pose([*position, 0.0, 0.0, 0.0, 1.0])
        self._pose_target = (self._tool(end_effector_link), pose, False)
        self._joint_target = None

    def clear_pose_targets(self) -> None:
        """Remove the pose or position target."""
        self._pose_target = None

    def set_named_target(self, name: str) -> None:
        """Set one of the SRDF's named states as the target."""
        self.set_joint_value_target(self.get_named_target_values(name))

    def get_named_targets(self) -> list[str]:
        """Return the names of the states that the SRDF defines for the group."""
        return list(self._group.states)

    def get_named_target_values(self, target: str) -> dict[str, float]:
        """Return the joint positions of a named state [rad or m], by joint name."""
        check_known(f"group '{self._group.name}'", "state", target, self._group.states)
        return {name: value for name, value in self._group.states[target].items() if name in self._names}

    # Settings

    get_goal_joint_tolerance, set_goal_joint_tolerance = _accessors(
        "joint tolerance", "the tolerance of joint targets [rad or m], which has no effect on the planned motions"
    )
    get_goal_position_tolerance, set_goal_position_tolerance = _accessors(
        "position tolerance", "the maximum permitted distance from a pose target [m]"
    )
    get_goal_orientation_tolerance, set_goal_orientation_tolerance = _accessors(
        "orientation tolerance", "the maximum permitted orientation error relative to a pose target [rad]"
    )
    get_planning_time, set_planning_time = _accessors("planning time", "the maximum planning time [s]")
    set_max_velocity_scaling_factor = _accessors(
        "velocity scaling factor",
        "the velocity scaling factor of motions: a fraction of the velocity limits, in (0, 1]",
        most=1.0,
    )[1]
    set_max_acceleration_scaling_factor = _accessors(
        "acceleration scaling factor",
        "the acceleration scaling factor of motions: a fraction of the acceleration limits, in (0, 1]",
        most=1.0,
    )[1]

    def get_goal_tolerance(self) -> tuple[float, float, float]:
        """Return the joint tolerance, the position tolerance and the orientation tolerance."""
        return (
            self.get_goal_joint_tolerance(),
            self.get_goal_position_tolerance(),
            self.get_goal_orientation_tolerance(),
        )

    def set_goal_tolerance(self, value: float) -> None:
        """Set the joint, position and orientation tolerances to the same value."""
        self.set_goal_joint_tolerance(value)
        self.set_goal_position_tolerance(value)
        self.set_goal_orientation_tolerance(value)

    def set_workspace(self, ws: Sequence[float]) -> None:
        """Validate a workspace, which is either an empty list or two corners given as 4 or 6 numbers.

        As in MoveIt, a workspace limits only the motion of mobile bases, which this replacement does not support.
        """
        corners = [float(value) for value in ws]
        half = len(corners) // 2
        if len(corners) not in (0, 4, 6) or any(a > b for a, b in zip(corners[:half], corners[half:], strict=True)):
            raise MoveItCommanderException(
                "a workspace must be [], [min x, min y, max x, max y] or [min x, min y, min z, max x, max y, max z], "
                f"not {corners}."
            )

    def set_start_state_to_current_state(self) -> None:
        """Do nothing, because motions always start at the robot's current state."""

    # Motions

    def plan(self, joints: Any = None) -> tuple[bool, Any, float, Any]:
        """Plan a motion from the robot's current state to the target.

        Args:
            joints: A joint target as in :meth:`set_joint_value_target`, a pose, or the name of a state. Defaults to the
                current target.

        Returns:
            Whether a motion was found, the motion as ``RobotTrajectory``, the planning time [s], and the
            ``MoveItErrorCodes``.
        """
        from moveit_msgs.msg import MoveItErrorCodes

        self._take(joints)
        plan, trajectory = self._plan()
        name = _ERROR_CODES[plan.reason] if plan is not None else "INVALID_GOAL_CONSTRAINTS"
        seconds = plan.seconds if plan is not None else 0.0
        success = plan is not None and plan.success
        if not success:
            LOG.warning("%s: no motion was planned: %s", self._group.name, name if plan else "no target is set")
        return success, trajectory, seconds, MoveItErrorCodes(val=getattr(MoveItErrorCodes, name))

    def go(self, joints: Any = None, wait: bool = True) -> bool:
        """Plan a motion to the target and execute the motion.

        Args:
            joints: The target, as in :meth:`plan`.
            wait: Whether to wait until the motion has ended before returning.

        Returns:
            Whether the motion was planned and executed or, if ``wait`` is False, planned and sent to the controllers.
        """
        if isinstance(joints, bool):
            joints, wait = None, joints
        success, trajectory, _, _ = self.plan(joints)
        return success and self.execute(trajectory, wait)

    def execute(self, plan_msg: Any, wait: bool = True) -> bool:
        """Execute a motion returned by :meth:`plan`. See :meth:`go` for the ``wait`` argument and the return value."""
        return self._execution.execute(plan_msg.joint_trajectory, wait=wait)

    def stop(self) -> None:
        """Stop the motion."""
        self._execution.stop()

    def _take(self, target: Any) -> None:
        if target is None:
            return
        if isinstance(target, str):
            self.set_named_target(target)
        else:
            self.set_joint_value_target(target)

    def _plan(self) -> tuple[Plan | None, Any]:
        """Return the planner's result (None if no target is set) and the motion as a message."""
        goal = self._goal()
        start = self._everything()
        values = np.array([start[name] for name in self._names])
        turns = np.where(self._endless, 2.0 * np.pi * np.round(values / (2.0 * np.pi)), 0.0)
        start.update(zip(self._names, (values - turns).tolist(), strict=True))
        if goal is None:
            empty = Plan(reason=Reason.GOAL_OUTSIDE_LIMITS)
            return None, self._message(empty, turns)
        plan = self._planner.plan(
            start,
            goal,
            link=self._pose_target[0] if self._pose_target else self._link,
            scene=current_scene(self._namespace),
            velocity_scaling=self._settings["velocity scaling factor"],
            acceleration_scaling=self._settings["acceleration scaling factor"],
            max_seconds=self._settings["planning time"],
        )
        return plan, self._message(plan, turns)

    def _message(self, plan: Plan, offset: Floats) -> Any:
        """Return a plan for all joints of the robot as a message, which has no points if the plan contains no motion.

        ``offset`` is added to the positions of the group's joints, (k,) [rad or m].
        """
        import rospy
        from moveit_msgs.msg import RobotTrajectory
        from trajectory_msgs.msg import JointTrajectoryPoint

        message = RobotTrajectory()
        message.joint_trajectory.header.frame_id = self.get_planning_frame()
        message.joint_trajectory.joint_names = list(self._names)
        if plan.trajectory is None or plan.trajectory.duration == 0.0:
            return message
        columns = [self._description.model.joint_names.index(name) for name in self._names]
        count = max(_LEAST, math.ceil(plan.trajectory.duration / _SPACING))
        times = np.linspace(0.0, plan.trajectory.duration, count + 1)
        positions, velocities, accelerations = (rows[:, columns] for rows in plan.trajectory.sample(times))
        for row, seconds in enumerate(times.tolist()):
            message.joint_trajectory.points.append(
                JointTrajectoryPoint(
                    positions=(positions[row] + offset).tolist(),
                    velocities=velocities[row].tolist(),
                    accelerations=accelerations[row].tolist(),
                    time_from_start=rospy.Duration.from_sec(seconds),
                )
            )
        return message

    def _goal(self) -> Floats | ToolGoal | None:
        if self._pose_target is None:
            return self._joint_target
        _, pose, is_turned = self._pose_target
        return ToolGoal(
            pose[:3],
            pose[3:] if is_turned else None,
            position_tolerance=self._settings["position tolerance"],
            rotation_tolerance=self._settings["orientation tolerance"],
        )

    def _joint_vector(self, values: Any) -> Floats:
        """Return joint positions (dof,), using the last target or the current position for unspecified joints."""
        if isinstance(values, Mapping):
            for name in values:
                check_known(f"group '{self._group.name}'", "joint", name, self._names)
            target = dict(zip(self._names, self.get_joint_value_target(), strict=True))
            target.update({name: float(value) for name, value in values.items()})
            return np.array([target[name] for name in self._names])
        if not isinstance(values, Iterable):
            raise MoveItCommanderException(
                f"{values!r} is not a joint target; pass positions as a list or by joint name."
            )
        vector = np.array([float(value) for value in values])
        if vector.shape != (len(self._names),):
            raise MoveItCommanderException(
                f"the group '{self._group.name}' has {len(self._names)} joints, but {len(vector)} positions were given."
            )
        return vector

    def _within(self, target: Floats) -> Floats:
        """Return a joint target, clipped to the limits if it exceeds them only due to rounding."""
        target = np.where(self._endless, target - 2.0 * np.pi * np.round(target / (2.0 * np.pi)), target)
        inside = np.clip(target, self._lower, self._upper)
        beyond = ~(np.abs(inside - target) <= _BOUND)
        if beyond.any():
            i = int(np.argmax(beyond))
            raise MoveItCommanderException(
                f"the target {target[i]:.6g} of the joint '{self._names[i]}' is outside the joint's limits, "
                f"{self._lower[i]:.6g} to {self._upper[i]:.6g}."
            )
        return inside

    def _tool(self, link: str) -> str:
        link = link or self._link
        if not link:
            raise MoveItCommanderException(
                f"the group '{self._group.name}' has no end-effector link, because its joints do not form a chain; "
                "pass the name of a link."
            )
        check_known("robot", "link", link, [each.name for each in self._description.model.links])
        return link

    def _tool_pose(self, link: str) -> Floats:
        return self._description.link_pose(self._tool(link), self._everything())

    def _pose(self, pose: Any) -> Floats:
        """Return a pose target in the planning frame."""
        frame = self._frame
        if hasattr(pose, "pose"):
            frame, pose = pose.header.frame_id or frame, pose.pose
        array = poses.from_message(pose) if hasattr(pose, "orientation") else poses.from_list(pose)
        return compose(self._description.frame_pose(frame, self._states), array)

    def _everything(self) -> dict[str, float]:
        return self._states.current(self._description.model.joint_names)

    def _stamped(self, pose: Floats) -> Any:
        import rospy
        from geometry_msgs.msg import PoseStamped

        message = PoseStamped(pose=poses.to_message(pose))
        message.header.stamp, message.header.frame_id = rospy.Time.now(), self.get_planning_frame()
        return message


def _is_pose(value: Any) -> bool:
    return hasattr(value, "pose") or (hasattr(value, "position") and hasattr(value, "orientation"))
