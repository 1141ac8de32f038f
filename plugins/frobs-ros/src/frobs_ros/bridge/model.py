"""One model of the world: a robot, or something that stands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from xml.etree.ElementTree import Element

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.interfaces import Body, CommandMode, Placement, Robot, RobotHandle
from frobs_core.models import Pose, RobotModel, default_gains, home_positions
from frobs_ros.bridge.drive import Drive
from frobs_ros.bridge.extras import read_sensors
from frobs_ros.bridge.poses import REST, WORLD, Motion, Place, place_of


@dataclass(frozen=True, kw_only=True)
class Description:
    """What a model is, before it stands somewhere.

    Attributes:
        placement: Of what moves; None: it is static.
        pose: The file's own ``<pose>``, which is relative to the pose that a spawn asks for.
        bodies: Of what is static, by name; their poses are told in the model's frame.
        links: Names of the links of what is static, with their poses in the model's frame.
        offsets: Where a link is told to be, in the robot's own link of that name: an SDF's link frame is not at its joint.
        modes: What each joint follows while no controller runs.
        elements: The ``<gazebo>`` elements of a URDF, or the plugins and sensors of an SDF.
        has_transmissions: Whether the file says by what its joints are driven.
    """

    placement: Placement | None = None
    pose: Pose = field(default_factory=Pose)
    bodies: Mapping[str, Body] = field(default_factory=dict)
    links: Mapping[str, Pose] = field(default_factory=dict)
    offsets: Mapping[str, Pose] = field(default_factory=dict)
    modes: Mapping[str, CommandMode] = field(default_factory=dict)
    elements: tuple[Element, ...] = ()
    has_transmissions: bool = False


def with_gains(robot: Robot, model: RobotModel) -> Robot:
    """Return a robot whose drive gains are told: they are found once, and not in each simulation that it is part of."""
    if robot.gains is not None:
        return robot
    return replace(robot, gains=default_gains(model, home_positions(model, robot.home)))


class Model:
    """A model that stands in the world.

    Args:
        name: Unique in the world.
        namespace: Of its plugins, without slashes at the ends.

    Attributes:
        key: What the simulation calls it.
        sensors: The ``<sensor>`` elements of its file.
        robot: Its handle; None: it is static, or the world has not been built with it yet.
    """

    def __init__(self, name: str, namespace: str, description: Description, place: Place) -> None:
        self.name, self.namespace, self.description, self.spawned = name, namespace, description, place
        self.key = name
        self.sensors = tuple(read_sensors(description.elements))
        self.robot: RobotHandle | None = None
        placement = description.placement
        names = placement.model.joint_names if placement else ()
        self.joints = {joint: number for number, joint in enumerate(names)}
        self.drive = Drive([description.modes.get(joint, CommandMode.EFFORT) for joint in names])
        self._standing = place

    @property
    def is_static(self) -> bool:
        """Whether it moves only where it is put."""
        return self.description.placement is None

    @property
    def has_camera(self) -> bool:
        """Whether it carries cameras that publish."""
        return any(sensor.is_camera and sensor.has_plugin for sensor in self.sensors)

    @property
    def links(self) -> tuple[str, ...]:
        """Names of its links, the first of which its pose is told of."""
        placement = self.description.placement
        if placement is None:
            return tuple(self.description.links)
        root = placement.model.root
        return (root, *(link.name for link in placement.model.links if link.name != root))

    @property
    def shapes(self) -> tuple[str, ...]:
        """Names of the shapes that it collides with."""
        placement = self.description.placement
        if placement is None:
            return tuple(name for name, body in self.description.bodies.items() if body.collides)
        links = [link for link in placement.model.links if link.collisions]
        return tuple(
            f"{link.name}_collision{f'_{i}' if i else ''}" for link in links for i in range(len(link.collisions))
        )

    @property
    def all_joints(self) -> tuple[str, ...]:
        """Names of its joints, also of those that do not move."""
        placement = self.description.placement
        return () if placement is None else tuple(joint.name for joint in placement.model.joints)

    def placement(self) -> Placement:
        """Return it as a simulation takes it, at its spawn pose."""
        found = self.description.placement
        assert found is not None
        return replace(found, pose=self.spawned.to_pose())

    def static_bodies(self) -> dict[str, Body]:
        """Return what is static of it, where it stands now, by names that are unique in the world."""
        return {
            f"{self.key}/{name}": replace(body, pose=place_of(body.pose).after(self._standing).to_pose())
            for name, body in self.description.bodies.items()
        }

    def place(self) -> Place:
        """Return where it is."""
        if self.robot is None:
            return self._standing
        pos, quat = self.robot.base_pose
        return Place(pos[0].copy(), quat[0].copy())

    def motion(self) -> Motion:
        """Return how it moves, in the world."""
        if self.robot is None or self.robot.robot.base == "fixed":
            return REST
        linear, angular = self.robot.base_twist
        return Motion(linear[0].copy(), angular[0].copy())

    def link_place(self, link: str) -> Place:
        """Return where a link of it is."""
        if self.robot is None:
            return place_of(self.description.links[link]).after(self._standing)
        pos, quat = self.robot.frame_pose(link)
        place = Place(pos[0].copy(), quat[0].copy())
        offset = self.description.offsets.get(link)
        return place if offset is None else place_of(offset).after(place)

    def link_motion(self, link: str) -> Motion:
        """Return how a link of it moves, in the world."""
        if self.robot is None:
            return REST
        linear, angular = self.robot.frame_velocity(link)
        found = Motion(linear[0].copy(), angular[0].copy())
        offset = self.description.offsets.get(link)
        if offset is None:
            return found
        quat = self.robot.frame_pose(link)[1][0]
        arm = place_of(offset).after(Place(WORLD.pos, quat)).pos
        return Motion(found.linear + np.cross(found.angular, arm), found.angular)

    def put(self, place: Place, motion: Motion) -> None:
        """Put it somewhere at once; the caller writes what is static of it."""
        self._standing = place
        if self.robot is None:
            return
        self.robot.write_base_pose(place.pos[None], place.quat_wxyz[None])
        if self.robot.robot.base != "fixed":
            self.robot.write_base_twist(motion.linear[None], motion.angular[None])

    def state(self) -> tuple[Place, Motion, Floats, Floats]:
        """Return place, motion, joint positions and joint velocities (dof,)."""
        robot = self.robot
        assert robot is not None
        return self.place(), self.motion(), robot.joint_positions[0].copy(), robot.joint_velocities[0].copy()

    def write_state(self, place: Place, motion: Motion, positions: Floats, velocities: Floats) -> None:
        """Return to a state of :meth:`state`."""
        assert self.robot is not None
        self.put(place, motion)
        self.robot.write_joint_state(positions[None], velocities[None])
