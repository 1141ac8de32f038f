"""The types of controllers that there are, by the names of ros_control."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from frobs_ros.bridge.controllers.controller import Controller
from frobs_ros.bridge.controllers.joint_state import JointStateController
from frobs_ros.bridge.model import Model

TYPES: Mapping[str, Callable[[Model, str, Mapping[str, Any]], Controller]] = {
    "joint_state_controller/JointStateController": JointStateController,
}
"""What makes a controller from the robot, the namespace of its topics, and its parameters."""
