"""Reads robot model files and meshes, and analyzes them without a physics engine."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from frobs_models.bounds import drawn_points as drawn_points
    from frobs_models.bounds import link_bounds as link_bounds
    from frobs_models.bounds import lowest_points as lowest_points
    from frobs_models.bounds import random_postures as random_postures
    from frobs_models.bounds import robot_bounds as robot_bounds
    from frobs_models.bounds import shape_points as shape_points
    from frobs_models.bounds import shapes_points as shapes_points
    from frobs_models.element_kinds import ELEMENTS as ELEMENTS
    from frobs_models.element_kinds import elements as elements
    from frobs_models.fingerprints import fingerprint as fingerprint
    from frobs_models.grippers.gripper import TURNED as TURNED
    from frobs_models.grippers.gripper import Gripper as Gripper
    from frobs_models.grippers.gripper import find_gripper as find_gripper
    from frobs_models.grippers.gripper import object_clearance as object_clearance
    from frobs_models.grippers.gripper import object_size as object_size
    from frobs_models.grippers.space import gripper_space as gripper_space
    from frobs_models.grippers.statement import StatedGripper as StatedGripper
    from frobs_models.load import ENDINGS as ENDINGS
    from frobs_models.load import open_document as open_document
    from frobs_models.load import read_document as read_document
    from frobs_models.looks import WrittenLooks as WrittenLooks
    from frobs_models.meshes.convex_parts import convex_parts as convex_parts
    from frobs_models.meshes.mesh import MeshPart as MeshPart
    from frobs_models.meshes.mesh import Rgba as Rgba
    from frobs_models.meshes.mesh import bounding_box as bounding_box
    from frobs_models.meshes.mesh import joined as joined
    from frobs_models.meshes.mesh import read_mesh as read_mesh
    from frobs_models.meshes.mesh import scaled as scaled
    from frobs_models.meshes.mesh import write_stl as write_stl
    from frobs_models.mount import attach as attach
    from frobs_models.notes import RULES as RULES
    from frobs_models.notes import Rule as Rule
    from frobs_models.objects import ObjectModel as ObjectModel
    from frobs_models.objects import read_object as read_object
    from frobs_models.parameters import WrittenParameters as WrittenParameters
    from frobs_models.resources import Packages as Packages
    from frobs_models.resources import package_name as package_name
    from frobs_models.resources import packages_below as packages_below
    from frobs_models.resources import path_folders as path_folders
    from frobs_models.resources import resolve_path as resolve_path
    from frobs_models.translation import TranslationTable as TranslationTable
    from frobs_models.translation import read_tables as read_tables
    from frobs_models.translation import translate as translate
    from frobs_models.tree import check_tree as check_tree
    from frobs_models.tree import check_unique as check_unique
    from frobs_models.tree import flatten_mimics as flatten_mimics
    from frobs_models.tree import joints_below as joints_below
    from frobs_models.urdf.urdf import read_joint as read_joint
    from frobs_models.urdf.urdf import read_urdf as read_urdf
    from frobs_models.urdf.writing import urdf_of as urdf_of
    from frobs_models.xacro.files import expand_xacro as expand_xacro
    from frobs_models.xmltree import Element as Element
    from frobs_models.xmltree import parse_numbers as parse_numbers
    from frobs_models.xmltree import parse_xml as parse_xml
    from frobs_models.xmltree import read_bytes as read_bytes

_MODULES = {
    "ELEMENTS": "frobs_models.element_kinds",
    "ENDINGS": "frobs_models.load",
    "Element": "frobs_models.xmltree",
    "Gripper": "frobs_models.grippers.gripper",
    "MeshPart": "frobs_models.meshes.mesh",
    "ObjectModel": "frobs_models.objects",
    "Packages": "frobs_models.resources",
    "RULES": "frobs_models.notes",
    "Rgba": "frobs_models.meshes.mesh",
    "Rule": "frobs_models.notes",
    "StatedGripper": "frobs_models.grippers.statement",
    "TURNED": "frobs_models.grippers.gripper",
    "TranslationTable": "frobs_models.translation",
    "WrittenLooks": "frobs_models.looks",
    "WrittenParameters": "frobs_models.parameters",
    "attach": "frobs_models.mount",
    "bounding_box": "frobs_models.meshes.mesh",
    "check_tree": "frobs_models.tree",
    "check_unique": "frobs_models.tree",
    "convex_parts": "frobs_models.meshes.convex_parts",
    "drawn_points": "frobs_models.bounds",
    "elements": "frobs_models.element_kinds",
    "expand_xacro": "frobs_models.xacro.files",
    "find_gripper": "frobs_models.grippers.gripper",
    "fingerprint": "frobs_models.fingerprints",
    "flatten_mimics": "frobs_models.tree",
    "gripper_space": "frobs_models.grippers.space",
    "joined": "frobs_models.meshes.mesh",
    "joints_below": "frobs_models.tree",
    "link_bounds": "frobs_models.bounds",
    "lowest_points": "frobs_models.bounds",
    "random_postures": "frobs_models.bounds",
    "object_clearance": "frobs_models.grippers.gripper",
    "object_size": "frobs_models.grippers.gripper",
    "open_document": "frobs_models.load",
    "package_name": "frobs_models.resources",
    "packages_below": "frobs_models.resources",
    "parse_numbers": "frobs_models.xmltree",
    "parse_xml": "frobs_models.xmltree",
    "path_folders": "frobs_models.resources",
    "read_bytes": "frobs_models.xmltree",
    "read_document": "frobs_models.load",
    "read_joint": "frobs_models.urdf.urdf",
    "read_mesh": "frobs_models.meshes.mesh",
    "read_tables": "frobs_models.translation",
    "read_object": "frobs_models.objects",
    "read_urdf": "frobs_models.urdf.urdf",
    "resolve_path": "frobs_models.resources",
    "robot_bounds": "frobs_models.bounds",
    "scaled": "frobs_models.meshes.mesh",
    "shape_points": "frobs_models.bounds",
    "shapes_points": "frobs_models.bounds",
    "translate": "frobs_models.translation",
    "urdf_of": "frobs_models.urdf.writing",
    "write_stl": "frobs_models.meshes.mesh",
}
__all__ = [*_MODULES]


def __getattr__(name: str) -> Any:
    """Import a public name from its module on first use, so that listing plugins imports no reader."""
    if name not in _MODULES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(_MODULES[name]), name)
