"""Divides the kinematic tree of an arm into arm, palm and fingers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile

from frobs_core.models import MOVING, Joint, JointType, RobotModel, joint_path

_LONGER = 3
"""Number of joints by which one branch must be longer than the others to be the arm, as on a base with wheels."""


@dataclass(frozen=True)
class Structure:
    """Parts of an arm with a device at its end.

    Attributes:
        arm: Moving joints from the root to the palm, in order.
        palm: Root link of the rigid body that carries the fingers.
        fingers: Moving joints behind the palm, each after the joint that moves its parent link.
        has_one_jaw: Whether only the last joint of a chain without branches can be a jaw, which closes on the palm.
    """

    arm: tuple[Joint, ...]
    palm: str
    fingers: tuple[Joint, ...]
    has_one_jaw: bool


class Tree:
    """Rigid bodies of a model: links that fixed joints join, each named after the link that is nearest to the root."""

    def __init__(self, model: RobotModel) -> None:
        self._below: dict[str, list[Joint]] = {}
        for joint in model.joints:
            self._below.setdefault(joint.parent, []).append(joint)

    def links(self, body: str) -> list[str]:
        """Return the links of a body."""
        found, waiting = [], [body]
        while waiting:
            found.append(link := waiting.pop())
            waiting += [joint.child for joint in self._below.get(link, ()) if joint.type not in MOVING]
        return found

    def joints(self, body: str) -> list[Joint]:
        """Return the moving joints that a body carries."""
        return [joint for link in self.links(body) for joint in self._below.get(link, ()) if joint.type in MOVING]

    def joints_behind(self, joints: Sequence[Joint]) -> list[Joint]:
        """Return moving joints and all moving joints behind them."""
        found, waiting = [], list(joints)
        while waiting:
            found.append(joint := waiting.pop(0))
            waiting += self.joints(joint.child)
        return found

    def depth(self, joint: Joint) -> int:
        """Return the largest number of moving joints in series, from a joint to a tip."""
        return 1 + max((self.depth(each) for each in self.joints(joint.child)), default=0)


def find_structure(model: RobotModel) -> Structure:
    """Return the parts of an arm.

    From the root, the arm follows the only moving joint of each body, or the only branch that is much longer than the
    others. The body at which it ends carries the fingers. If the chain has no branches, its last joint is a jaw.
    """
    tree = Tree(model)
    chain: list[Joint] = []
    joints = tree.joints(model.root)
    while joints:
        if len(joints) > 1:
            depths = sorted((tree.depth(joint) for joint in joints), reverse=True)
            if depths[0] < depths[1] + _LONGER:
                break
            joints = [max(joints, key=tree.depth)]
        chain += joints
        joints = tree.joints(joints[0].child)
    if not joints:
        *chain, jaw = chain or [_root_joint(model)]
        return Structure(tuple(chain), chain[-1].child if chain else model.root, (jaw,), has_one_jaw=True)
    palm = chain[-1].child if chain else model.root
    return Structure(tuple(chain), palm, tuple(tree.joints_behind(joints)), has_one_jaw=False)


def stated_structure(model: RobotModel, joints: Sequence[str], palm: str | None = None) -> Structure:
    """Return the parts of a model whose fingers, palm, or both are known.

    Args:
        model: Model of the robot.
        joints: Actuated joints that move the fingers. If empty, all joints behind the palm do.
        palm: A link of the body that carries the fingers. By default, this is the last body that all finger joints have
            behind them.
    """
    if palm is None:
        chains = [arm_joints(model, joint.parent) for joint in model.joints if joint.name in joints]
        arm = [each[0] for each in takewhile(lambda each: len({j.name for j in each}) == 1, zip(*chains, strict=False))]
    else:
        arm = arm_joints(model, palm)
    tree, body = Tree(model), arm[-1].child if arm else model.root
    fingers = tree.joints_behind(tree.joints(body))
    if joints:
        fingers = [joint for joint in fingers if (leader := model.leader(joint)) and leader.joint in joints]
    return Structure(tuple(arm), body, tuple(fingers), has_one_jaw=len(fingers) == 1)


def arm_joints(model: RobotModel, link: str) -> list[Joint]:
    """Return the moving joints from the root to a link."""
    return [joint for joint in joint_path(model, link) if joint.type in MOVING]


def _root_joint(model: RobotModel) -> Joint:
    """Return a joint that does not move, for a model without moving joints."""
    return Joint(name="", type=JointType.FIXED, parent=model.root, child=model.root)
