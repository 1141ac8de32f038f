"""Collision checker for a robot's joint positions and motions in a scene."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache
from itertools import combinations
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from frobs_controllers_planning.kinematics import Kinematics, se3
from frobs_controllers_planning.shapes import bounding_radius, to_coal
from frobs_core.models import Collision, JointType
from frobs_core.util.arrays import Floats

FLOOR = "floor"
"""Obstacle name of the floor."""

_LEAST_SPACING = 0.005  # [m] minimum spacing of collision checks, used if the clearance is almost zero


class CollisionChecker:
    """Collision checker that requires a minimum distance between pairs of shapes.

    As in the simulators, two links may overlap if they are connected by at most one joint or overlap at home. Fixed
    links are not checked against the scene, because the robot's motion does not affect them.

    Args:
        kinematics: Kinematics of the robot. All poses are in the root link's frame.
        obstacles: Collision shapes of the scene by body name, each in the body's frame.
        floor: Whether the scene has a floor. The floor is an additional obstacle named :data:`FLOOR`, which fills the
            space below the xy plane of its frame.
        self_collision: Whether the robot's links can collide with each other.
        clearance: Minimum distance between two shapes [m].
        may_touch: Pairs of links that may touch.

    Attributes:
        reach: Upper limit (dof,) for the displacement of any part of the robot [m] per unit of joint motion [rad or m].
    """

    def __init__(
        self,
        kinematics: Kinematics,
        obstacles: Mapping[str, Sequence[Collision]],
        *,
        floor: bool,
        self_collision: bool,
        clearance: float,
        may_touch: Collection[tuple[str, str]] = (),
    ) -> None:
        self._kinematics = kinematics
        self._clearance = clearance
        self._spacing = max(2.0 * clearance, _LEAST_SPACING)
        self.reach = _reach(kinematics)
        self._geometry = pin.GeometryModel()
        self._links = self._add_links()
        self._obstacles = self._add_obstacles(obstacles, floor)
        shapes, parents = self._geometry.geometryObjects, kinematics.model.parents
        allowed = set(map(frozenset, may_touch))
        for (one, these), (other, those) in combinations(self._links.items(), 2):
            if frozenset((one, other)) in allowed:
                continue
            first, second = shapes[these[0]].parentJoint, shapes[those[0]].parentJoint
            if self_collision and first != second and parents[first] != second and parents[second] != first:
                self._add_pairs(these, those)
        for these in self._links.values():
            if shapes[these[0]].parentJoint != 0:
                for those in self._obstacles.values():
                    self._add_pairs(these, those)
        self._data = pin.GeometryData(self._geometry)
        self._margins = np.full(len(self._geometry.collisionPairs), clearance)  # (pairs,) [m]

    def _add_links(self) -> dict[str, list[int]]:
        """Add the collision shapes of the robot's links, and return the indices of the shapes by link."""
        numbers: dict[str, list[int]] = {}
        for link in self._kinematics.robot.links:
            joint, placement = self._kinematics.links[link.name]
            for collision in link.collisions:
                pose = placement * se3(collision.origin)
                shapes = [self._add_shape(joint, pose, shape) for shape in to_coal(collision.geometry)]
                numbers.setdefault(link.name, []).extend(shapes)
        return numbers

    def _add_obstacles(self, obstacles: Mapping[str, Sequence[Collision]], floor: bool) -> dict[str, list[int]]:
        """Add the collision shapes of the scene, and return the indices of the shapes by body."""
        self._origins: dict[int, Any] = {}
        numbers: dict[str, list[int]] = {}
        for name, collisions in obstacles.items():
            for collision in collisions:
                for shape in to_coal(collision.geometry):
                    number = self._add_shape(0, se3(collision.origin), shape)
                    self._origins[number] = se3(collision.origin)
                    numbers.setdefault(name, []).append(number)
        if floor:
            number = self._add_shape(0, pin.SE3.Identity(), coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0))
            self._origins[number] = pin.SE3.Identity()
            numbers[FLOOR] = [number]
        return numbers

    def _add_shape(self, joint: int, placement: Any, shape: Any) -> int:
        name = f"shape {self._geometry.ngeoms}"
        return int(self._geometry.addGeometryObject(pin.GeometryObject(name, joint, placement, shape)))

    def _add_pairs(self, these: Sequence[int], those: Sequence[int]) -> None:
        for first in these:
            for second in those:
                self._geometry.addCollisionPair(pin.CollisionPair(first, second))

    def let_overlap(self, home: Floats) -> None:
        """Allow overlaps between links that overlap at home. The floor is considered a link.

        For all other pairs of links, the minimum distance is at most half the distance at home. Call this method after
        placing the floor.

        Args:
            home: (dof,) [rad or m]
        """
        owners = {number: ("link", name) for name, numbers in self._links.items() for number in numbers}
        owners.update(dict.fromkeys(self._obstacles.get(FLOOR, ()), ("link", FLOOR)))
        distances, pairs = self._distances(home), list(self._geometry.collisionPairs)
        own = [{owners.get(pair.first, ()), owners.get(pair.second, ())} for pair in pairs]
        allowed = [both for both, distance in zip(own, distances, strict=True) if () not in both and distance <= 0.0]
        kept = [both not in allowed for both in own]
        for pair, keep in zip(pairs, kept, strict=True):
            if not keep:
                self._geometry.removeCollisionPair(pair)
        near = np.where([() in both for both in own], np.inf, 0.5 * distances)
        self._margins = np.minimum(self._clearance, near)[kept]
        self._data = pin.GeometryData(self._geometry)
        self._require(self._margins)

    def place(self, poses: Mapping[str, Any]) -> None:
        """Set the poses of obstacles.

        Args:
            poses: Poses by body name, as Pinocchio SE3 objects in the root link's frame.
        """
        shapes = self._geometry.geometryObjects
        for name, pose in poses.items():
            for number in self._obstacles.get(name, ()):
                shapes[number].placement = pose * self._origins[number]

    def begin_anywhere(self) -> None:
        """Restore the minimum distances that :meth:`begin_at` may have reduced for the last motion."""
        self._require(self._margins)

    def begin_at(self, joint_positions: Floats) -> bool:
        """Set the start of a motion, where pairs of shapes may be closer than their minimum distance.

        For such a pair, the minimum distance during the motion is half the distance at the start.

        Args:
            joint_positions: (dof,) [rad or m]

        Returns:
            True if no shapes touch at the start.
        """
        self.begin_anywhere()
        if self.is_free(joint_positions):
            return True
        distances = self._distances(joint_positions)
        self._require(np.minimum(self._margins, np.maximum(0.5 * distances, 0.0)))
        return bool((distances > 0.0).all())

    def is_free(self, joint_positions: Floats) -> bool:
        """Return whether all pairs of shapes keep their minimum distance at joint positions (dof,) [rad or m]."""
        kinematics = self._kinematics
        q = kinematics.configuration(joint_positions)
        return not pin.computeCollisions(kinematics.model, kinematics.data, self._geometry, self._data, q, True)

    def is_way_free(self, start: Floats, end: Floats) -> bool:
        """Return whether a straight line between two joint vectors (dof,) is collision-free.

        The end points are not checked. Between two checks, no part of the robot moves by more than twice the clearance
        or 5 mm, whichever is larger. Therefore, if the clearance is at least 2.5 mm and is kept at all checked
        positions, no shapes touch anywhere on the line.
        """
        count = self.count_checks(np.abs(end - start))
        return all(self.is_free(start + share * (end - start)) for share in _shares(count))

    def count_checks(self, change: Floats) -> int:
        """Return the number of parts into which a motion by ``change`` (dof,) must be divided for collision checks."""
        return max(1, math.ceil(float(change @ self.reach) / self._spacing))

    def _distances(self, joint_positions: Floats) -> Floats:
        """Return the distance between the shapes of each pair, (pairs,) [m], negative for overlapping shapes."""
        kinematics = self._kinematics
        q = kinematics.configuration(joint_positions)
        pin.computeDistances(kinematics.model, kinematics.data, self._geometry, self._data, q)
        return np.array([result.min_distance for result in self._data.distanceResults])

    def _require(self, margins: Floats) -> None:
        for request, margin in zip(self._data.collisionRequests, margins.tolist(), strict=True):
            request.security_margin = margin


@lru_cache(maxsize=1024)
def _shares(count: int) -> tuple[float, ...]:
    """Return the inner boundaries of ``count`` equal parts of [0, 1], in bisection order to find collisions early."""
    bits = max(count - 1, 1).bit_length()
    order = sorted(range(1, count), key=lambda number: f"{number:0{bits}b}"[::-1])
    return tuple(number / count for number in order)


def _reach(kinematics: Kinematics) -> Floats:
    """Return an upper limit (dof,) for the displacement of any part of the robot [m] per unit of joint motion."""
    robot = kinematics.robot
    above = {joint.child: joint for joint in robot.joints}
    reach = np.zeros(len(robot.joint_names))
    for link in robot.links:
        radii = [np.linalg.norm(c.origin.pos) + bounding_radius(c.geometry) for c in link.collisions]
        if not radii:
            continue
        radius, name, total = float(max(radii)), link.name, np.zeros(len(reach))
        while name in above:
            joint = above[name]
            leader = robot.leader(joint)
            if leader is not None:
                slides = joint.type is JointType.PRISMATIC
                share = abs(leader.multiplier)
                total[robot.joint_names.index(leader.joint)] += share * (1.0 if slides else radius)
                travel = max(abs(joint.limits.lower), abs(joint.limits.upper)) if slides else 0.0
                radius += travel if math.isfinite(travel) else 0.0
            radius += float(np.linalg.norm(joint.origin.pos))
            name = joint.parent
        reach = np.maximum(reach, total)
    return reach
