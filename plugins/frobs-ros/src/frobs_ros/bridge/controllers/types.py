"""Supported controller types and their ros_control names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from frobs_core.contracts import CommandMode
from frobs_ros.bridge.controllers.controller import Controller
from frobs_ros.bridge.controllers.diff_drive import DiffDriveController
from frobs_ros.bridge.controllers.group import Commanded, Regulated
from frobs_ros.bridge.controllers.joint_state import JointStateController
from frobs_ros.bridge.controllers.trajectory import TrajectoryController
from frobs_ros.bridge.model import Model

POSITION, VELOCITY, EFFORT = CommandMode.POSITION, CommandMode.VELOCITY, CommandMode.EFFORT


TYPES: Mapping[str, Callable[[Model, str, Mapping[str, Any]], Controller]] = {
    "joint_state_controller/JointStateController": JointStateController,
    "position_controllers/JointPositionController": partial(Commanded, interface=POSITION, group=False),
    "position_controllers/JointGroupPositionController": partial(Commanded, interface=POSITION, group=True),
    "position_controllers/JointTrajectoryController": partial(TrajectoryController, interface=POSITION),
    "velocity_controllers/JointVelocityController": partial(Commanded, interface=VELOCITY, group=False),
    "velocity_controllers/JointGroupVelocityController": partial(Commanded, interface=VELOCITY, group=True),
    "velocity_controllers/JointPositionController": partial(
        Regulated, interface=VELOCITY, follows=POSITION, group=False
    ),
    "velocity_controllers/JointTrajectoryController": partial(TrajectoryController, interface=VELOCITY),
    "effort_controllers/JointEffortController": partial(Commanded, interface=EFFORT, group=False),
    "effort_controllers/JointGroupEffortController": partial(Commanded, interface=EFFORT, group=True),
    "effort_controllers/JointPositionController": partial(Regulated, interface=EFFORT, follows=POSITION, group=False),
    "effort_controllers/JointGroupPositionController": partial(
        Regulated, interface=EFFORT, follows=POSITION, group=True
    ),
    "effort_controllers/JointVelocityController": partial(Regulated, interface=EFFORT, follows=VELOCITY, group=False),
    "effort_controllers/JointTrajectoryController": partial(TrajectoryController, interface=EFFORT),
    "diff_drive_controller/DiffDriveController": DiffDriveController,
}
"""Functions that create a controller from the robot, the topic namespace and the parameters, by controller type."""
