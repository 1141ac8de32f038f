"""Robot model files, read without an engine."""

from frobs_core.models.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Inertial,
    Joint,
    JointLimits,
    JointType,
    Link,
    Mesh,
    Mimic,
    Pose,
    RobotModel,
    Sphere,
    Visual,
)

__all__ = [
    "Box",
    "Capsule",
    "Collision",
    "Cylinder",
    "Geometry",
    "Inertial",
    "Joint",
    "JointLimits",
    "JointType",
    "Link",
    "Mesh",
    "Mimic",
    "Pose",
    "RobotModel",
    "Sphere",
    "Visual",
]
