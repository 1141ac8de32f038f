"""Link poses from a URDF."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from frobs_ros2.errors import SettingsError

Array = np.ndarray[Any, Any]

_MAX_URDF = 4 * 2**20  # [characters]
_MAX_JOINTS = 1_000
_MOVING = ("revolute", "continuous", "prismatic")


@dataclass(frozen=True)
class _Joint:
    name: str
    kind: str
    parent: str
    origin: Array
    axis: Array
    leader: str
    multiplier: float
    offset: float


class Kinematics:
    """Kinematics of a robot.

    Args:
        urdf: The robot's URDF.
        joint_names: Joints in the order of position arrays.

    Attributes:
        limits: Lower and upper position limit, velocity limit and effort limit of each joint that has limits.

    Raises:
        SettingsError: The text is not a URDF, or its joints form a loop.
    """

    def __init__(self, urdf: str, joint_names: Sequence[str]) -> None:
        large = len(urdf) > _MAX_URDF or urdf.count("<joint") > _MAX_JOINTS
        if large or "<!DOCTYPE" in urdf or "<!ENTITY" in urdf:
            raise SettingsError(
                "the robot description is not used: it has more than 4 MiB or 1,000 joints, or defines XML entities."
            )
        try:
            root = ET.fromstring(urdf)
            joints = [_read(element) for element in root.iterfind("joint")]
        except (ET.ParseError, KeyError, ValueError, AttributeError) as error:
            raise SettingsError(f"the robot description is not a valid URDF: {error}.") from error
        self._by_child: Mapping[str, _Joint] = dict(joints)
        self._names = list(joint_names)
        for link in self._by_child:
            self._path(link)
        self.limits = {
            element.attrib["name"]: _limits(limit)
            for element in root.iterfind("joint")
            if (limit := element.find("limit")) is not None and element.get("type") != "fixed"
        }

    def has_link(self, link: str) -> bool:
        """Return whether a link other than the root has this name."""
        return link in self._by_child

    def chain(self, link: str) -> Chain:
        """Return the joints between the root and a link, which are none for the root and for unknown links."""
        return Chain(self._path(link), self._names)

    def _path(self, link: str) -> list[_Joint]:
        path: list[_Joint] = []
        while link in self._by_child:
            if len(path) == len(self._by_child):
                raise SettingsError(f"the robot description is not a valid URDF: link '{link}' carries itself.")
            path.append(self._by_child[link])
            link = path[-1].parent
        return path[::-1]


class Chain:
    """The joints between the root of a robot description and one of its links.

    Args:
        joints: The joints, from the root on.
        joint_names: Joints in the order of position arrays.

    Attributes:
        first_moving: Index of the first joint that is not fixed, or of the last joint.
    """

    def __init__(self, joints: Sequence[_Joint], joint_names: Sequence[str]) -> None:
        count, columns = len(joints), {name: i for i, name in enumerate(joint_names)}
        moves = [joint.leader in columns and joint.kind in _MOVING for joint in joints]
        self._dof = len(joint_names)
        self._turns = np.array([joint.kind != "prismatic" for joint in joints], bool)
        self._columns = np.array([columns.get(joint.leader, 0) for joint in joints], int)
        self._multiplier = np.array([j.multiplier * moved for j, moved in zip(joints, moves, strict=True)], float)
        self._offset = np.array([j.offset * moved for j, moved in zip(joints, moves, strict=True)], float)
        self._axes = np.array([joint.axis for joint in joints]).reshape(count, 3)
        # A joint's pose is origin + a · first + b · second: with a = sin q and b = 1 − cos q if it turns (Rodrigues'
        # formula), and a = q if it slides.
        self._origin, self._first, self._second = np.zeros((3, count, 4, 4))
        for i, joint in enumerate(joints):
            motion = np.zeros((4, 4))
            if joint.kind == "prismatic":
                motion[:3, 3] = joint.axis
            else:
                motion[:3, :3] = _cross(joint.axis)
            self._origin[i], self._first[i], self._second[i] = joint.origin, joint.origin @ motion, joint.origin @ motion @ motion  # fmt: skip
        self.first_moving = next((i for i, joint in enumerate(joints) if joint.kind != "fixed"), count - 1)

    def frames(self, positions: Array) -> Array:
        """Return the poses of the links that the joints carry, relative to the root: (joints, 4, 4).

        Args:
            positions: Joint positions, (dof,) [rad or m].
        """
        q = self._multiplier * positions[self._columns] + self._offset
        a, b = np.where(self._turns, np.sin(q), q), np.where(self._turns, 1.0 - np.cos(q), 0.0)
        frames = self._origin + a[:, None, None] * self._first + b[:, None, None] * self._second
        for i in range(1, len(frames)):
            np.matmul(frames[i - 1], frames[i].copy(), out=frames[i])
        return np.asarray(frames)

    def position(self, positions: Array) -> Array:
        """Return the position of the link relative to the root, (3,) [m], at joint positions (dof,) [rad or m]."""
        return np.asarray(self.frames(positions)[-1, :3, 3]) if len(self._turns) else np.zeros(3)

    def jacobian(self, frames: Array) -> Array:
        """Return the Jacobian of the link's pose in the root frame, (6, dof): translation, then rotation.

        Args:
            frames: Poses from :meth:`frames`.
        """
        axes = (frames[:, :3, :3] @ self._axes[:, :, None])[:, :, 0]
        linear = np.where(self._turns[:, None], np.cross(axes, frames[-1, :3, 3] - frames[:, :3, 3]), axes)
        rows = np.hstack([linear, self._turns[:, None] * axes]) * self._multiplier[:, None]
        jacobian = np.zeros((self._dof, 6))
        np.add.at(jacobian, self._columns, rows)
        return jacobian.T


def _read(element: ET.Element) -> tuple[str, _Joint]:
    origin, axis, mimic = element.find("origin"), element.find("axis"), element.find("mimic")
    place: Mapping[str, str] = {} if origin is None else origin.attrib
    direction = np.array([1.0, 0.0, 0.0] if axis is None else _numbers(axis.attrib["xyz"]))
    parent, child = element.find("parent"), element.find("child")
    if parent is None or child is None:
        raise ValueError("a joint has no parent or child")
    name = element.attrib["name"]
    joint = _Joint(
        name=name,
        kind=element.attrib["type"],
        parent=parent.attrib["link"],
        origin=_pose(_numbers(place.get("xyz", "0 0 0")), _numbers(place.get("rpy", "0 0 0"))),
        axis=direction / (np.linalg.norm(direction) or 1.0),
        leader=name if mimic is None else mimic.attrib["joint"],
        multiplier=1.0 if mimic is None else float(mimic.get("multiplier", "1")),
        offset=0.0 if mimic is None else float(mimic.get("offset", "0")),
    )
    return child.attrib["link"], joint


def _numbers(text: str) -> list[float]:
    x, y, z = (float(word) for word in text.split())
    return [x, y, z]


def _limits(limit: ET.Element) -> tuple[float, float, float, float]:
    lower, upper = float(limit.get("lower", "-inf")), float(limit.get("upper", "inf"))
    return lower, upper, float(limit.get("velocity", "inf")), float(limit.get("effort", "inf"))


def _pose(xyz: Sequence[float], rpy: Sequence[float]) -> Array:
    pose = np.eye(4)
    roll, pitch, yaw = (rotation_about(axis, angle) for axis, angle in zip(np.eye(3), rpy, strict=True))
    pose[:3, :3], pose[:3, 3] = yaw @ pitch @ roll, xyz
    return pose


def rotation_about(axis: Array, angle: float) -> Array:
    """Return the rotation matrix (3, 3) for an angle [rad] about a unit vector (3,)."""
    cross = _cross(axis)
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)


def _cross(axis: Array) -> Array:
    x, y, z = axis.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
