"""Fits working area, object and step sizes of a task to an arm that was not designed for the task."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from frobs_core.contracts import Fitted
from frobs_core.description import EndEffector, Robot
from frobs_core.models import MOVING, RobotModel, gravity_efforts, home_positions, joint_path
from frobs_core.plugins.records import ControllerDefaults
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import UnsuitableRobotError
from frobs_core.util.files import cache_folder, read_json, write_json
from frobs_core.util.rotations import quat_conjugate, quat_from_axis_angle, quat_multiply, quat_rotate
from frobs_models import TURNED, fingerprint, gripper_space, object_clearance, object_size, shapes_points
from frobs_tasks_manipulation.experts.push import push_distance
from frobs_tasks_manipulation.lift import Lift
from frobs_tasks_manipulation.manipulation import ObjectTask
from frobs_tasks_manipulation.pick_and_place import PickAndPlace
from frobs_tasks_manipulation.posture import YAW, ToolKinematics
from frobs_tasks_manipulation.push import Push
from frobs_tasks_manipulation.reachable import NEAR
from frobs_tasks_manipulation.stack import Stack

_VERSION = 7
CONTROL_TIMESTEP = 0.04  # [s] of the manipulation tasks
_DOWN = (0.0, 1.0, 0.0, 0.0)
_UP = np.array([0.0, 0.0, 1.0])
_USUAL_REACH = 0.85  # [m] of the arms for which the tasks were designed
_SIDE, _HIGHEST, _START = 0.3, 0.25, 0.12  # [m] area, height of goals and of the tool at that reach
_DAMPING, _POSTURE_GAIN = 0.1, 0.02  # of ``tcp_delta_pose``
_RADII = np.linspace(0.3, 0.75, 6)  # distances of the area from the base, in multiples of the reach
_DIRECTIONS = ((0.0,), (-np.pi / 2, np.pi / 2, np.pi))  # [rad] of the area from the base: first in front of it
_YAWS = (0.0, np.pi / 2, -np.pi / 2, np.pi / 4, -np.pi / 4)  # [rad]
_HEIGHTS = (1.0, 0.6, 0.35, 0.2)  # of the goals, if the arm is not tall enough for higher ones
_SIDES = (1.0, 0.85, 0.7, 0.6, 0.5)  # of the area, in multiples of that side
_ENOUGH = 0.69  # share of that side for which lower goals are accepted
_LEAST_SIDE, _LEAST_SIDE_REACH = 0.09, 0.35  # [m] minimum side length of the area of an arm with that reach
_GAP_SHARE = 0.4  # minimum size of the object relative to the open gap
_WIDER = 1.5  # [rad or m] by which joint limits are widened to find out whether they are the reason
_CLEARANCE = 0.02  # [m] height of all links above the floor
_NEARER = tuple(0.75 * each for each in NEAR)  # so that fitted values are accepted when the task is bound
_SEEDS, _ITERATIONS, _SEARCH_DAMPING = 48, 60, 0.03
_HOPELESS = 0.05  # [m, rad] smallest error after half of the iterations at which the search for a posture ends
_GAP = (0.0, 0.08)  # [m] gap of a gripper whose description does not state the gap
_USUAL_SPEED = 2.0  # [rad/s or m/s] of a joint without a velocity limit


@dataclass(frozen=True, kw_only=True)
class Fit:
    """Settings that fit an arm.

    Attributes:
        center: Center (x, y) of the working area [m].
        side: Side length of the working area [m].
        yaw: Rotation of the tool, and of the objects, about the vertical axis [rad].
        radial: Whether the tool turns with its direction from the base, because the arm has no axis for the yaw.
        highest: Maximum height of a goal [m].
        start_height: Height of the tool at the start of an episode [m].
        size: Edge of a cube that fits the gripper [m].
        scale: Size of the arm relative to those for which the tasks were designed, at most 1.
        max_delta: Largest step of the tool that all joints can follow [m].
        home: Posture with the tool above the center of the area [rad or m], by joint name.
        reach: Largest horizontal distance of the tool from the base [m].
        hand: Lengths ``depth``, ``room``, ``width`` and ``sides`` of the gripper, as in :class:`~frobs_tasks_manipulation.tool.Grasp`.
        aligned: Maximum position error at which the tool is considered aligned with the object [m].
        closed_at: Position of the closed fingers along the tool's y axis [m].
        pushing_side: Side length of the area in which the tool gets behind each side of an object to push it [m].
    """

    center: tuple[float, float]
    side: float
    yaw: float
    radial: bool
    highest: float
    start_height: float
    size: float
    scale: float
    max_delta: float
    home: dict[str, float]
    reach: float
    hand: dict[str, Any]
    aligned: float
    closed_at: float
    pushing_side: float


def fit(robot: Robot, model: RobotModel) -> Fit:
    """Fit the working area to an arm.

    The area is as large as that of the usual arms, relative to the arm's reach, and smaller if the arm cannot serve it
    with a tool that points down. Whether it can is found by replaying the inverse kinematics of the controller.

    Args:
        robot: Description of an arm with a gripper.
        model: Its model.

    Raises:
        UnsuitableRobotError: There is no working area, or the object would not fit.
    """
    content = (_VERSION, fingerprint(model), robot.end_effectors, robot.groups, sorted(robot.home.items()))
    file = cache_folder("fits") / f"{hashlib.sha256(repr(content).encode()).hexdigest()[:16]}.json"
    with suppress(OSError, ValueError, TypeError):  # a missing or damaged file is replaced
        return Fit(**read_json(file))
    found = _search(robot, model)
    with suppress(OSError):
        write_json(file, asdict(found))
    return found


def kinematics(robot: Robot, model: RobotModel) -> _Arm:
    """Return the kinematics of the joints that carry a gripper. For the arguments and errors, see :func:`fit`."""
    return _Arm(robot, model)


def _search(robot: Robot, model: RobotModel) -> Fit:
    """Return the best working area."""
    arm = kinematics(robot, model)
    best = _best(arm, _DIRECTIONS)
    if best is None:
        raise UnsuitableRobotError(robot.name, f"has no working area: {_obstacle(arm)}")
    _check_drives(robot, model, arm, best.home)
    scale, size = arm.scale, arm.size
    pushing_height = size + 0.625 * min(0.08, _clearance(scale, size))
    tip = quat_rotate(arm.orientation(np.array([[*best.center, 0.0]]), best.yaw), [[0.0, arm.closed_at, 0.0]])[0, :2]
    place = replace(best, center=best.center - tip)
    sides = [share * best.side for share in (1.0, *_SIDES[1:]) if share * best.side >= arm.least_side]
    hand = gripper_space(model, arm.tool, robot.home, arm.closed_at)
    margin = 2.0 * float(push_distance(size, arm.aligned, max(hand["sides"])))
    heights = (size / 2, pushing_height)
    fitting = (side for side in sides if arm.served(place, side + margin, heights)[1])
    return Fit(
        center=(float(best.center[0]), float(best.center[1])),
        side=float(best.side),
        yaw=best.yaw,
        radial=arm.radial,
        highest=best.highest,
        start_height=float(size / 2 + _START * scale),
        size=size,
        scale=scale,
        max_delta=float(np.clip(0.8 * arm.speed(best.home), 0.004, 0.02 * max(scale, 0.5))),
        home=dict(zip(arm.joints, best.home.tolist(), strict=True)),
        reach=arm.reach,
        hand=hand,
        aligned=arm.aligned,
        closed_at=arm.closed_at,
        pushing_side=float(next(fitting, sides[-1])),
    )


def _check_drives(robot: Robot, model: RobotModel, arm: _Arm, home: Floats) -> None:
    """Check that the drives are strong enough to hold the arm. Some files limit each drive to 1 N·m."""
    limits = {joint.name: joint.limits.effort for joint in model.actuated_joints}
    weights = np.abs(gravity_efforts(model, arm.complete(home[None])[0])[arm.columns])
    weak = [
        f"joint '{name}' must hold {effort:.1f}, and its limit is {limits[name]:g}"
        for name, effort in zip(arm.joints, weights.tolist(), strict=True)
        if effort > limits[name] > 0.0
    ]
    if weak:
        raise UnsuitableRobotError(
            robot.name,
            f"has drives that are too weak for its own weight [N·m or N]: {'; '.join(weak)}. Correct effort= in the "
            "model file; three times these values would work.",
        )


def _best(arm: _Arm, directions: Sequence[Sequence[float]]) -> _Place | None:
    """Return the best working area in the first directions from the base in which there is one."""
    full_side, best = _SIDE * arm.scale, None
    for some in directions:
        starts = list(_starts(arm, some))
        for share in _HEIGHTS:
            highest = max(share * _HIGHEST * arm.scale, 0.06)
            place = max(_served(arm, starts, highest), key=lambda place: place.score, default=None)
            if place is not None and (best is None or place.side > 1.1 * best.side):
                best = place
            if best is not None and best.side >= _ENOUGH * full_side:
                return best
        if best is not None:
            break
    return best


def _obstacle(arm: _Arm) -> str:
    """Return what keeps the arm from an area of the smallest side, and a value that would work."""
    side = f"an area of {100 * arm.least_side:.0f} cm"
    low_base, wide = copy(arm), copy(arm)
    low_base.base = np.zeros((0, 3))
    place = _best(low_base, _DIRECTIONS[:1])
    if place is not None:
        room = np.linalg.norm(place.center) - place.side / 2 - arm.size
        return (
            f"the base extends to {arm.base_radius():.2f} m in front, where the tool would work; for {side}, it must "
            f"end at {room - 0.005:.2f} m."
        )
    wide.low, wide.high = arm.low - _WIDER, arm.high + _WIDER
    place = _best(wide, _DIRECTIONS[:1])
    if place is not None:
        postures, _ = wide.served(place, place.side, _grid_heights(arm, place.highest))
        low, high = postures.min(axis=0) - 0.1, postures.max(axis=0) + 0.1
        limits = [
            f"joint '{joint}' is limited to [{arm.low[i]:.2f}, {arm.high[i]:.2f}]; [{min(low[i], arm.low[i]):.2f}, "
            f"{max(high[i], arm.high[i]):.2f}] would work"
            for i, joint in enumerate(arm.joints)
            if low[i] < arm.low[i] - 0.1 or high[i] > arm.high[i] + 0.1
        ]
        return f"its joints do not let the tool point down over {side}: {', '.join(limits)}."
    for factor in (2.0,) if len(arm.joints) > 3 else ():
        if _best(arm.enlarged(factor), _DIRECTIONS[:1]) is not None:
            return f"its reach of {arm.reach:.2f} m is too short for {side}; a reach of {factor * arm.reach:.2f} m would work."
    if len(arm.joints) < 4:
        return f"the tool cannot point down in {side} with {len(arm.joints)} axes; four axes would work."
    return f"nowhere on the floor can its tool '{arm.frame}' point down over {side}; its reach is {arm.reach:.2f} m."


def fit_task(task: type[Any], robot: Robot, model: RobotModel) -> Fitted:
    """Return the settings that fit a task to an arm. For the arguments, see ``Task.fitting``; for errors, :func:`fit`."""
    found, tool = fit(robot, model), _gripper(robot)
    if min(found.hand["depth"], found.hand["room"]) <= 0.0:
        raise UnsuitableRobotError(
            robot.name,
            f"does not have its tool center point '{tool.tcp}' between its fingers, but inside a part of the gripper or "
            "beyond the fingertips; choose another link with tcp= (option --tcp), or omit tcp.",
        )
    x, y = found.center
    room = object_clearance(tool.gap or _GAP, tool.has_fixed_jaw, found.size)
    relative, clearance = _relative(found.size), _clearance(found.scale, found.size)
    settings: dict[str, Any] = {
        "center": [x, y],
        "area": found.side,
        "start_height": found.start_height,
        "grasp": {
            "yaw": found.yaw,
            "radial": found.radial,
            "clearance": clearance,
            "aligned": found.aligned,
            "lost": float(0.03 * max(relative, 0.7)),
            "gap": [(tool.gap or _GAP)[0], 2.0 * room + TURNED * found.size],
            **found.hand,
            "closed_at": found.closed_at,
        },
    }
    if issubclass(task, ObjectTask):
        settings |= {
            "size": found.size,
            "mass": round(float(0.1 * np.clip((found.size / 0.04) ** 3, 0.15, 1.0)), 4),
            "tolerance": float(np.clip(found.side / 6, 0.02, 0.05)),
        }
    if issubclass(task, Push):
        settings["area"] = found.pushing_side
    if issubclass(task, PickAndPlace):
        settings["highest"] = found.highest
    if issubclass(task, Stack):
        settings |= {"tolerance": 0.5 * found.size, "released": min(0.07, 0.8 * clearance)}
    if issubclass(task, Lift):
        settings["lowest"] = 0.4 * found.highest
    half, top = found.side / 2 + 0.04 * found.scale + 0.02, found.highest + found.size + clearance
    controller = {
        "max_delta": found.max_delta,
        "axes": ["x", "y", "z"],
        "damping": _DAMPING * found.scale,
        "free_yaw": found.radial,
        "target_low": [x - half, y - half, 0.004],
        "target_high": [x + half, y + half, top],
    }
    return Fitted(task=settings, controller=ControllerDefaults("tcp_delta_pose", controller), home=found.home)


def _relative(size: float) -> float:
    """Return the size of an object relative to those for which the tasks were designed."""
    return float(np.clip(size / 0.04, 0.5, 1.0))


def _clearance(scale: float, size: float) -> float:
    """Return the height above an object from which the tool moves down to it [m]."""
    return max(0.08 * scale, size + 0.01)


def _gripper(robot: Robot) -> EndEffector:
    tool = robot.end_effector_of()
    if tool is None or not tool.is_gripper:
        raise UnsuitableRobotError(
            robot.name, "has no gripper; attach one, as in robot='ARM+parallel_gripper', or pass its model file."
        )
    return tool


def _closed_at(tool: EndEffector, model: RobotModel, size: float) -> float:
    """Return the position of the closed fingers along the tool's y axis [m]: a fixed jaw is beside the object."""
    if tool.gap is None or not tool.has_fixed_jaw:
        return 0.0
    (finger,) = [joint.child for joint in model.joints if joint.name == next(iter(tool.closed))]
    opened, closed = (home_positions(model, fingers)[None] for fingers in (tool.open, tool.closed))
    (pos, quat), (start, turn) = (model.frame_pose(frame, opened) for frame in (tool.tcp, finger))
    end, turned = model.frame_pose(finger, closed)
    moved = end + quat_rotate(turned, quat_rotate(quat_conjugate(turn), pos - start)) - pos  # with the moving jaw
    to_jaw = object_clearance(tool.gap, True, size) + 0.5 * 1.2247 * size  # the clearance is that of a turned cube
    return float(np.copysign(to_jaw - 0.5 * tool.gap[0], quat_rotate(quat_conjugate(quat), moved)[0, 1]))


@dataclass(frozen=True)
class _Place:
    """A working area: its center (2,) [m], yaw [rad], side and height [m], and the posture above its center.

    A better place has a higher score.
    """

    center: Floats
    yaw: float
    home: Floats
    score: float
    side: float = 0.0
    highest: float = 0.0


def _starts(arm: _Arm, directions: Sequence[float]) -> Iterator[_Place]:
    """Yield the places above which the tool can point down, in some directions from the base."""
    for direction in directions:
        for radius in _RADII * arm.reach:
            for yaw in _YAWS[: 3 if arm.radial else None]:
                center = np.array([radius * np.cos(direction), radius * np.sin(direction)])
                home = arm.posture(np.array([*center, arm.size / 2 + _START * arm.scale]), yaw)
                if home is not None:
                    margin, agility = float(arm.margin(home[None])[0]), float(arm.agility(home[None])[0])
                    score = 0.15 * min(margin, 0.5) + 0.5 * min(agility / arm.scale, 0.2)
                    yield _Place(center, yaw, home, score - 0.03 * abs(yaw) - 0.05 * abs(direction))


def _served(arm: _Arm, starts: Sequence[_Place], highest: float) -> Iterator[_Place]:
    """Yield the places with the largest area that the arm can serve up to a height."""
    heights = _grid_heights(arm, highest)
    for start in starts:
        near_base = arm.base_radius(float(np.arctan2(start.center[1], start.center[0]))) + arm.size
        for share in _SIDES:
            side = max(share * _SIDE * arm.scale, arm.least_side)
            inside = np.linalg.norm(start.center) - side / 2 >= near_base
            if inside and arm.served(start, side, heights)[1]:
                yield replace(start, score=start.score + share, side=side, highest=highest)
                break


def _grid_heights(arm: _Arm, highest: float) -> tuple[float, ...]:
    return tuple(arm.size / 2 + share * highest for share in (0.0, 0.35, 1.0))


class _Arm(ToolKinematics):
    """Kinematics of the joints that carry a gripper, in the frame of the base."""

    def __init__(self, robot: Robot, model: RobotModel) -> None:
        self.tool = _gripper(robot)
        self.joints = tuple(robot.groups[self.tool.arm or next(iter(robot.groups))])
        self.radial = len(self.joints) < 5
        columns = [model.joint_names.index(name) for name in self.joints]
        limits = {joint.name: joint.limits for joint in model.actuated_joints}
        chosen = [limits[name] for name in self.joints]  # files name joints in any order
        low, high, fastest = np.array([(each.lower, each.upper, each.velocity) for each in chosen]).T
        links = [joint.child for joint in joint_path(model, self.tool.tcp)[2:]]
        rest, counted = home_positions(model, robot.home), YAW if self.radial else np.ones(6)
        super().__init__(model.frame_pose, self.tool.tcp, links, columns, low, high, rest, counted)
        gap = self.tool.gap or _GAP
        self.size = max(object_size(gap, self.tool.has_fixed_jaw), round(_GAP_SHARE * gap[1] + 5e-5, 4))
        room = object_clearance(gap, self.tool.has_fixed_jaw, self.size)
        self.aligned = float(np.clip(0.7 * room, 0.003, 0.008 * _relative(self.size)))
        self.closed_at = _closed_at(self.tool, model, self.size)
        self.longest = CONTROL_TIMESTEP * np.where(np.isfinite(fastest) & (fastest > 0.0), fastest, _USUAL_SPEED)
        parts = [np.zeros((0, 3))]
        for link in model.links:  # many files begin with a link without shapes, such as 'world'
            if all(joint.type not in MOVING for joint in joint_path(model, link.name)):
                (pos,), (quat,) = model.frame_pose(link.name, rest[None])
                parts += [quat_rotate(quat, shapes_points([shape])) + pos for shape in link.collisions]
        self.base = np.concatenate([part for part in parts if part[:, 2].max(initial=-1.0) > 0.0] or parts[:1])
        postures = np.random.default_rng(0).uniform(self.low, self.high, (20_000, len(self.joints)))
        # the largest horizontal distance of the tool from the base, over random postures [m]
        self.reach = float(np.quantile(np.linalg.norm(self.pose(postures)[0][:, :2], axis=1), 0.995))

    @property
    def scale(self) -> float:
        """Size of the arm relative to those for which the tasks were designed, at most 1."""
        return float(np.clip(self.reach / _USUAL_REACH, 0.3, 1.0))

    @property
    def least_side(self) -> float:
        """Smallest side length of a working area [m]."""
        return max(_SIDES[-1] * _SIDE * self.scale, _LEAST_SIDE if self.reach >= _LEAST_SIDE_REACH else 0.0)

    def enlarged(self, factor: float) -> _Arm:
        """Return a copy whose links are longer by a factor."""
        other = copy(self)
        other.frame_pose = lambda frame, joints: (lambda pose: (factor * pose[0], pose[1]))(
            self.frame_pose(frame, joints)
        )
        other.reach = factor * self.reach
        return other

    def base_radius(self, direction: float = 0.0) -> float:
        """Return how far the base extends in a direction [rad], as high as the object [m]."""
        low = self.base[self.base[:, 2] < self.size + 0.02]
        return float((low[:, :2] @ [np.cos(direction), np.sin(direction)]).max()) if len(low) else 0.0

    def posture(self, pos: Floats, yaw: float) -> Floats | None:
        """Return the best posture with the tool at a place, or None if there is none."""
        seeds = np.random.default_rng(0).uniform(self.low, self.high, (_SEEDS, len(self.joints)))
        quat = self.orientation(pos[None], yaw)[0]
        found = self.solve(seeds, pos, quat, _ITERATIONS // 2, _SEARCH_DAMPING)
        if np.abs(self.error(found, pos, quat)).max(axis=1).min() > _HOPELESS:
            return None
        found = self.solve(found, pos, quat, _ITERATIONS // 2, _SEARCH_DAMPING)
        good = (np.abs(self.error(found, pos, quat)).max(axis=1) < 1e-3) & self._clears(found, pos[2] / 2)
        if not good.any():
            return None
        found = found[good]
        agility = np.minimum(self.agility(found), 0.15) / self.scale
        far = np.abs(found - self.rest[self.columns]).max(axis=1) / np.pi  # twisted postures slow the arm down
        return np.asarray(found[np.argmax(np.minimum(self.margin(found), 0.6) + 2.0 * agility - 0.3 * far)])

    def served(self, start: _Place, side: float, heights: Sequence[float]) -> tuple[Floats, bool]:
        """Return the postures at 9 places of an area at some heights [m], and whether the tool gets to all of them.

        This replays the inverse kinematics of the controller, from the posture above the center.
        """
        grid = np.array([(x, y, 0.0) for x in (-0.5, 0, 0.5) for y in (-0.5, 0, 0.5) for _ in heights])
        targets = np.array([*start.center, 0.0]) + side * grid
        targets[:, 2] = np.tile(heights, 9)
        first = np.array([*start.center, self.size / 2 + _START * self.scale])
        arm = copy(self)
        arm.rest = self.complete(start.home[None])[0]
        postures = np.tile(start.home, (len(grid), 1))
        for share in np.linspace(1 / 16, 1.0, 16):
            points = first + share * (targets - first)
            quat = self.orientation(points, start.yaw)
            postures = arm.solve(postures, points, quat, 1, _DAMPING * self.scale, 3.0 * self.longest, _POSTURE_GAIN)
        quat = self.orientation(targets, start.yaw)
        postures = arm.solve(postures, targets, quat, 12, _DAMPING * self.scale, self.longest, _POSTURE_GAIN)
        error = np.abs(self.error(postures, targets, quat)).reshape(-1, 2, 3).max(axis=2)
        inside = self.margin(postures) > -1e-6
        return postures, bool(
            ((error < _NEARER).all(axis=1) & inside & self._clears(postures, self.size / 2 - 0.004)).all()
        )

    def orientation(self, pos: Floats, yaw: float) -> Floats:
        """Return the orientations (n, 4) of a tool that points down at places (n, 3) [m]."""
        azimuth = np.arctan2(pos[:, 1], pos[:, 0]) if self.radial else np.zeros(len(pos))
        return quat_multiply(quat_from_axis_angle(_UP, azimuth + yaw), np.array(_DOWN))

    def agility(self, postures: Floats) -> Floats:
        """Return the smallest singular value of the Jacobian of the tool's position, (n,) [m/rad]."""
        return np.asarray(np.linalg.svd(self.jacobian(postures)[:, :3], compute_uv=False)[:, -1])

    def speed(self, posture: Floats) -> float:
        """Return how far the tool can move in all directions in a control step, within the velocity limits [m]."""
        inverse = np.linalg.pinv(self.jacobian(posture[None])[0], rcond=0.02)[:, :3]
        return float((self.longest / np.abs(inverse).sum(axis=1).clip(1e-6)).min())

    def _clears(self, postures: Floats, height: float) -> Floats:
        return np.asarray(self.lowest(postures) > min(_CLEARANCE, height))
