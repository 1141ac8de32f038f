"""The model of a robot and what can be computed from it. Plugins read model files."""

from frobs_core.deprecation import moved_names
from frobs_core.models.defaults import (
    BANDWIDTH,
    TOOL_NAMES,
    composite_inertia,
    default_gains,
    default_tcp,
    home_positions,
    usual_rank,
)
from frobs_core.models.inertia import inertia_matrix, parallel_axis, symmetric_matrix
from frobs_core.models.kinematics import (
    MOVING,
    compose,
    forward_kinematics,
    joint_path,
    longest_reach,
    moved,
    outward,
    pose_array,
    pose_from_array,
)
from frobs_core.models.load import find_reader, is_model_file, load_model
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
from frobs_core.models.notes import Note, Treatment
from frobs_core.models.solids import solid, solid_inertial

__getattr__ = moved_names(__name__)

__all__ = [
    "BANDWIDTH",
    "MOVING",
    "TOOL_NAMES",
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
    "Sphere",
    "Treatment",
    "Vector3",
    "Visual",
    "compose",
    "composite_inertia",
    "default_gains",
    "default_tcp",
    "find_reader",
    "forward_kinematics",
    "home_positions",
    "inertia_matrix",
    "is_model_file",
    "joint_path",
    "load_model",
    "longest_reach",
    "moved",
    "outward",
    "parallel_axis",
    "pose_array",
    "pose_from_array",
    "solid",
    "solid_inertial",
    "symmetric_matrix",
    "usual_rank",
]
