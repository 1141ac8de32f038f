"""Checks that links and joints form a tree."""

from __future__ import annotations

from frobs_core.models.model import Joint, JointType, RobotModel
from frobs_core.util.errors import ModelFileError


def outward(model: RobotModel) -> list[Joint]:
    """Return the joints, sorted so that each joint comes after the joint that moves its parent link."""
    below: dict[str, list[Joint]] = {}
    for joint in model.joints:
        below.setdefault(joint.parent, []).append(joint)
    found: list[Joint] = []
    waiting = [model.root]
    while waiting:
        joints = below.get(waiting.pop(), [])
        found += joints
        waiting += [joint.child for joint in joints]
    return found


def joints_below(model: RobotModel) -> dict[str, list[Joint]]:
    """Return the child joints of each link, by link name.

    Raises:
        ModelFileError: The model has floating or planar joints, which no simulator supports, or passive joints or
            unknown masses, which only MuJoCo supports.
    """
    if model.passive_joints:
        raise ModelFileError(
            model.path,
            f"the file has no actuators for the joints {', '.join(model.passive_joints)}; only simulator='mujoco' "
            "simulates passive joints.",
        )
    if unknown := [note.element for note in model.notes if note.rule == "mesh-mass"]:
        raise ModelFileError(
            model.path,
            f"the mass of {', '.join(unknown)} depends on shapes that only simulator='mujoco' supports; "
            "add an <inertial>.",
        )
    below: dict[str, list[Joint]] = {}
    for joint in model.joints:
        if joint.type in (JointType.FLOATING, JointType.PLANAR):
            raise ModelFileError(
                model.path,
                f"joint '{joint.name}' is {joint.type.value}; only revolute, continuous, prismatic and fixed joints "
                "can be simulated. For a free base, set base='floating' in the robot's description.",
            )
        below.setdefault(joint.parent, []).append(joint)
    return below
