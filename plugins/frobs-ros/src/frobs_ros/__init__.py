"""Connects FRobs to ROS 1.

This package provides FRobs_RL's functions and environments, runs simulations with Gazebo's ROS interface, and runs
policies as ROS nodes.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from frobs_ros.bridge.extras import read_lidars as read_lidars
    from frobs_ros.bridge.extras import read_plugins as read_plugins
    from frobs_ros.bridge.urdf import gazebo_elements as gazebo_elements
    from frobs_ros.bridge.urdf import read_friction as read_friction
    from frobs_ros.environment import RosInstallation as RosInstallation
    from frobs_ros.environment import find_ros as find_ros
    from frobs_ros.environment import links_to_ros as links_to_ros
    from frobs_ros.environment import use_ros as use_ros
    from frobs_ros.overlay import environment_has as environment_has
    from frobs_ros.overlay import links_to_messages as links_to_messages
    from frobs_ros.overlay import make_overlay as make_overlay
    from frobs_ros.robot_basic_env import RobotBasicEnv as RobotBasicEnv
    from frobs_ros.robot_settings import RobotSettings as RobotSettings
    from frobs_ros.stand_ins import missing_packages as missing_packages

_MODULES = {
    "RobotBasicEnv": "frobs_ros.robot_basic_env",
    "RobotSettings": "frobs_ros.robot_settings",
    "RosInstallation": "frobs_ros.environment",
    "environment_has": "frobs_ros.overlay",
    "find_ros": "frobs_ros.environment",
    "gazebo_elements": "frobs_ros.bridge.urdf",
    "links_to_messages": "frobs_ros.overlay",
    "links_to_ros": "frobs_ros.environment",
    "make_overlay": "frobs_ros.overlay",
    "missing_packages": "frobs_ros.stand_ins",
    "read_friction": "frobs_ros.bridge.urdf",
    "read_lidars": "frobs_ros.bridge.extras",
    "read_plugins": "frobs_ros.bridge.extras",
    "use_ros": "frobs_ros.environment",
}
__all__ = [*_MODULES]


def __getattr__(name: str) -> Any:
    """Import a public name from its module on first use, because most of the modules require ROS."""
    if name not in _MODULES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(_MODULES[name]), name)
