"""Fingers of a gripper: which joints move them, where they point, how they close, and the gap between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from frobs_core.models import Joint, JointType, RobotModel, home_positions
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import UnsuitableRobotError
from frobs_core.util.rotations import matrix_from_quat
from frobs_models.grippers.structure import Structure, Tree
from frobs_models.grippers.surfaces import Surfaces

_MOVED = 0.004  # [m] minimum mean motion of a finger that a joint moves
_FULL_TURN, _HALF_TURN = 6.0, 1.6  # [rad] range of a joint without real limits, and the part of it that is used
_SHARES = np.linspace(0.0, 1.0, 9)
_MOST_JOINTS = 4
"""Maximum number of actuated joints of a gripper. A hand with more joints needs a plan for each finger."""
_DEPTH, _LEVEL = 0.03, 0.004  # [m] depth of the pads from the tips, and the distance between levels
_OVERLAP = 0.02  # [m] by which the sides overlap behind the pads, where they are no pads
_TIP = 0.01  # [m] depth of a tip
_NARROW, _WIDE = 0.004, 0.012  # [m] limits of half the width of the strip in which the gap is measured


class Faces(NamedTuple):
    """Inner faces of the two sides of a gripper, in the axes of the tool.

    Attributes:
        tip: Depth of the tips [m]: how far both sides reach along the direction of approach.
        middle: Middle of the pads across the direction of approach and of closing [m].
        levels: Depth, upper face and lower face at k levels, (k, 3) [m].
    """

    tip: float
    middle: float
    levels: Floats

    @property
    def widths(self) -> Floats:
        """Distance between the faces at each level, (k,) [m]. It is negative where the sides overlap."""
        return np.asarray(self.levels[:, 1] - self.levels[:, 2])


class Fingers:
    """Fingers of a gripper. Positions are relative to the palm.

    Attributes:
        joints: Actuated joints that move fingers.
        unused: Names of the actuated joints behind the palm that move no finger.
        axes: Tool axes in the frame of the palm, as columns, (3, 3): x, direction of closing y, direction of approach z.
        sides: Bodies on each side, first those with the larger y.
        tips: Bodies at the ends of the fingers.
        certainty: Agreement of the fingers with the direction of approach. Below 0.6, the direction is uncertain.

    Raises:
        UnsuitableRobotError: The robot has no fingers.
    """

    def __init__(self, model: RobotModel, structure: Structure) -> None:
        self.model, self.structure = model, structure
        tree, bodies = Tree(model), [joint.child for joint in structure.fingers]
        self.surfaces = Surfaces(model, structure.palm, bodies)
        self._home = home_positions(model, {})
        behind = {joint.name: joint for joint in structure.fingers}
        actuated = [behind[name] for name in model.joint_names if name in behind]
        self._ranges = {joint.name: limits for joint in actuated if (limits := _range(joint))}
        tips = [body for body in bodies if not tree.joints(body) and body in self.surfaces]
        motions = {name: {body: self._motion(name, body) for body in tips} for name in self._ranges}
        self.joints = [
            joint for joint in actuated if any(_length(m) > _MOVED for m in motions.get(joint.name, {}).values())
        ]
        self.unused = [joint.name for joint in actuated if joint not in self.joints]
        if not structure.arm:
            raise _unsuitable(model, "its root carries several moving parts, as that of a robot with legs or two arms")
        names = [joint.name for joint in self.joints]
        if not names:
            shown = ", ".join(joint.name for joint in structure.fingers)
            unlimited = [joint.name for joint in actuated if joint.name not in self._ranges]
            if unlimited:
                verb = "has" if len(unlimited) == 1 else "have"
                reason = f"{', '.join(unlimited)} {verb} no limits, so it is unknown how far the fingers open"
                raise _unsuitable(model, reason)
            raise _unsuitable(model, f"the joints behind the arm ({shown}) move no finger")
        if len(names) > _MOST_JOINTS:
            reason = (
                f"{len(names)} drives move the parts behind '{structure.palm}'; a gripper has at most {_MOST_JOINTS}"
            )
            raise _unsuitable(model, reason)
        self.tips = [body for body in tips if any(_length(motions[name][body]) > _MOVED for name in names)]
        moved = [motions[name][body].mean(axis=0) for name in names for body in self.tips]
        self.axes, self.certainty = self._find_axes(np.array([m for m in moved if _length(m) > 0.5 * _MOVED] or moved))
        self.sides = self._find_sides()

    def positions(self, values: Mapping[str, float]) -> Floats:
        """Return joint positions (dof,) in which the named joints have given positions [rad or m]."""
        positions = self._home.copy()
        for name, value in values.items():
            positions[self.model.joint_names.index(name)] = value
        return positions

    def at(self, shares: Mapping[str, float] | float) -> Floats:
        """Return joint positions (dof,) for shares of the joints' ranges, from 0 (lower limit) to 1 (upper limit)."""
        given = shares if isinstance(shares, Mapping) else {joint.name: shares for joint in self.joints}
        return self.positions({name: self.value(name, share) for name, share in given.items()})

    def value(self, joint: str, share: float) -> float:
        """Return the position of a joint [rad or m] at a share of its range."""
        low, high = self._ranges[joint]
        return self.clipped(joint, low + share * (high - low))

    def clipped(self, joint: str, value: float) -> float:
        """Return a position of a joint [rad or m] inside its range, because rounding can exceed a limit."""
        return float(np.clip(value, *self._ranges[joint]))

    def points(self, side: int, joint_positions: Floats) -> Floats:
        """Return the surface points of one side in the axes of the tool, (n, 3) [m]."""
        return self._of(self.sides[side], joint_positions) @ self.axes

    def faces(self, joint_positions: Floats) -> Faces:
        """Return the inner faces of the pads."""
        upper, lower = (self.points(side, joint_positions) for side in (0, 1))
        if not len(upper) or not len(lower):
            return Faces(0.0, 0.0, np.zeros((0, 3)))
        tip = min(upper[:, 2].max(), lower[:, 2].max())
        upper, lower = (each[(each[:, 2] > tip - _DEPTH) & (each[:, 2] <= tip)] for each in (upper, lower))
        if not len(upper) or not len(lower):
            return Faces(float(tip), 0.0, np.zeros((0, 3)))
        left, right = max(upper[:, 0].min(), lower[:, 0].min()), min(upper[:, 0].max(), lower[:, 0].max())
        middle, half = 0.5 * (left + right), float(np.clip(0.5 * (right - left), _NARROW, _WIDE))
        upper, lower = (each[np.abs(each[:, 0] - middle) < half] for each in (upper, lower))
        levels: list[tuple[float, float, float]] = []
        for depth in np.arange(tip - 0.003, tip - _DEPTH, -_LEVEL):
            above, below = (each[np.abs(each[:, 2] - depth) < _LEVEL, 1] for each in (upper, lower))
            if len(above) and len(below):
                if self.structure.palm in self.sides[0]:  # the palm also has faces on the far side of the jaw
                    above = _beyond(above, np.median(below))
                if self.structure.palm in self.sides[1]:
                    below = -_beyond(-below, -np.median(above))
                level = (depth, above.min(), below.max())
                width, before = level[1] - level[2], levels[-1][1] - levels[-1][2] if levels else 0.0
                if width < 0.0 and before - width > _OVERLAP:
                    break  # here begin the carriages of the fingers, which pass each other
                levels.append(level)
        return Faces(float(tip), float(middle), np.array(levels).reshape(-1, 3))

    def gap(self, joint_positions: Floats) -> float:
        """Return the narrowest distance between the pads [m], or −1 if they do not face each other."""
        widths = self.faces(joint_positions).widths
        return float(widths.min()) if len(widths) else -1.0

    def tip_distance(self, joint_positions: Floats) -> float:
        """Return the distance between the centers of the tips of the two sides [m], or 0 if a side has no surface."""
        sides = [self.points(side, joint_positions) for side in (0, 1)]
        if not all(map(len, sides)):
            return 0.0
        first, second = (each[each[:, 2] > each[:, 2].max() - _TIP].mean(axis=0) for each in sides)
        return float(np.linalg.norm(first - second))

    def _of(self, bodies: Sequence[str], joint_positions: Floats) -> Floats:
        return np.concatenate([self.surfaces.points(body, joint_positions) for body in bodies])

    def _motion(self, joint: str, body: str) -> Floats:
        """Return the motion of each point of a body over the range of a joint, (n, 3) [m]."""
        low, high = (self.positions({joint: value}) for value in self._ranges[joint])
        return self.surfaces.points(body, high) - self.surfaces.points(body, low)

    def _find_axes(self, motions: Floats) -> tuple[Floats, float]:
        """Return the axes of the tool, and how well the fingers agree with the direction of approach.

        Both directions are axes of a frame that is fixed to the palm, or of the last joint of the arm. Two fingers point
        in the direction of approach and close across it; a single jaw points in it and turns about an axis across it.
        """
        candidates = self._candidates()
        closing = np.linalg.svd(motions, full_matrices=False)[2][0]
        if self.structure.has_one_jaw and self.joints[0].type is JointType.REVOLUTE:
            along, about = self._jaw()
            last = np.array(self.structure.arm[-1].axis)
            scores = candidates @ along + 0.5 * np.abs(candidates @ last) - np.abs(candidates @ about)
        else:
            center = self._of(self.tips, self.at(0.5)).mean(axis=0)
            scores = candidates @ (center / np.linalg.norm(center)) - 0.7 * np.abs(candidates @ closing)
        best = int(np.argmax(scores))
        approach = candidates[best]
        closing = closing - approach * (closing @ approach)
        closing /= np.linalg.norm(closing)
        across = candidates[np.abs(candidates @ approach) < 0.1]
        if len(across) and (across @ closing).max() > 0.94:
            closing = across[int(np.argmax(across @ closing))]
            closing = closing - approach * (closing @ approach)
            closing /= np.linalg.norm(closing)
        return np.stack([np.cross(closing, approach), closing, approach], axis=1), float(scores[best])

    def _candidates(self) -> Floats:
        """Return unit vectors in the frame of the palm: the axes of its links and of the arm's last joint, (n, 3)."""
        palm = self.structure.palm
        _, turn = self.surfaces.pose(palm, self._home)
        frames = [turn.T @ self.surfaces.pose(link, self._home)[1] for link in Tree(self.model).links(palm)]
        vectors = np.concatenate([np.array(self.structure.arm[-1].axis)[None], *(frame.T for frame in frames)])
        return np.concatenate([vectors, -vectors])

    def _jaw(self) -> tuple[Floats, Floats]:
        """Return the mean direction of a jaw from its joint to its tip, and the axis of the joint, (3,) each."""
        (joint,) = self.joints
        origin, turn = np.array(joint.origin.pos), matrix_from_quat(np.array(joint.origin.quat_wxyz))
        if joint.parent != self.structure.palm:
            pos, rotation = self.surfaces.pose(joint.parent, self._home)
            palm, axes = self.surfaces.pose(self.structure.palm, self._home)
            origin, turn = (rotation @ origin + pos - palm) @ axes, axes.T @ rotation @ turn
        total = np.zeros(3)
        for share in _SHARES:
            points = self._of(self.tips, self.at(float(share))) - origin
            distances = np.linalg.norm(points, axis=1)
            total += points[distances > 0.8 * distances.max()].mean(axis=0) / distances.max()
        return total / np.linalg.norm(total), turn @ np.array(joint.axis)

    def _find_sides(self) -> tuple[list[str], list[str]]:
        """Return the bodies on each side. The counterpart of a single finger is the palm."""
        middle = self.at(0.5)
        if len(self.tips) > 1:
            heights = {body: float((self._of([body], middle) @ self.axes)[:, 1].mean()) for body in self.tips}
            mean = float(np.mean([*heights.values()]))
            return [b for b in self.tips if heights[b] > mean], [b for b in self.tips if heights[b] <= mean]
        palm = [self.structure.palm]
        jaw = self._of(self.tips, middle) @ self.axes
        base = self._of(palm, middle) @ self.axes
        beside = base[base[:, 2] > np.quantile(jaw[:, 2], 0.5), 1]
        end = jaw[jaw[:, 2] > np.quantile(jaw[:, 2], 0.6), 1].mean()
        return (self.tips, palm) if end > (beside.mean() if len(beside) else 0.0) else (palm, self.tips)


def _unsuitable(model: RobotModel, reason: str) -> UnsuitableRobotError:
    return UnsuitableRobotError(model.name, f"has no gripper that FRobs recognizes: {reason}.")


def _range(joint: Joint) -> tuple[float, float] | None:
    """Return the range of a joint that can move a finger, or None if the joint has no limits."""
    low, high = joint.limits.lower, joint.limits.upper
    if joint.type is JointType.CONTINUOUS or not np.isfinite([low, high]).all():
        return None
    if joint.type is JointType.REVOLUTE and high - low > _FULL_TURN:
        return max(low, -_HALF_TURN), min(high, _HALF_TURN)
    return low, high


def _length(motion: Floats) -> float:
    """Return the mean length of vectors, (n, 3) or (3,)."""
    return float(np.linalg.norm(motion, axis=-1).mean()) if motion.size else 0.0


def _beyond(values: Floats, least: float) -> Floats:
    """Return the values above a limit, or all values if none is."""
    above = values[values > least]
    return above if len(above) else values
