"""Tells the links of fingers from those of an arm, to find a tool that is not a finger."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from frobs_core.models import MOVING, Joint, RobotModel
from frobs_core.util.errors import FrobsError, check_name
from frobs_models.grippers.gripper import find_gripper
from frobs_models.grippers.structure import Tree, arm_joints, find_structure, stated_structure

_LEAST_JOINTS = 3  # of an arm
_JAW_RANGE = np.pi  # [rad] or [m]; a last joint with a larger range turns the tool


def finger_links(model: RobotModel, joints: Sequence[str] = ()) -> set[str]:
    """Return the links of the fingers. For arguments, see ``ModelReader.finger_links``.

    Several short chains at the end of a longer one are fingers. Whether the last joint of an arm is a jaw is measured.
    """
    for name in joints:
        check_name(f"actuated joint of '{model.name}'", name, model.joint_names)
    tree = Tree(model)
    if joints:
        return _links_behind(tree, stated_structure(model, joints).palm)
    found = set()
    for joint in model.joints:
        fingers, arm = tree.joints(joint.child), arm_joints(model, joint.child)
        if joint.type in MOVING and len(fingers) > 1 and len(arm) >= max(_LEAST_JOINTS, *map(tree.depth, fingers)):
            found |= _links_behind(tree, joint.child)
    structure = find_structure(model)
    if structure.has_one_jaw and len(structure.arm) >= _LEAST_JOINTS and _is_jaw(model, structure.fingers[0]):
        found |= _links_behind(tree, structure.palm)
    return found


def _links_behind(tree: Tree, body: str) -> set[str]:
    return {link for joint in tree.joints_behind(tree.joints(body)) for link in tree.links(joint.child)}


def _is_jaw(model: RobotModel, joint: Joint) -> bool:
    if not joint.limits.upper - joint.limits.lower < _JAW_RANGE:
        return False
    try:
        find_gripper(model)
    except FrobsError:
        return False
    return True
