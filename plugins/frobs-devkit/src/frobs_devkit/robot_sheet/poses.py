"""Chooses the joint positions that a robot sheet shows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from frobs_core.models import Joint, JointType, RobotModel, home_positions
from frobs_core.util.arrays import Floats

_QUARTER = math.pi / 2.0  # [rad] range in both directions for a joint without limits
_SLIDE = 0.5  # [m] range in both directions for a prismatic joint without limits


@dataclass(frozen=True)
class Shot:
    """One image of a robot sheet."""

    title: str  # of the tile; both shots of a joint have the same title
    caption: str  # text in a corner of the image, or empty
    joint_positions: Floats  # (dof,) [rad or m]


@dataclass(frozen=True)
class Shots:
    """All images of a robot sheet."""

    poses: tuple[Shot, ...]  # at home, and all joints at their lower and their upper limits, if there are joints
    joints: tuple[tuple[Shot, Shot], ...]  # at the lower and upper limit of each joint but wheels, others at home
    left_out: int  # number of omitted joints

    @property
    def all(self) -> tuple[Shot, ...]:
        """All shots: first the poses, then the individual joints."""
        return (*self.poses, *(shot for pair in self.joints for shot in pair))


def choose_shots(model: RobotModel, home: Mapping[str, float], most: int) -> Shots:
    """Choose the images of a robot sheet, with at most ``most`` joints that are shown individually."""
    rest = home_positions(model, home)
    joints = model.actuated_joints
    poses = [Shot("home", "", rest)]
    if joints:
        for title, side in (("all at lower limits", 0), ("all at upper limits", 1)):
            ends = [rest[i] if _free(joint) else _ends(joint)[side] for i, joint in enumerate(joints)]
            poses.append(Shot(title, "", rest * 0.0 + ends))
    pairs = []
    parents = {joint.parent for joint in model.joints}
    # a wheel looks the same at every position
    shown = [(i, joint) for i, joint in enumerate(joints) if joint.child in parents or not _free(joint)]
    for i, joint in shown[:most]:
        low, high = (np.where(np.arange(len(rest)) == i, end, rest) for end in _ends(joint))
        free = ", turns freely" if _free(joint) else ""
        first, second = f"{_text(joint, low[i])}{free}", _text(joint, high[i])
        pairs.append((Shot(joint.name, first, low), Shot(joint.name, second, high)))
    return Shots(tuple(poses), tuple(pairs), len(joints) - len(pairs))


def _free(joint: Joint) -> bool:
    return not (math.isfinite(joint.limits.lower) and math.isfinite(joint.limits.upper))


def _ends(joint: Joint) -> tuple[float, float]:
    """Return the limits of a joint, or positions that show the motion of a joint without limits."""
    far = _SLIDE if joint.type is JointType.PRISMATIC else _QUARTER
    low, high = joint.limits.lower, joint.limits.upper
    return low if math.isfinite(low) else -far, high if math.isfinite(high) else far


def _text(joint: Joint, position: float) -> str:
    """Return the position as text, such as ``"−165°"`` or ``"40 mm"``."""
    if joint.type is JointType.PRISMATIC:
        return f"{1000.0 * position:.0f} mm".replace("-", "−")
    return f"{math.degrees(position):.0f}°".replace("-", "−")
