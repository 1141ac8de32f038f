"""Collision shapes of a robot's scene and their poses."""

from __future__ import annotations

from typing import Any

from frobs_controllers_planning.kinematics import Kinematics, se3
from frobs_core.description import Scene
from frobs_core.models import Collision, home_positions


def shapes(scene: Scene) -> dict[str, list[Collision]]:
    """Return the collision shapes of a scene by body name. Links of additional robots are named ``"robot/link"``."""
    collisions = {name: list(body.collisions) for name, body in scene.bodies.items() if body.collisions}
    for name, placement in scene.all_robots({}).items():
        for link in placement.model.links:
            if link.collisions:
                collisions[f"{name}/{link.name}"] = list(link.collisions)
    return collisions


def poses(scene: Scene) -> dict[str, Any]:
    """Return the bodies' poses in the world frame at reset, with additional robots at home, as Pinocchio SE3."""
    placements = {name: se3(body.pose) for name, body in scene.bodies.items() if body.collisions}
    for name, placement in scene.all_robots({}).items():
        kinematics, home = Kinematics(placement.model), home_positions(placement.model, placement.robot.home)
        for link in placement.model.links:
            if link.collisions:
                placements[f"{name}/{link.name}"] = se3(placement.pose) * kinematics.frame_pose(link.name, home)
    return placements
