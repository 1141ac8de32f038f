"""Provides FRobs's own frobs_msgs, and message packages that Debian does not contain or that are rarely installed.

The ``definitions`` folder contains the message definitions, which are based on the packages' public interfaces. The
Python packages are generated into the user's cache on first use. Checksums ensure that the message types match the
types that other ROS nodes use.
"""

from __future__ import annotations

from frobs_ros.messages.cache import message_folder

__all__ = ["PACKAGES", "message_folder"]

PACKAGES = (
    "control_msgs", "controller_manager_msgs", "dynamic_reconfigure", "frobs_msgs", "gazebo_msgs", "moveit_msgs",
    "object_recognition_msgs", "octomap_msgs", "shape_msgs",
)  # fmt: skip
"""Message packages that can be imported after calling :func:`frobs_ros.ros.environment.use_ros`."""
