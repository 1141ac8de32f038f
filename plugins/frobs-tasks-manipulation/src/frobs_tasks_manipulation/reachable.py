"""Whether an arm can work in an area: its start posture, or an error with a value that would work."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from frobs_core.contracts import Controller, RobotHandle
from frobs_core.description import EndEffector
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ParameterValueError, UnsuitableRobotError
from frobs_core.util.rotations import quat_multiply
from frobs_core.util.validation import numbers
from frobs_tasks_manipulation.posture import CLEARANCE, DAMPING, YAW, ToolKinematics

if TYPE_CHECKING:
    from frobs_tasks_manipulation.tool import Grasp

_HALF = np.sqrt(0.5)
_DOWN = (0.0, 1.0, 0.0, 0.0)
_ORIENTATIONS = {"y": np.array(_DOWN), "x": quat_multiply((_HALF, 0.0, 0.0, _HALF), _DOWN)}
"""Orientation (w, x, y, z) of a tool that points down, by the world axis along which the fingers close."""

NEAR = (0.008, 0.08)
"""Maximum errors of the tool at the corners of the area [m], [rad]."""

_PLAY = 0.005  # [m] minimum difference between the open gap and an object
_FEW = 16  # random postures for each of many alternatives
_BY_YAW = "it could with another yaw"
_POINTING = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
_SHARES = (0.85, 0.7, 0.5, 0.35)  # of the area or the height, that are suggested
_MOST = 64  # start postures that are kept
_found: dict[tuple[object, ...], Floats] = {}  # start postures, because the same environment is often built again
_YAWS = (0.0, np.pi / 2, -np.pi / 2, np.pi / 4, -np.pi / 4)  # [rad]


@dataclass(frozen=True, kw_only=True)
class Workspace:
    """Where a tool works: it starts above the center of a square area and points down.

    Attributes:
        center: Center (x, y) of the area [m].
        area: Side length of the area [m].
        start_height: Height of the tool at the start of an episode [m].
        lowest: Height at which the tool works in the whole area [m].
        raised: How far above that it also works [m], by the parameter of the task.
        grasp: How the tool approaches objects.
        finger_axis: World axis along which the fingers close, unless the grasp turns it: ``"x"`` or ``"y"``.
        size: Width of the objects that the gripper grasps [m], or 0.
    """

    center: tuple[float, float]
    area: float
    start_height: float
    lowest: float
    raised: Mapping[str, float]
    grasp: Grasp
    finger_axis: str
    size: float

    def poses(self) -> tuple[Floats, Floats]:
        """Return the poses that the tool must reach, (n, 3) [m] and (n, 4): the first is the start."""
        half, (x, y) = self.area / 2, self.center
        heights = [self.lowest + up for up in (0.0, *self.raised.values())]
        corners = [(x + a * half, y + b * half, z) for z in heights for a in (-1, 1) for b in (-1, 1)]
        points = np.array([(x, y, self.start_height), *corners])
        return points, self.grasp.turned(np.tile(_ORIENTATIONS[self.finger_axis], (len(points), 1)), points)


def start_posture(robot: RobotHandle, gripper: EndEffector, controller: Controller | None, place: Workspace) -> Floats:
    """Return the joint positions at which the tool is above the center of the area, (dof,) [rad or m].

    Raises:
        UnsuitableRobotError: The gripper cannot grasp the objects, or the tool cannot reach a part of the area.
    """
    low, high = _target_box(controller)
    arrays = [robot.position_lower[0], robot.position_upper[0], robot.home[0], *(each[0] for each in robot.base_pose)]
    bounds = tuple(each.tobytes() for each in (*arrays, low, high))
    key = robot.model.xml, robot.tcp, bounds, _weights(controller), gripper.gap, repr(place)
    if key not in _found:
        while len(_found) >= _MOST:
            del _found[next(iter(_found))]
        _found[key] = _search_start(robot, gripper, controller, place)
    return _found[key].copy()


def _target_box(controller: Controller | None) -> tuple[Floats, Floats]:
    return getattr(controller, "target_box", (np.full(3, -np.inf), np.full(3, np.inf)))


def _weights(controller: Controller | None) -> tuple[float, float]:
    """Return damping [m/rad] and posture gain of a controller's inverse kinematics."""
    return getattr(controller, "damping", DAMPING), getattr(controller, "posture_gain", 0.0)


def _search_start(robot: RobotHandle, gripper: EndEffector, controller: Controller | None, place: Workspace) -> Floats:
    name, (low, high) = robot.robot.name, _target_box(controller)
    _check_size(name, gripper, place.size)
    arm = ToolKinematics.of(robot, place.grasp.radial)
    start, missed = _try(arm, place, controller=controller)
    if missed is None and start is not None:
        points, _ = place.poses()
        if ((points < low - 1e-6) | (points > high + 1e-6)).any():
            box = [np.minimum(low, points.min(axis=0) - 0.02), np.maximum(high, points.max(axis=0) + 0.08)]
            box[0][2] = min(low[2], points[:, 2].min())
            found = {key: side.round(3).tolist() for key, side in zip(("target_low", "target_high"), box, strict=True)}
            raise UnsuitableRobotError(
                name,
                f"is kept out of a part of the working area by its controller, which limits the tool to the box "
                f"{numbers(low)} to {numbers(high)} m; choose controller_kwargs={found}.",
            )
        return start
    points, quats = place.poses()
    index = 0 if missed is None else missed
    reason = _constraint(arm, points[index], quats[index], robot)
    for words, other in _alternatives(place, index == 0, reason == _BY_YAW):
        corners, _ = other.poses()
        inside = ((corners >= low - 1e-6) & (corners <= high + 1e-6)).all()
        if inside and _try(arm, other, _FEW, controller)[1] is None:
            advice = f"choose {words}."
            break
    else:
        advice = (
            "no other center=, area= or yaw helps; another robot does, or fit=True, which fits the task to this one."
        )
    raise UnsuitableRobotError(
        name, f"cannot reach {numbers(points[index])} m with its tool '{robot.tcp}' pointing down: {reason}; {advice}"
    )


def _check_size(name: str, gripper: EndEffector, size: float) -> None:
    """Check that a gripper can grasp an object."""
    narrow, wide = gripper.gap or (0.0, np.inf)
    advice = f"objects of {1e3 * size:.0f} mm; choose size={0.5 * (narrow + 0.9 * wide):.3g}."
    if size > wide - _PLAY:
        raise UnsuitableRobotError(name, f"opens its gripper by {1e3 * wide:.0f} mm, too little for {advice}")
    if 0.0 < size <= narrow:
        raise UnsuitableRobotError(name, f"closes its gripper to {1e3 * narrow:.0f} mm, too wide for {advice}")


def _try(
    arm: ToolKinematics, place: Workspace, seeds: int = 64, controller: Controller | None = None
) -> tuple[Floats | None, int | None]:
    """Return the joint positions at the start, or None, and the index of a pose that the tool cannot reach, or None."""
    points, quats = place.poses()
    start = arm.find(points[0], quats[0], seeds=seeds)
    if start is None:
        return None, 0
    arm = replace(arm, rest=start)
    postures = np.tile(start[arm.columns], (len(points), 1))
    damping, gain = _weights(controller)
    for share in np.repeat(np.linspace(0.125, 1.0, 8), 2):
        via = points[0] + share * (points - points[0])
        postures = arm.solve(postures, via, quats, 1, damping, posture_gain=gain)
    postures = arm.solve(postures, points, quats, 12, damping, posture_gain=gain)
    error = np.abs(arm.error(postures, points, quats)).reshape(-1, 2, 3).max(axis=2)
    for index in np.flatnonzero((error > NEAR).any(axis=1)):
        if arm.find(points[index], quats[index], near=NEAR, seeds=seeds) is None:  # from other postures
            return start, int(index)
    return start, None


def _constraint(arm: ToolKinematics, pos: Floats, quat: Floats, robot: RobotHandle) -> str:
    """Return what keeps the tool from a pose."""
    if arm.counting(_POINTING).find(pos, quat, near=NEAR, floor=False, seeds=_FEW) is None:
        postures = np.random.default_rng(0).uniform(arm.low, arm.high, (20_000, len(arm.columns)))
        at = arm.pose(postures)[0]
        base, level = robot.base_pose[0][0], np.abs(at[:, 2] - pos[2]) < 0.05
        reach = np.linalg.norm((at[level] - base)[:, :2], axis=1).max(initial=0.0)
        away = np.linalg.norm((pos - base)[:2])
        return f"the place is {away:.2f} m from the base, and the reach at this height is {reach:.2f} m"
    if arm.counting(YAW).find(pos, quat, near=NEAR, seeds=_FEW) is not None:
        return _BY_YAW
    low = arm.find(pos, quat, near=NEAR, floor=False, seeds=_FEW)
    if low is not None:
        height = arm.lowest(low[None, arm.columns])[0]
        return f"a link would be {100 * height:.0f} cm above the floor, and needs {100 * CLEARANCE:.0f} cm"
    wide = arm.widened(np.pi).find(pos, quat, near=NEAR, seeds=_FEW)
    if wide is None:
        return "it can get there, but not point down"
    needed = wide[arm.columns]
    joint = int(np.maximum(arm.low - needed, needed - arm.high).argmax())
    limit = arm.low[joint] if needed[joint] < arm.low[joint] else arm.high[joint]
    name = robot.joint_names[arm.columns[joint]]
    return f"joint '{name}' would have to move to {needed[joint]:.2f}, beyond its limit of {limit:.2f}"


def _alternatives(place: Workspace, is_start: bool, by_yaw: bool) -> Iterator[tuple[str, Workspace]]:
    """Yield other areas, the most similar first, and the keywords for them."""
    grasp = place.grasp
    for yaw in (each for each in _YAWS if by_yaw and abs(each - grasp.yaw) > 0.1):
        other = replace(grasp, yaw=round(yaw, 4))
        shown = {field.name: getattr(other, field.name) for field in fields(other)}
        shown = {name: value for name, value in shown.items() if name == "yaw" or value != getattr(type(other), name)}
        yield f"grasp={shown}", replace(place, grasp=other)
    if is_start:
        for share in (0.8, 1.25, 0.6, 1.6, 2.0, 0.4):
            height = round(share * place.start_height, 3)
            yield f"start_height={height}", replace(place, start_height=height)
    else:
        for share in _SHARES:
            area = round(share * place.area, 3)
            yield f"area={area}", replace(place, area=area)
        for name, up in place.raised.items():
            for share in _SHARES if name != "size" else ():
                raised = round(share * up, 3)
                yield f"{name}={raised}", replace(place, raised={**place.raised, name: raised})
    away = np.array(place.center)
    direction = away / max(float(np.linalg.norm(away)), 1e-9) if away.any() else np.array([1.0, 0.0])
    for share in (1.0, *_SHARES[1:]):
        for distance in sorted(np.arange(0.15, 1.2, 0.05), key=lambda each: abs(each - np.linalg.norm(away))):
            x, y = (distance * direction).round(3).tolist()
            area, words = round(share * place.area, 3), f"center={[x, y]}"
            yield words if share == 1.0 else f"{words}, area={area}", replace(place, center=(x, y), area=area)


def workspace_of(task: Any) -> Workspace:
    """Return where the tool of a task works.

    Raises:
        ParameterValueError: The area is too small for the task.
    """
    tolerance = task.tolerance if "goal" in task.reset_options else 0.0
    least = getattr(task, "least_area", tolerance)
    if task.area <= least:
        small = least == tolerance
        advice = f"the tolerance; choose tolerance={task.area / 5:.3g}" if small else f"choose area={2.5 * least:.3g}"
        raise ParameterValueError("area", task.area, f"above {least:.3g} m, {advice}")
    return Workspace(
        center=tuple(task.center.tolist()),
        area=task.area,
        start_height=task.start_height,
        lowest=getattr(task, "rest_height", task.start_height),
        raised={name: getattr(task, name) for name in task.raised_by},
        grasp=task.grasp,
        finger_axis=task.finger_axis,
        size=getattr(task, "size", 0.0) if task.start_opening else 0.0,
    )
