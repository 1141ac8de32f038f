"""The controller diff_drive_controller/DiffDriveController, which drives wheels and publishes odometry."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from frobs_core.contracts import CommandMode
from frobs_core.description import DifferentialDrive
from frobs_ros.bridge.controllers.controller import Controller, listed
from frobs_ros.bridge.differential_drive import DriveSettings, Driving
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.world import World
from frobs_ros.errors import ControllerError


class DiffDriveController(Driving, Controller):
    """Controller that follows twists from ``cmd_vel`` and publishes odometry on ``odom`` and as a transform.

    The parameters ``wheel_separation`` and ``wheel_radius`` are required. Unlike ros_control, this controller does not
    derive the two values from the robot's file.

    Args:
        parameters: Supported keys are ``left_wheel``, ``right_wheel``, ``wheel_separation``, ``wheel_radius``, the
            multipliers of these two lengths, limits under ``linear/x`` and ``angular/z``, ``cmd_vel_timeout``,
            ``publish_rate``, ``base_frame_id``, ``odom_frame_id`` and ``enable_odom_tf``.
    """

    def __init__(self, model: Model, topic: str, parameters: Mapping[str, Any]) -> None:
        rate = float(parameters.get("publish_rate", 50.0))
        super().__init__(model, topic, parameters, CommandMode.VELOCITY, rate)
        left, right = listed(parameters, "left_wheel"), listed(parameters, "right_wheel")
        self.claim([*left, *right])
        for name in ("wheel_separation", "wheel_radius"):
            if not float(parameters.get(name, 0.0)) > 0.0:
                raise ControllerError(topic, f"the parameter {name} [m] is required and must be above 0.")
        linear, angular = (parameters.get(a, {}).get(b, {}) for a, b in (("linear", "x"), ("angular", "z")))
        wheels = DifferentialDrive(
            left=tuple(left),
            right=tuple(right),
            separation=float(parameters["wheel_separation"])
            * float(parameters.get("wheel_separation_multiplier", 1.0)),
            wheel_radius=float(parameters["wheel_radius"]) * float(parameters.get("wheel_radius_multiplier", 1.0)),
            max_linear_velocity=_limit(linear, "velocity"),
            max_angular_velocity=_limit(angular, "velocity"),
            max_linear_acceleration=_limit(linear, "acceleration"),
            max_angular_acceleration=_limit(angular, "acceleration"),
        )
        settings = DriveSettings(
            wheels=wheels,
            command=f"{topic}/cmd_vel",
            odom=f"{topic}/odom",
            frame=parameters.get("odom_frame_id", "odom"),
            child=parameters.get("base_frame_id", "base_link"),
            tf=parameters.get("enable_odom_tf", True),
            timeout=float(parameters.get("cmd_vel_timeout", 0.5)),
        )
        self.connect(model, settings)

    def start(self, world: World) -> None:
        """Take control of the wheels."""
        super().start(world)
        self.begin(world)
        self._last_stamp_ns = -1


def _limit(limits: Mapping[str, Any], kind: str) -> float:
    return abs(float(limits[f"max_{kind}"])) if limits.get(f"has_{kind}_limits") else math.inf
