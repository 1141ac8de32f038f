"""Replaces the passive joints of closed linkages in MJCF files, such as those of a parallel gripper, by mimic joints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np

from frobs_core.models import Mimic, RobotModel
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import matrix_from_quat

_SHARES = 9  # positions of a driven joint at which a linkage is closed
_ITERATIONS, _DAMPING, _STEP = 12, 1e-4, 1e-6
_MOVES = 0.02  # [rad or m] minimum motion of a joint that follows


def without_loops(model: RobotModel) -> RobotModel:
    """Return a model in which the passive joints of linkages follow the joints that drive them.

    The linkages are closed by ``<connect>`` elements. Each passive joint follows a driven joint in proportion, which is
    exact for parallelograms. Other passive joints are not changed.
    """
    if not model.passive_joints or model.format != "mjcf":
        return model
    links = {link.name for link in model.links}
    pins = [
        (first, second, np.array([float(number) for number in each.get("anchor", "0 0 0").split()]))
        for each in ET.fromstring(model.xml).findall("equality/connect")
        if (first := each.get("body1", "")) in links and (second := each.get("body2", "")) in links
    ]
    if not pins:
        return model
    free = replace(model, passive_joints=())
    driven = {free.joint_names.index(name): name for name in model.joint_names}
    columns = [free.joint_names.index(name) for name in model.passive_joints if name in free.joint_names]
    zero = np.zeros((1, len(free.joint_names)))
    fixed = [_at(free, second, _at(free, first, anchor, zero), zero, inverse=True) for first, second, anchor in pins]

    def error(positions: Floats) -> Floats:
        gaps = [
            _at(free, first, anchor, positions) - _at(free, second, local, positions)
            for (first, second, anchor), local in zip(pins, fixed, strict=True)
        ]
        return np.concatenate(gaps)

    mimics: dict[str, Mimic] = {}
    for column, name in driven.items():
        limits = free.actuated_joints[column].limits
        if not np.isfinite([limits.lower, limits.upper]).all():
            continue
        values = np.linspace(limits.lower, limits.upper, _SHARES)
        start = int(np.argmin(np.abs(values)))
        found = np.zeros((_SHARES, len(columns)))
        for path in (range(start, _SHARES), range(start, -1, -1)):  # from the pose in which the linkage is closed
            positions = zero.copy()
            for index in path:
                positions[0, column] = values[index]
                _close(error, positions, columns)
                found[index] = positions[0, columns]
        slopes, offsets = np.polyfit(values, found, 1)
        for passive, slope, offset in zip(columns, slopes, offsets, strict=True):
            if abs(slope) * (values[-1] - values[0]) > _MOVES:
                mimics[free.joint_names[passive]] = Mimic(name, float(slope), float(offset))
    joints = tuple(replace(joint, mimic=mimics.get(joint.name, joint.mimic)) for joint in model.joints)
    return replace(
        model,
        joints=joints,
        passive_joints=tuple(name for name in model.passive_joints if name not in mimics),
    )


def _close(error: Callable[[Floats], Floats], positions: Floats, columns: list[int]) -> None:
    """Change the positions of the passive joints until the linkage is closed."""
    for _ in range(_ITERATIONS):
        now, slopes = error(positions), []
        for column in columns:
            probed = positions.copy()
            probed[0, column] += _STEP
            slopes.append((error(probed) - now) / _STEP)
        jacobian = np.stack(slopes, axis=1)
        gram = jacobian.T @ jacobian + _DAMPING**2 * np.eye(len(columns))
        positions[0, columns] -= np.linalg.solve(gram, jacobian.T @ now)


def _at(model: RobotModel, link: str, point: Floats, positions: Floats, inverse: bool = False) -> Floats:
    """Return a point of a link in the frame of the root, or the reverse, (3,) [m]."""
    pos, quat = model.frame_pose(link, positions)
    turn = matrix_from_quat(quat[0])
    return np.asarray((point - pos[0]) @ turn if inverse else turn @ point + pos[0])
