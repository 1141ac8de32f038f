"""The types of controllers that there are, by the names of ros_control."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from frobs_core.interfaces import CommandMode
from frobs_ros.bridge.controllers.controller import Controller
from frobs_ros.bridge.controllers.diff_drive import DiffDriveController
from frobs_ros.bridge.controllers.group import Commanded, Regulated
from frobs_ros.bridge.controllers.joint_state import JointStateController
from frobs_ros.bridge.controllers.trajectory import TrajectoryController
from frobs_ros.bridge.model import Model

POSITION, VELOCITY, EFFORT = CommandMode.POSITION, CommandMode.VELOCITY, CommandMode.EFFORT


def _commanded(interface: CommandMode, *, group: bool) -> Callable[..., Controller]:
    return partial(Commanded, interface=interface, group=group)


def _regulated(interface: CommandMode, follows: CommandMode, *, group: bool) -> Callable[..., Controller]:
    return partial(Regulated, interface=interface, follows=follows, group=group)


TYPES: Mapping[str, Callable[[Model, str, Mapping[str, Any]], Controller]] = {
    "joint_state_controller/JointStateController": JointStateController,
    "position_controllers/JointPositionController": _commanded(POSITION, group=False),
    "position_controllers/JointGroupPositionController": _commanded(POSITION, group=True),
    "position_controllers/JointTrajectoryController": partial(TrajectoryController, interface=POSITION),
    "velocity_controllers/JointVelocityController": _commanded(VELOCITY, group=False),
    "velocity_controllers/JointGroupVelocityController": _commanded(VELOCITY, group=True),
    "velocity_controllers/JointPositionController": _regulated(VELOCITY, POSITION, group=False),
    "velocity_controllers/JointTrajectoryController": partial(TrajectoryController, interface=VELOCITY),
    "effort_controllers/JointEffortController": _commanded(EFFORT, group=False),
    "effort_controllers/JointGroupEffortController": _commanded(EFFORT, group=True),
    "effort_controllers/JointPositionController": _regulated(EFFORT, POSITION, group=False),
    "effort_controllers/JointGroupPositionController": _regulated(EFFORT, POSITION, group=True),
    "effort_controllers/JointVelocityController": _regulated(EFFORT, VELOCITY, group=False),
    "effort_controllers/JointTrajectoryController": partial(TrajectoryController, interface=EFFORT),
    "diff_drive_controller/DiffDriveController": DiffDriveController,
}
"""What makes a controller from the robot, the namespace of its topics, and its parameters."""
