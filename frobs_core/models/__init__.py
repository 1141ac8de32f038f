"""Robot model files, read without an engine."""

from frobs_core.models.bounds import drawn_points, link_bounds, lowest_points, robot_bounds, shape_points
from frobs_core.models.defaults import (
    BANDWIDTH,
    TOOL_NAMES,
    composite_inertia,
    default_gains,
    default_tcp,
    home_positions,
    usual_rank,
)
from frobs_core.models.elements import ELEMENTS, elements
from frobs_core.models.fingerprint import fingerprint
from frobs_core.models.inertia import inertia_matrix, parallel_axis
from frobs_core.models.kinematics import MOVING, compose, forward_kinematics, joint_path, longest_reach, moved
from frobs_core.models.load import ENDINGS, load_model, open_document, read_document
from frobs_core.models.meshes import MeshPart, Rgba, bounding_box, joined, read_mesh, scaled, write_stl
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
from frobs_core.models.resources import Packages, package_name, packages_below, path_folders, resolve_path
from frobs_core.models.solids import solid_inertial
from frobs_core.models.tree import check_tree, check_unique, flatten_mimics, joints_below, outward
from frobs_core.models.urdf import read_joint, read_urdf
from frobs_core.models.xacro_files import expand_xacro
from frobs_core.models.xmltree import Element, parse_xml, read_bytes

__all__ = [
    "BANDWIDTH",
    "ELEMENTS",
    "ENDINGS",
    "MOVING",
    "RULES",
    "TOOL_NAMES",
    "Box",
    "Capsule",
    "Collision",
    "Cylinder",
    "Element",
    "Geometry",
    "Inertial",
    "Joint",
    "JointLimits",
    "JointType",
    "Link",
    "Mesh",
    "MeshPart",
    "Mimic",
    "Note",
    "Packages",
    "Pose",
    "Rgba",
    "RobotModel",
    "Rule",
    "Sphere",
    "Treatment",
    "Vector3",
    "Visual",
    "bounding_box",
    "check_tree",
    "check_unique",
    "compose",
    "composite_inertia",
    "default_gains",
    "default_tcp",
    "drawn_points",
    "elements",
    "expand_xacro",
    "fingerprint",
    "flatten_mimics",
    "forward_kinematics",
    "home_positions",
    "inertia_matrix",
    "joined",
    "joint_path",
    "joints_below",
    "link_bounds",
    "load_model",
    "longest_reach",
    "lowest_points",
    "moved",
    "open_document",
    "outward",
    "package_name",
    "packages_below",
    "parallel_axis",
    "parse_xml",
    "path_folders",
    "read_bytes",
    "read_document",
    "read_joint",
    "read_mesh",
    "read_urdf",
    "resolve_path",
    "robot_bounds",
    "scaled",
    "shape_points",
    "solid_inertial",
    "usual_rank",
    "write_stl",
]
