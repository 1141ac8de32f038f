"""Finds how a tool that points down grasps an object of any shape."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_tasks_manipulation.tool import Grasp
from frobs_tasks_manipulation.working_area import UP

_FLOOR = 0.003  # [m] height of the fingertips above the floor
_SIDE = 0.003  # [m] distance of the open fingers from an object on both sides
_THICKER = 0.002  # [m] by which a grasped object is thicker than the gap of the closed gripper
_OVERLAP = 0.003  # [m] least height of an object between the fingertips
_DIRECTIONS, _LEVELS = 24, 6  # numbers of closing directions and of heights that are tried
_DEEP = 0.001  # [m] depth of the surface that the fingers touch
_ENOUGH, _LEAST = 3.0e-4, 1.2e-5  # [m²] areas between both fingers: of a firm grasp, and the smallest
_TURNS = tuple(np.radians([15.0, 8.0, 3.0]))  # rotations of the object on the floor that are tried
_STABLE = np.radians(10.0)  # angle by which an object can be tilted without falling over
_RESTING = 0.001  # [m] height of the points on which an object rests
_UPS = 12  # number of orientations that are tried


@dataclass(frozen=True, eq=False)
class FoundGrasp:
    """A grasp of an object that rests on the floor.

    Attributes:
        rotation: Orientation of the tool's frame, in which the z axis points up and the fingers close along the y axis,
            in the object's frame, (3, 3).
        pos: Position of the tool center point in the object's frame, (3,) [m].
        height: Height of the tool center point above the floor [m].
        top: Height of the object [m].
        width: Extent of the object between the fingers, at its rotations on the floor [m].
        turn: Largest rotation of the object on the floor from the grasp's direction [rad].
    """

    rotation: Floats
    pos: Floats
    height: float
    top: float
    width: float
    turn: float


def find_grasp(points: Floats, center: Floats, hand: Grasp) -> tuple[FoundGrasp | None, float]:
    """Find a grasp of an object.

    The object keeps its orientation if it is stable on the floor and can be grasped. Otherwise, it is put on another
    side.

    Args:
        points: Points on its surface, (n, 3) [m].
        center: Its center of mass, (3,) [m].
        hand: The gripper's lengths.

    Returns:
        The grasp, or None if the object does not fit the gripper, and the smallest width that was found [m].
    """
    narrowest = np.inf
    for up in _resting(points, center):
        side = np.cross(up, [1.0, 0.0, 0.0] if abs(up[0]) < 0.9 else [0.0, 1.0, 0.0])
        side /= np.linalg.norm(side)
        rotation = np.stack([np.cross(side, up), side, up]) if up[2] < 1.0 - 1e-9 else np.eye(3)
        placed = (points - center) @ rotation.T
        bottom = float(placed[:, 2].min())
        placed[:, 2] -= bottom
        candidates = []
        for angle in np.arange(_DIRECTIONS) * np.pi / _DIRECTIONS:
            for candidate in _along(placed, -bottom, float(angle), hand):
                narrowest = min(narrowest, candidate[2])
                candidates.append(candidate)
        fitting = [each for each in candidates if each[0] > -np.inf]
        for turn in _TURNS:
            for _, pos, _, angle in sorted(fitting, key=lambda each: -each[0])[:40]:
                width = _turned_width(placed, pos, angle, turn, hand)
                if width <= hand.gap[1] - 2 * _SIDE:
                    across = np.array([np.cos(angle), np.sin(angle), 0.0])
                    frame = np.stack([np.cross(across, UP), across, UP])
                    there = center + rotation.T @ (pos + bottom * UP)
                    top = float(placed[:, 2].max())
                    return FoundGrasp((frame @ rotation).T, there, float(pos[2]), top, width, float(turn)), narrowest
    return None, narrowest


def _resting(points: Floats, center: Floats) -> Iterator[Floats]:
    """Yield the directions that point up when the object rests on the floor, its own first, and then the most stable."""
    import trimesh

    if _tilt(points, center, UP) >= _STABLE:
        yield UP
    hull = trimesh.convex.convex_hull(points)
    ups = -np.asarray(hull.face_normals)[np.argsort(-hull.area_faces)]
    kept: list[Floats] = []
    for up in ups:
        if all(up @ other < 0.98 for other in kept) and len(kept) < 4 * _UPS:
            kept.append(up)
    tilts = np.array([_tilt(points, center, up) for up in kept])
    for index in np.argsort(-tilts)[:_UPS]:
        if tilts[index] >= _STABLE or index == np.argmax(tilts):
            yield kept[index]


def _tilt(points: Floats, center: Floats, up: Floats) -> float:
    """Return the angle by which an object can be tilted without falling over [rad]."""
    heights = points @ up
    support = points[heights < heights.min() + _RESTING] - center
    side = np.cross(up, [1.0, 0.0, 0.0] if abs(up[0]) < 0.9 else [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side)
    angles = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    around = np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * np.cross(up, side)
    return float(np.arctan2((support @ around.T).max(axis=0).min(), center @ up - heights.min()))


def _along(
    points: Floats, center_height: float, angle: float, hand: Grasp
) -> Iterator[tuple[float, Floats, float, float]]:
    """Yield grasps along a direction: score (−∞ if it is impossible), position of the tool (3,), width, and direction.

    The points are relative to the center of mass and the floor.
    """
    c, s = np.cos(angle), np.sin(angle)
    a, b, z = c * points[:, 0] + s * points[:, 1], c * points[:, 1] - s * points[:, 0], points[:, 2]
    top = float(z.max())
    cell = max(0.002, float(max(np.ptp(b), top)) / 60)
    columns, rows = ((b - b.min()) / cell).astype(int), (z / cell).astype(int)
    shape = columns.max() + 1, rows.max() + 1
    low, high = np.full(shape, np.inf), np.full(shape, -np.inf)
    np.minimum.at(low, (columns, rows), a)
    np.maximum.at(high, (columns, rows), a)
    lowest = max(_FLOOR, top - hand.room - hand.depth + _SIDE)
    highest = max(top - 3 * _OVERLAP, lowest)
    half = max(round(hand.width / cell / 2), 1)
    step = max(half // 2, 1)
    for tip in np.linspace(lowest, highest, _LEVELS if highest > lowest else 1):
        if top - tip < _OVERLAP:
            continue
        first = int(np.ceil(tip / cell - 0.5))
        for middle in range(0, shape[0], step):
            window = slice(max(middle - half, 0), middle + half + 1), slice(first, None)
            left, right = low[window].min(initial=np.inf), high[window].max(initial=-np.inf)
            width = float(right - left)
            if not np.isfinite(width):
                continue
            across = float(b.min() + (middle + 0.5) * cell)
            touched = (low[window] <= left + _DEEP) & (high[window] >= right - _DEEP)
            # Only blocks of 2 × 2 cells count, because fingers slip off a surface that is steeper.
            upright = touched[:, 1:] & touched[:, :-1]
            area = float((upright[1:] & upright[:-1]).sum()) * cell**2
            pos = np.array([0.0, 0.0, tip + hand.depth])
            pos[:2] = (left + right) / 2 * np.array([c, s]) + across * np.array([-s, c])
            if area < _LEAST:
                continue
            score = -np.inf
            if hand.gap[0] + _THICKER <= width <= hand.gap[1] - 2 * _SIDE:
                score = min(area / _ENOUGH, 1.0) - abs(across) / 0.03 - 0.3 * abs(pos[2] - center_height) / 0.03
                score -= 0.3 * max(width / hand.gap[1] - 0.75, 0.0) / 0.25
            yield score, pos, width, angle


def _turned_width(points: Floats, pos: Floats, angle: float, turn: float, hand: Grasp) -> float:
    """Return the gap that fingers around a position need when the object is turned by up to an angle [m]."""
    inside = points[points[:, 2] >= pos[2] - hand.depth] - pos
    widest = 0.0
    for direction in angle + np.linspace(-turn, turn, 5):
        c, s = np.cos(direction), np.sin(direction)
        across = np.abs(c * inside[:, 1] - s * inside[:, 0]) <= hand.width / 2
        along = (c * inside[:, 0] + s * inside[:, 1])[across]
        widest = max(widest, 2 * float(np.abs(along).max(initial=0.0)))
    return widest
