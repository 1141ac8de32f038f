"""Message packages that are missing from Debian, or that few machines have installed, and our own frobs_msgs.

``definitions`` contains their definitions, written from the public interfaces. The Python packages are generated into
the user's cache on first use. The checksum of each type proves that it is the one that other ROS nodes use.
"""

from __future__ import annotations

from frobs_ros.messages.cache import message_folder

__all__ = ["PACKAGES", "message_folder"]

PACKAGES = (
    "control_msgs", "controller_manager_msgs", "dynamic_reconfigure", "frobs_msgs", "gazebo_msgs", "moveit_msgs",
    "object_recognition_msgs", "octomap_msgs", "shape_msgs",
)  # fmt: skip
"""The packages that can be imported after :func:`frobs_ros.environment.use_ros`."""
