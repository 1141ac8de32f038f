"""Finds the gripper of an arm: joints, tool center point, open and closed positions, and the object that fits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from frobs_core.models import MOVING, Pose, RobotModel
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ParameterValueError, UnsuitableRobotError, check_name
from frobs_core.util.rotations import quat_from_matrix, quat_from_rpy, rpy_from_quat
from frobs_models.grippers.fingers import Fingers
from frobs_models.grippers.loops import without_loops
from frobs_models.grippers.structure import Structure, Tree, arm_joints, find_structure, stated_structure

if TYPE_CHECKING:
    from frobs_models.grippers.statement import Positions, StatedGripper

_LEAST_GAP, _LEAST_STROKE = 0.015, 0.012  # [m] of the open gripper, and by which the gap changes
_SIZES = (0.015, 0.04)  # [m] smallest and largest object
_PADS = 0.003  # [m] levels at most this much wider than the narrowest one belong to the pads
_TIP = 0.008  # [m] minimum distance of the tool center point from the tips
_BELOW = 0.004  # [m] height above the floor of the deepest finger when a cube on the floor is gripped
_JAW = 0.008  # [m] distance of a turned cube from the fixed jaw
_CERTAIN = 0.6
_STEPS = np.linspace(0.0, 1.0, 41)
_LEAST_JOINTS = 3  # of an arm on a robot with several chains
_LIMB = 5  # number of moving joints in series that no finger has
_DECIMALS, _ANGLE_DECIMALS = 6, 9  # of rounded numbers, so that a file that states them describes the same gripper

TURNED = 1.2247
"""Width of a cube that is turned by 15 degrees, relative to its edge."""


@dataclass(frozen=True, kw_only=True)
class Gripper:
    """A gripper that was found in a model.

    Attributes:
        arm: Actuated joints of the arm, from the root to the palm.
        palm: Root link of the body that carries the fingers.
        joints: Actuated joints of the fingers.
        unused: Actuated joints behind the palm that move no finger, such as those of a propeller.
        pads: Links that touch an object, from both sides.
        has_one_jaw: Whether a single jaw closes on the palm.
        tcp: Tool center point in the frame of ``palm``: z is the direction of approach, and the fingers close along y.
        open: Positions of ``joints`` with the widest gap [rad or m].
        closed: Positions of ``joints`` with the narrowest gap [rad or m].
        gap: Distance between the pads of the closed and of the open gripper [m]; 0 if the closed pads touch.
        object_size: Edge of the cube that the gripper grasps best [m].
        clearance: Distance between the pads of the open gripper and a cube of this size that is turned by 15° [m].
        levers: Motion of a pad per motion of each joint, at the width of the cube [m/rad or m/m].
        controller: Default controller of ``joints``.
        notes: What is uncertain, in sentences.
    """

    arm: tuple[str, ...]
    palm: str
    joints: tuple[str, ...]
    unused: tuple[str, ...]
    pads: tuple[str, ...]
    has_one_jaw: bool
    tcp: Pose
    open: Mapping[str, float]
    closed: Mapping[str, float]
    gap: tuple[float, float]
    object_size: float
    clearance: float
    levers: Mapping[str, float]
    controller: str = "gripper_delta"
    notes: tuple[str, ...] = ()

    def statement(self) -> dict[str, Any]:
        """Return the settings that state this gripper, for :func:`find_gripper`."""
        settings = {name: getattr(self, name) for name in ("joints", "arm", "palm", "pads", "open", "closed")}
        settings["fixed_jaw"] = self.has_one_jaw
        settings["tcp"] = {"pos": list(self.tcp.pos), "rpy": _rounded_rpy(self.tcp.quat_wxyz)}
        settings |= {name: getattr(self, name) for name in ("gap", "levers", "controller")}
        return {
            name: dict(value) if isinstance(value, Mapping) else list(value) if isinstance(value, tuple) else value
            for name, value in settings.items()
        }


def find_gripper(model: RobotModel, stated: Mapping[str, Any] | None = None) -> Gripper:
    """Find the gripper of an arm from the shapes of its links. Names are not used.

    Args:
        model: Model of the arm.
        stated: What is known about the gripper, with the keys of
            :class:`~frobs_models.grippers.statement.StatedGripper`, such as ``{"joints": ["finger_joint"]}``. If it
            contains the joints, the tool center point, the open and closed positions and the gap, nothing is measured.

    Raises:
        UnsuitableRobotError: The robot has no gripper that can hold an object. The message contains the measured gap.
        ConfigurationError: A statement is invalid or contradicts the model.
    """
    from frobs_models.grippers.statement import read_statement  # imports pydantic

    model = without_loops(model)
    known = read_statement(model, stated or {})
    selected = known.joints or known.palm is not None
    structure = stated_structure(model, known.joints, known.palm) if selected else find_structure(model)
    if selected and not structure.fingers:
        raise ParameterValueError("gripper.joints", list(known.joints), f"joints behind the palm '{structure.palm}'")
    try:
        longest = max(map(Tree(model).depth, structure.fingers), default=0)
        if not selected and longest >= _LIMB:
            reason = f"up to {longest} joints follow each other behind '{structure.palm}', in arms, legs or the fingers of a hand"
            raise UnsuitableRobotError(model.name, f"has no gripper that FRobs recognizes: {reason}.")
        found = _stated(model, structure, known) if known.is_complete else _measured(model, structure, known)
    except UnsuitableRobotError:
        if not selected and (others := find_grippers(model)):
            raise UnsuitableRobotError(model.name, _choose_one(others)) from None
        raise
    for name in known.levers:
        check_name(f"finger joint of '{model.name}'", name, found.joints)
    changes: dict[str, Any] = {name: value for name in ("arm", "pads", "gap") if (value := getattr(known, name))}
    changes["levers"] = {**found.levers, **known.levers}
    if known.fixed_jaw is not None:
        changes["has_one_jaw"] = known.fixed_jaw
    if known.tcp is not None:
        a, b, c, d = quat_from_rpy(known.tcp.rpy).tolist()
        changes |= {"tcp": Pose(known.tcp.pos, (a, b, c, d)), "palm": known.palm or structure.palm}
    found = replace(found, **changes, controller=known.controller)
    size = object_size(found.gap, found.has_one_jaw)
    return replace(found, object_size=size, clearance=object_clearance(found.gap, found.has_one_jaw, size))


def find_grippers(model: RobotModel) -> list[Gripper]:
    """Return the grippers at the ends of the arms of a robot with several arms, or with arms and other chains."""
    tree, found = Tree(model), []
    for joint in model.joints:
        arm, behind = arm_joints(model, joint.child), tree.joints(joint.child)
        if joint.type not in MOVING or not behind or len(arm) < max(_LEAST_JOINTS, *map(tree.depth, behind)):
            continue
        if len(behind) > 1 or not tree.joints(behind[0].child):  # fingers, or the last joint of a chain
            with suppress(UnsuitableRobotError):
                found.append(find_gripper(model, {"palm": joint.child}))
    return found


def _choose_one(grippers: Sequence[Gripper]) -> str:
    names = ", ".join(f"{' and '.join(map(repr, each.joints))} on '{each.palm}'" for each in grippers)
    example = ",".join(grippers[0].joints)
    return (
        f"has several arms or other chains; the joints of its grippers are {names}. Choose a gripper by its joints "
        f"(--gripper {example}, or gripper='{example}'), or by a link that it carries (--tcp LINK, or tcp='LINK')."
    )


def _stated(model: RobotModel, structure: Structure, known: StatedGripper) -> Gripper:
    """Return a gripper for which everything that has to be measured is stated."""
    assert known.gap is not None
    tree, sides = Tree(model), 1 if len(structure.fingers) == 1 else 2
    rate = (known.gap[1] - known.gap[0]) / sides
    return Gripper(
        arm=_actuated(model, structure),
        palm=structure.palm,
        joints=known.joints,
        unused=(),
        pads=tuple(link for joint in structure.fingers for link in tree.links(joint.child)),
        has_one_jaw=sides == 1,
        tcp=Pose(),
        open=known.open,
        closed=known.closed,
        gap=known.gap,
        object_size=0.0,
        clearance=0.0,
        levers={name: rate / max(abs(known.open[name] - known.closed[name]), 1e-9) for name in known.joints},
    )


def _actuated(model: RobotModel, structure: Structure) -> tuple[str, ...]:
    return tuple(joint.name for joint in structure.arm if joint.name in model.joint_names)


def _rounded(value: float) -> float:
    return round(value, _DECIMALS) + 0.0  # no negative zero


def _rounded_rpy(quat_wxyz: npt.ArrayLike) -> list[float]:
    """Return roll, pitch and yaw [rad], rounded. An angle of more than half a turn would be another one when read."""
    most = np.floor(np.pi * 10**_ANGLE_DECIMALS) / 10**_ANGLE_DECIMALS
    return [float(np.clip(round(angle, _ANGLE_DECIMALS), -most, most)) + 0.0 for angle in rpy_from_quat(quat_wxyz)]


def _measured(model: RobotModel, structure: Structure, known: StatedGripper) -> Gripper:
    """Return the gripper that is found in a structure, with the positions that are stated."""
    fingers = Fingers(model, structure)
    for name in (*known.open, *known.closed):
        check_name(f"finger joint of '{model.name}'", name, [joint.name for joint in fingers.joints])
    stroke = _Stroke(fingers, known.open, known.closed)
    one_jaw = structure.palm in (*fingers.sides[0], *fingers.sides[1])
    size = object_size(stroke.gap, one_jaw)
    holding = stroke.share_of(size)
    tcp = _place_tcp(fingers, stroke, size, holding)
    sides = 1 if one_jaw else 2
    first, second = max(holding - 0.15, 0.0), min(holding + 0.15, 1.0)
    rate = abs(stroke.gap_at(second) - stroke.gap_at(first)) / (second - first) / sides
    tree = Tree(model)
    missing = sorted(set(fingers.surfaces.missing))
    notes = [f"the meshes of {', '.join(missing)} cannot be read, so these links were ignored"] if missing else []
    if fingers.certainty < _CERTAIN:
        notes.append(f"the direction in which the fingers point is uncertain ({fingers.certainty:.2f} of 1)")
    return Gripper(
        arm=_actuated(model, structure),
        palm=structure.palm,
        joints=tuple(joint.name for joint in fingers.joints),
        unused=tuple(fingers.unused),
        pads=tuple(link for side in fingers.sides for body in side for link in tree.links(body)),
        has_one_jaw=one_jaw,
        tcp=tcp,
        open={name: fingers.clipped(name, _rounded(value)) for name, value in stroke.open.items()},
        closed={name: fingers.clipped(name, _rounded(value)) for name, value in stroke.closed.items()},
        gap=stroke.gap,
        object_size=size,
        clearance=0.0,
        levers={name: _rounded(rate / max(abs(stroke.open[name] - stroke.closed[name]), 1e-9)) for name in stroke.open},
        notes=tuple(notes),
    )


def object_size(gap: tuple[float, float], has_fixed_jaw: bool) -> float:
    """Return the edge of the cube that a gripper grasps best [m]: about half of the open gap.

    Args:
        gap: Distances between the pads of the closed and the open gripper [m].
        has_fixed_jaw: Whether one of the pads does not move.
    """
    narrow, wide = gap
    share = 0.42 if has_fixed_jaw else 0.5
    return round(max(float(np.clip(share * wide, *_SIZES)), narrow + 0.008), 4)


def object_clearance(gap: tuple[float, float], has_fixed_jaw: bool, size: float) -> float:
    """Return the distance between the pads of the open gripper and a cube that is turned by 15° [m].

    Args:
        gap: Distances between the pads of the closed and the open gripper [m].
        has_fixed_jaw: Whether one of the pads does not move.
        size: Edge of the cube [m].
    """
    if has_fixed_jaw:
        return _jaw_offset(gap, size) - 0.5 * TURNED * size
    return 0.5 * (gap[1] - TURNED * size)


def _jaw_offset(gap: tuple[float, float], size: float) -> float:
    """Return the distance of the tool center point from a fixed jaw [m]."""
    return min(0.5 * TURNED * size + _JAW, max(0.5 * gap[1], size / 2 + 0.002))


class _Stroke:
    """Motion of the fingers between the closed (0) and the open (1) positions."""

    def __init__(self, fingers: Fingers, opened: Positions, closed: Positions) -> None:
        self._fingers = fingers
        names = [joint.name for joint in fingers.joints]
        middle = dict.fromkeys(names, 0.5)
        opens = {}  # share of each joint's range at which the gap is wider
        for name in names:
            ends = [fingers.at({**middle, name: share}) for share in (0.0, 1.0)]
            low, high = (max(fingers.gap(end), 0.0) for end in ends)
            if abs(high - low) < _LEAST_STROKE:  # a jaw that opens wide ends behind the pads, where the gap is also 0
                low, high = (fingers.tip_distance(end) for end in ends)
            opens[name] = 0.0 if low > high else 1.0
        self.closed = {name: fingers.value(name, 1.0 - share) for name, share in opens.items()}
        self.open = {name: fingers.value(name, share) for name, share in opens.items()}
        if opened or closed:
            self.open, self.closed = {**self.open, **opened}, {**self.closed, **closed}
        gaps = np.array([self.gap_at(share) for share in _STEPS])
        if gaps.max() < _LEAST_GAP or gaps.max() - max(gaps.min(), 0.0) < _LEAST_STROKE:
            raise _no_stroke(fingers, max(float(gaps.min()), 0.0), max(float(gaps.max()), 0.0))
        top = int(np.argmax(gaps))
        touching = np.flatnonzero(gaps[: top + 1] <= 0.0)
        bottom = touching[-1] if len(touching) else int(np.argmin(gaps[: top + 1]))
        top, bottom = len(gaps) - 1 if opened else top, 0 if closed else bottom
        self.gap = _rounded(max(float(gaps[bottom]), 0.0)), _rounded(float(gaps[top]))
        self.closed, self.open = self._values(_STEPS[bottom]), self._values(_STEPS[top])

    def positions(self, share: float) -> Floats:
        """Return joint positions (dof,) at a share of the stroke."""
        return self._fingers.positions(self._values(share))

    def gap_at(self, share: float) -> float:
        """Return the gap at a share of the stroke [m]."""
        return self._fingers.gap(self.positions(share))

    def share_of(self, width: float) -> float:
        """Return the share of the stroke at which the gap has a given width [m]."""
        gaps = np.array([self.gap_at(share) for share in _STEPS])
        return float(_STEPS[int(np.argmin(np.abs(gaps - width)))])

    def _values(self, share: float) -> dict[str, float]:
        values = {name: value + float(share) * (self.open[name] - value) for name, value in self.closed.items()}
        return {name: self._fingers.clipped(name, value) for name, value in values.items()}


def _no_stroke(fingers: Fingers, low: float, high: float) -> UnsuitableRobotError:
    names = ", ".join(f"'{joint.name}'" for joint in fingers.joints)
    least = f"a gripper opens to at least {1000 * _LEAST_GAP:.0f} mm, and by at least {1000 * _LEAST_STROKE:.0f} mm"
    reason = f"{names} opens the parts that it moves from {1000 * low:.0f} to {1000 * high:.0f} mm; {least}"
    if fingers.structure.has_one_jaw and high < _LEAST_GAP:
        reason = (
            f"its last joint, {names}, closes on no other part of the robot, so there are no fingers; "
            "FRobs cannot grasp with suction or with fingers that do not move"
        )
    return UnsuitableRobotError(fingers.model.name, f"has no gripper that FRobs recognizes: {reason}.")


def _place_tcp(fingers: Fingers, stroke: _Stroke, size: float, holding: float) -> Pose:
    """Return the tool center point in the frame of the palm, for a cube with an edge of ``size`` [m].

    The tool center point is between the pads when they are as wide apart as the cube, at the share ``holding`` of the
    stroke, deep enough for the pads to hold the cube, and so deep that no finger touches the floor under the cube.
    Beside a fixed jaw, there is room for a cube that is turned.
    """
    faces = fingers.faces(stroke.positions(holding))
    widths = faces.widths
    pads = faces.levels[widths < widths.min() + _PADS]
    ways = [stroke.positions(share) for share in np.linspace(holding, 1.0, 5)]
    deepest = max(fingers.points(side, positions)[:, 2].max() for side in (0, 1) for positions in ways)
    depth = max(min(faces.tip - _TIP, pads[:, 0].max()), deepest - (size / 2 - _BELOW))
    _, upper, lower = faces.levels[int(np.argmin(np.abs(faces.levels[:, 0] - depth)))]
    palm, offset = fingers.structure.palm, _jaw_offset(stroke.gap, size)
    if palm in fingers.sides[0]:
        across = upper - offset
    elif palm in fingers.sides[1]:
        across = lower + offset
    else:
        across = 0.5 * (upper + lower)
    x, y, z = (_rounded(value) for value in (fingers.axes @ np.array([faces.middle, across, depth])).tolist())
    a, b, c, d = quat_from_rpy(_rounded_rpy(quat_from_matrix(fingers.axes))).tolist()
    return Pose((x, y, z), (a, b, c, d))
