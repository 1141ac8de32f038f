"""Robot model files, read without an engine."""

from frobs_core.models.defaults import composite_inertia, default_gains, default_tcp, home_positions
from frobs_core.models.elements import ELEMENTS, elements
from frobs_core.models.fingerprint import fingerprint
from frobs_core.models.kinematics import forward_kinematics, joint_path, longest_reach
from frobs_core.models.load import load_model
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
    Vector3,
    Visual,
)
from frobs_core.models.notes import RULES, Note, Rule, Treatment
from frobs_core.models.solids import solid_inertial

__all__ = [
    "ELEMENTS",
    "RULES",
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
    "Note",
    "Pose",
    "RobotModel",
    "Rule",
    "Sphere",
    "Treatment",
    "Vector3",
    "Visual",
    "composite_inertia",
    "default_gains",
    "default_tcp",
    "elements",
    "fingerprint",
    "forward_kinematics",
    "home_positions",
    "joint_path",
    "load_model",
    "longest_reach",
    "solid_inertial",
]
