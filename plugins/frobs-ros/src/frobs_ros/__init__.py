"""Connects FRobs to ROS 1.

This package provides FRobs_RL's functions and environments, runs simulations with Gazebo's ROS interface, and runs
policies as ROS nodes.
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
    from frobs_ros.robot_basic_env import RobotBasicEnv as RobotBasicEnv
    from frobs_ros.robot_settings import RobotSettings as RobotSettings
    from frobs_ros.ros.environment import RosInstallation as RosInstallation
    from frobs_ros.ros.environment import find_ros as find_ros
    from frobs_ros.ros.environment import links_to_ros as links_to_ros
    from frobs_ros.ros.environment import use_ros as use_ros
    from frobs_ros.ros.overlay import environment_has as environment_has
    from frobs_ros.ros.overlay import links_to_messages as links_to_messages
    from frobs_ros.ros.overlay import make_overlay as make_overlay
    from frobs_ros.stand_ins import missing_packages as missing_packages

_MODULES = {
    "RobotBasicEnv": "frobs_ros.robot_basic_env",
    "RobotSettings": "frobs_ros.robot_settings",
    "RosInstallation": "frobs_ros.ros.environment",
    "environment_has": "frobs_ros.ros.overlay",
    "find_ros": "frobs_ros.ros.environment",
    "gazebo_elements": "frobs_ros.bridge.urdf",
    "links_to_messages": "frobs_ros.ros.overlay",
    "links_to_ros": "frobs_ros.ros.environment",
    "make_overlay": "frobs_ros.ros.overlay",
    "missing_packages": "frobs_ros.stand_ins",
    "read_friction": "frobs_ros.bridge.urdf",
    "read_lidars": "frobs_ros.bridge.gazebo_elements",
    "read_plugins": "frobs_ros.bridge.gazebo_elements",
    "use_ros": "frobs_ros.ros.environment",
}
__all__ = [*_MODULES]

_ROS = "doctor environment guard interrupts log master names nodes overlay packages parameter_server processes services"
_MOVED = {
    **{f"frobs_ros.{name}": [f"frobs_ros.ros.{name}"] for name in [*_ROS.split(), "state_publisher"]},
    **{f"frobs_ros.{name}": [f"frobs_ros.policy_node.{name}"] for name in ("mirror", "policy_loop", "scans")},
    "frobs_ros.ros_robot": ["frobs_ros.policy_node.robot"],
}
"""Modules of version 0.2, and the modules that define their names now."""


def _find(module: str, name: str) -> Any:
    from frobs_core.deprecation import moved_names  # imported here, so that listing commands does not import the core

    return moved_names(module, _MOVED[module], stacklevel=3)(name)


for _name in _MOVED:
    _module = sys.modules[_name] = ModuleType(_name)
    vars(_module)["__getattr__"] = partial(_find, _name)


def __getattr__(name: str) -> Any:
    """Import a public name from its module on first use, because most of the modules require ROS."""
    if name not in _MODULES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(_MODULES[name]), name)
