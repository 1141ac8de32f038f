"""Link poses from a URDF."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from frobs_ros2.errors import SettingsError

Array = np.ndarray[Any, Any]

_MAX_URDF = 4 * 2**20  # [characters]


@dataclass(frozen=True)
class _Joint:
    name: str
    kind: str
    parent: str
    pos: Array
    rotation: Array
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
        if len(urdf) > _MAX_URDF or "<!DOCTYPE" in urdf or "<!ENTITY" in urdf:
            raise SettingsError("the robot description is not used: it is larger than 4 MiB, or defines XML entities.")
        try:
            root = ET.fromstring(urdf)
            joints = [_read(element) for element in root.iterfind("joint")]
        except (ET.ParseError, KeyError, ValueError, AttributeError) as error:
            raise SettingsError(f"the robot description is not a valid URDF: {error}.") from error
        self._by_child: Mapping[str, _Joint] = dict(joints)
        self._check_loops()
        self._columns = {name: i for i, name in enumerate(joint_names)}
        self.limits = {
            element.attrib["name"]: _limits(limit)
            for element in root.iterfind("joint")
            if (limit := element.find("limit")) is not None and element.get("type") != "fixed"
        }

    def has_link(self, link: str) -> bool:
        """Return whether a link other than the root has this name."""
        return link in self._by_child

    def first_moving_link(self, link: str) -> str:
        """Return the link that the first moving joint between the root and ``link`` moves."""
        moving = [child for child, joint in self._chain(link) if joint.kind != "fixed"]
        return moving[-1] if moving else link

    def _check_loops(self) -> None:
        reaches_root: set[str] = set()
        for start in self._by_child:
            passed: set[str] = set()
            for link, _ in self._chain(start):
                if link in passed:
                    raise SettingsError(f"the robot description is not a valid URDF: link '{link}' carries itself.")
                if link in reaches_root:
                    break
                passed.add(link)
            reaches_root |= passed

    def _chain(self, link: str) -> Iterator[tuple[str, _Joint]]:
        """Yield the joints between a link and the root, with the links that they carry."""
        while link in self._by_child:
            joint = self._by_child[link]
            yield link, joint
            link = joint.parent

    def pose(self, link: str, positions: Array) -> tuple[Array, Array]:
        """Return the pose of a link relative to the root link.

        Args:
            link: Name of the link.
            positions: Joint positions, (dof,) [rad or m].

        Returns:
            Position (3,) [m] and rotation matrix (3, 3).
        """
        pos, rotation = np.zeros(3), np.eye(3)
        for _, joint in reversed(list(self._chain(link))):
            pos, rotation = pos + rotation @ joint.pos, rotation @ joint.rotation
            column = self._columns.get(joint.leader)
            q = 0.0 if column is None else joint.multiplier * float(positions[column]) + joint.offset
            if joint.kind == "prismatic":
                pos = pos + rotation @ (q * joint.axis)
            elif joint.kind in ("revolute", "continuous"):
                rotation = rotation @ _about(joint.axis, q)
        return pos, rotation


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
        pos=np.array(_numbers(place.get("xyz", "0 0 0"))),
        rotation=_from_rpy(*_numbers(place.get("rpy", "0 0 0"))),
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


def _from_rpy(roll: float, pitch: float, yaw: float) -> Array:
    x, y, z = np.eye(3)
    return np.asarray(_about(z, yaw) @ _about(y, pitch) @ _about(x, roll))


def _about(axis: Array, angle: float) -> Array:
    """Return the rotation about a unit vector (Rodrigues' formula)."""
    x, y, z = axis.tolist()
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)
