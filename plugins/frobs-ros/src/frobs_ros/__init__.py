"""ROS 1 for FRobs: FRobs_RL's helpers and environments, any simulation as Gazebo, and policies as nodes."""

from importlib import import_module
from typing import Any

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
    "read_friction": "frobs_ros.bridge.urdf",
    "read_lidars": "frobs_ros.bridge.extras",
    "read_plugins": "frobs_ros.bridge.extras",
    "use_ros": "frobs_ros.environment",
}
__all__ = [*_MODULES]


def __getattr__(name: str) -> Any:
    """Import a public name from its module when it is first used: most need ROS."""
    if name not in _MODULES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(_MODULES[name]), name)
