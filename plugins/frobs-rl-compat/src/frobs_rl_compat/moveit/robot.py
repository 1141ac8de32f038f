"""``RobotCommander``, which provides a robot's structure and its joint positions."""

from __future__ import annotations

from typing import Any

from frobs_rl_compat.moveit.description import read_description
from frobs_rl_compat.moveit.errors import NotOfferedError
from frobs_rl_compat.moveit.group import MoveGroupCommander
from frobs_rl_compat.moveit.joints import joint_states
from frobs_rl_compat.moveit.node import ensure_node


class RobotCommander:
    """A robot described by a URDF and an SRDF. ``robot.<group>`` returns the group's :class:`MoveGroupCommander`.

    Args:
        robot_description: Name of the parameter that contains the URDF.
        ns: Namespace of the parameters and of ``move_group``.

    Raises:
        MoveItCommanderException: A parameter is missing.
    """

    def __init__(self, robot_description: str = "robot_description", ns: str = "") -> None:
        ensure_node()
        self._parameter, self._namespace = robot_description, ns
        self._description = read_description(robot_description, ns)
        self._states = joint_states(ns)
        self._groups: dict[str, MoveGroupCommander] = {}

    def get_planning_frame(self) -> str:
        """Return the frame in which all poses are expressed."""
        return self._description.semantics.planning_frame

    def get_root_link(self) -> str:
        """Return the robot's root link."""
        return self._description.model.root

    def get_group_names(self) -> list[str]:
        """Return the names of the groups."""
        return list(self._description.semantics.groups)

    def has_group(self, name: str) -> bool:
        """Return whether a group exists."""
        return name in self._description.semantics.groups

    def get_group(self, name: str) -> MoveGroupCommander:
        """Return a group's commander."""
        if name not in self._groups:
            self._groups[name] = MoveGroupCommander(name, self._parameter, self._namespace)
        return self._groups[name]

    def get_joint_names(self, group: str | None = None) -> list[str]:
        """Return the names of the movable joints in a group, or in the whole robot if ``group`` is None."""
        if group is None:
            return list(self._description.model.joint_names)
        return list(self._description.group(group).joint_names)

    get_active_joint_names = get_joint_names

    def get_link_names(self, group: str | None = None) -> list[str]:
        """Return the names of the links in a group, or in the whole robot if ``group`` is None."""
        if group is None:
            return [link.name for link in self._description.model.links]
        return list(self._description.group(group).links)

    def get_current_variable_values(self) -> dict[str, float]:
        """Return the current positions of all joints [rad or m], by joint name."""
        return self._states.current(self._description.model.joint_names)

    def get_current_state(self) -> Any:
        """Return the current joint positions as ``moveit_msgs/RobotState``."""
        from moveit_msgs.msg import RobotState

        current, state = self.get_current_variable_values(), RobotState()
        state.joint_state.header.frame_id = self.get_planning_frame()
        state.joint_state.name, state.joint_state.position = list(current), list(current.values())
        return state

    def __getitem__(self, name: str) -> MoveGroupCommander:
        return self.get_group(name)

    def __getattr__(self, name: str) -> MoveGroupCommander:
        if not name.startswith("_") and self.has_group(name):
            return self.get_group(name)
        raise NotOfferedError("RobotCommander", name, dir(self))
