"""Connects FRobs to ROS 1.

This package runs simulations with Gazebo's ROS interface, and policies as ROS nodes.

    ros/             find ROS, start and end its processes, talk to its master, nodes and services
    bridge/          any simulation with the topics and services of Gazebo
    robot/           the simulator ``ros``: a robot behind ROS topics
    policy_node/     the node that runs a policy on a robot
    messages/        types of messages that ROS does not provide
    rviz/            configurations of RViz
    cli/             commands
"""

import sys
from functools import partial
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from frobs_ros.bridge.gazebo_elements import read_lidars as read_lidars
    from frobs_ros.bridge.gazebo_elements import read_plugins as read_plugins
    from frobs_ros.bridge.urdf import gazebo_elements as gazebo_elements
    from frobs_ros.bridge.urdf import read_friction as read_friction
    from frobs_ros.ros.environment import RosInstallation as RosInstallation
    from frobs_ros.ros.environment import find_ros as find_ros
    from frobs_ros.ros.environment import links_to_ros as links_to_ros
    from frobs_ros.ros.environment import use_ros as use_ros
    from frobs_ros.ros.overlay import environment_has as environment_has
    from frobs_ros.ros.overlay import links_to_messages as links_to_messages
    from frobs_ros.ros.overlay import make_overlay as make_overlay

_MODULES = {
    "RosInstallation": "frobs_ros.ros.environment",
    "environment_has": "frobs_ros.ros.overlay",
    "find_ros": "frobs_ros.ros.environment",
    "gazebo_elements": "frobs_ros.bridge.urdf",
    "links_to_messages": "frobs_ros.ros.overlay",
    "links_to_ros": "frobs_ros.ros.environment",
    "make_overlay": "frobs_ros.ros.overlay",
    "read_friction": "frobs_ros.bridge.urdf",
    "read_lidars": "frobs_ros.bridge.gazebo_elements",
    "read_plugins": "frobs_ros.bridge.gazebo_elements",
    "use_ros": "frobs_ros.ros.environment",
}
__all__ = [*_MODULES]

_FOLDERS = {
    "frobs_ros.ros": "doctor environment guard interrupts master names nodes overlay packages processes services "
    "state_publisher",
    "frobs_ros.policy_node": "visualization",
    "frobs_ros.robot": "scans",
    "frobs_rl_compat.ros": "arguments backends robot_basic_env robot_settings ros_controllers ros_gazebo ros_launch "
    "ros_node ros_params ros_spawn ros_urdf",
}
_MOVED = {
    **{f"frobs_ros.{name}": [f"{folder}.{name}"] for folder, names in _FOLDERS.items() for name in names.split()},
    "frobs_ros.stand_ins": ["frobs_rl_compat.replacements"],
    "frobs_ros.log": ["frobs_ros.ros", "frobs_rl_compat.ros.logged_errors"],
}
"""Modules of version 0.2, and the modules that define their names now."""

_LEGACY = {"RobotBasicEnv": "robot_basic_env", "RobotSettings": "robot_settings", "missing_packages": "stand_ins"}
"""Names that this package had in version 0.2, and the modules of that version."""


def _find(module: str, name: str, stacklevel: int = 3) -> Any:
    from frobs_core.deprecation import moved_names  # imported here, so that listing commands does not import the core

    return moved_names(module, _MOVED[module], stacklevel)(name)


for _name in _MOVED:
    _module = sys.modules[_name] = ModuleType(_name)
    vars(_module)["__getattr__"] = partial(_find, _name)
    setattr(sys.modules[__name__], _name.rpartition(".")[2], _module)


def __getattr__(name: str) -> Any:
    """Import a public name from its module on first use, because most of the modules require ROS."""
    if name in _LEGACY:
        return _find(f"{__name__}.{_LEGACY[name]}", name, stacklevel=4)
    if name not in _MODULES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(_MODULES[name]), name)
