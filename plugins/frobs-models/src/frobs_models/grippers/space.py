"""Measures the room that a gripper needs around an object, and where a camera can be mounted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from frobs_core.description import Camera, EndEffector
from frobs_core.models import RobotModel, home_positions, joint_path
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ModelFileError
from frobs_core.util.rotations import matrix_from_quat
from frobs_models.grippers.surfaces import placed_surface, solid_shapes

_TIP = 0.012  # [m] height of the part of the fingers that touches an object
_HIGH = 0.03  # [m] height of the part of the fingers that is beside an object
_WIDTHS = (0.008, 0.05)  # [m] smallest and largest plausible width of a finger
_BETWEEN = 0.012  # [m] distance from the tool center point, across the fingers, of what is between them
_BESIDE, _BEHIND, _AHEAD = 0.035, 0.07, 0.04  # [m] places of a wrist camera and of what it looks at
_FOV = 85.0  # [deg] of a wrist camera
_POINTS = 1500  # number of surface points per shape


def gripper_space(
    model: RobotModel, tool: EndEffector, home: Mapping[str, float], closed_at: float = 0.0
) -> dict[str, Any]:
    """Measure how far a gripper extends around its tool center point.

    Args:
        model: Model of the arm.
        tool: Its gripper. In the frame of the tool center point, z is the direction of approach, and the fingers close
            along y.
        home: Joint positions of the arm [rad or m].
        closed_at: Position of the closed fingers along y [m].

    Returns:
        Lengths [m]: ``depth``, by which the fingers extend beyond the tool center point; ``room``, from the tool center
        point back to the palm; ``width``, of the fingers across the direction in which they close; ``sides``, by which
        the closed fingers extend along x and y from their middle, as high as an object.
    """
    points = _points_around(model, tool, home)
    depth = float(points[..., 2].max())
    last = points[-1]
    tips = last[last[:, 2] > last[:, 2].max() - _TIP]  # closed fingers may extend farther
    first = points[0][points[0][:, 2] > points[0][:, 2].max() - _HIGH] - [0.0, closed_at, 0.0]
    between = last[np.abs(last[:, :2]).max(axis=1) < _BETWEEN, 2]
    return {
        "depth": depth,
        "room": max(float(-between.max()), 0.0) if len(between) else 0.1,
        "width": float(np.clip(np.ptp(tips[:, 0]), *_WIDTHS)),
        "sides": np.abs(first[:, :2]).max(axis=0).tolist(),
    }


def wrist_camera(model: RobotModel, tool: EndEffector, home: Mapping[str, float]) -> Camera:
    """Return a camera beside the palm that sees the fingers and what is between and below them.

    For the arguments, see :func:`gripper_space`.
    """
    opened = _points_around(model, tool, home)[-1]
    low, high = float(opened[:, 0].min()), float(opened[:, 0].max())
    side = high + _BESIDE if high <= -low + _BESIDE else low - _BESIDE
    pos, target = (round(side, 3), 0.0, -_BEHIND), (round(0.5 * side, 3), 0.0, _AHEAD)  # past the fingers, and at them
    return Camera(pos=pos, target=target, fov_y=_FOV, frame=tool.tcp)


def _points_around(model: RobotModel, tool: EndEffector, home: Mapping[str, float]) -> Floats:
    """Return points of the palm and of the closed, half open and open fingers, (3, n, 3) [m].

    They are in the frame of the tool center point.
    """
    shares = np.array([0.0, 0.5, 1.0])
    closed, opened = (home_positions(model, {**home, **positions}) for positions in (tool.closed, tool.open))
    postures = closed + shares[:, None] * (opened - closed)
    carrying = [joint.name for joint in joint_path(model, tool.tcp)]
    moved = postures[-1:].copy()
    moved[:, model.joint_names.index([name for name in carrying if name in model.joint_names][-1])] += 0.1
    poses = np.concatenate([postures, moved])
    near = []
    for link in model.links:
        origin, turn = model.frame_pose(tool.tcp, poses)
        pos, quat = model.frame_pose(link.name, poses)
        frame = matrix_from_quat(turn)
        offset = np.einsum("nji,nj->ni", frame, pos - origin)
        if np.abs(offset[3] - offset[2]).max() > 1e-6:
            continue  # part of the arm
        rotation = np.einsum("nji,njk->nik", frame, matrix_from_quat(quat))
        near.append(np.einsum("nij,kj->nki", rotation[:3], _points(link)) + offset[:3, None])
    return np.concatenate(near, axis=1)


def _points(link: Any) -> Floats:
    import trimesh

    points = [np.zeros((0, 3))]
    for shape in solid_shapes(link):
        try:
            surface = placed_surface(shape)
        except ModelFileError:
            continue
        points += [np.asarray(surface.vertices), np.asarray(trimesh.sample.sample_surface(surface, _POINTS, seed=0)[0])]
    return np.concatenate(points)
