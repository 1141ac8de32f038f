"""A model in the world, which is either a robot or a static model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from xml.etree.ElementTree import Element

import numpy as np

from frobs_core.contracts import CommandMode, RobotHandle
from frobs_core.description import Body, Placement, Robot
from frobs_core.models import Pose, RobotModel, default_gains, home_positions
from frobs_core.util.arrays import Floats
from frobs_ros.bridge.gazebo_elements import read_sensors
from frobs_ros.bridge.joint_targets import JointTargets
from frobs_ros.bridge.poses import REST, WORLD, Motion, Place, place_of


@dataclass(frozen=True, kw_only=True)
class Description:
    """A parsed model file, without the model's pose in the world frame.

    Attributes:
        placement: Placement of a moving model, or None for a static model.
        pose: The file's ``<pose>``, relative to the requested spawn pose.
        bodies: Bodies of a static model by name, with poses in the model frame.
        links: Link poses of a static model in the model frame, by link name.
        offsets: Pose of each published link frame, relative to the robot's link of the same name. The two frames differ
            if the frame of an SDF link is not located at the link's joint.
        modes: Command mode of each joint while no controller is running.
        elements: ``<gazebo>`` elements of a URDF, or equivalent elements created from an SDF.
        has_transmissions: Whether the file defines joint transmissions.
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
    """Return a robot with explicit drive gains, so that new simulations need not compute default gains."""
    if robot.gains is not None:
        return robot
    return replace(robot, gains=default_gains(model, home_positions(model, robot.home)))


class Model:
    """A model in the world.

    Args:
        name: Unique name in the world.
        namespace: Namespace of the model's plugins, without leading or trailing slashes.

    Attributes:
        key: Name of the model in the simulation.
        sensors: ``<sensor>`` elements of the model file.
        robot: Handle of the robot, or None if the model is static or not yet part of the simulation.
    """

    def __init__(self, name: str, namespace: str, description: Description, place: Place) -> None:
        self.name, self.namespace, self.description, self.spawned = name, namespace, description, place
        self.key = name
        self.sensors = tuple(read_sensors(description.elements))
        self.robot: RobotHandle | None = None
        placement = description.placement
        names = placement.model.joint_names if placement else ()
        self.joints = {joint: number for number, joint in enumerate(names)}
        self.joint_targets = JointTargets([description.modes.get(joint, CommandMode.EFFORT) for joint in names])
        self._standing = place

    @property
    def is_static(self) -> bool:
        """Whether the model is static."""
        return self.description.placement is None

    @property
    def has_camera(self) -> bool:
        """Whether the model has a camera that publishes images."""
        return any(sensor.is_camera and sensor.has_plugin for sensor in self.sensors)

    @property
    def links(self) -> tuple[str, ...]:
        """Link names. A robot's first link is the root link, whose pose is the model's pose."""
        placement = self.description.placement
        if placement is None:
            return tuple(self.description.links)
        root = placement.model.root
        return (root, *(link.name for link in placement.model.links if link.name != root))

    @property
    def shapes(self) -> tuple[str, ...]:
        """Names of the model's collision shapes."""
        placement = self.description.placement
        if placement is None:
            return tuple(name for name, body in self.description.bodies.items() if body.collides)
        links = [link for link in placement.model.links if link.collisions]
        return tuple(
            f"{link.name}_collision{f'_{i}' if i else ''}" for link in links for i in range(len(link.collisions))
        )

    @property
    def all_joints(self) -> tuple[str, ...]:
        """Names of the model's joints, including fixed joints."""
        placement = self.description.placement
        return () if placement is None else tuple(joint.name for joint in placement.model.joints)

    @property
    def handle(self) -> RobotHandle:
        """Handle of the robot, which must be part of the simulation. Rebuilding the simulation creates a new handle."""
        assert self.robot is not None
        return self.robot

    def placement(self) -> Placement:
        """Return the placement of a moving model at its spawn pose."""
        assert self.description.placement is not None
        return replace(self.description.placement, pose=self.spawned.to_pose())

    def static_bodies(self) -> dict[str, Body]:
        """Return a static model's bodies at their current poses, keyed by names that are unique in the world."""
        return {
            f"{self.key}/{name}": replace(body, pose=place_of(body.pose).after(self._standing).to_pose())
            for name, body in self.description.bodies.items()
        }

    def place(self) -> Place:
        """Return the model's pose in the world frame."""
        if self.robot is None:
            return self._standing
        pos, quat = self.robot.base_pose
        return Place(pos[0].copy(), quat[0].copy())

    def motion(self) -> Motion:
        """Return the model's velocity in the world frame."""
        if self.robot is None or self.robot.robot.base == "fixed":
            return REST
        linear, angular = self.robot.base_twist
        return Motion(linear[0].copy(), angular[0].copy())

    def link_place(self, link: str) -> Place:
        """Return the pose of a link in the world frame."""
        if self.robot is None:
            return place_of(self.description.links[link]).after(self._standing)
        pos, quat = self.robot.frame_pose(link)
        place = Place(pos[0].copy(), quat[0].copy())
        offset = self.description.offsets.get(link)
        return place if offset is None else place_of(offset).after(place)

    def link_motion(self, link: str) -> Motion:
        """Return the velocity of a link in the world frame."""
        if self.robot is None:
            return REST
        linear, angular = self.robot.frame_velocity(link)
        motion = Motion(linear[0].copy(), angular[0].copy())
        offset = self.description.offsets.get(link)
        if offset is None:
            return motion
        quat = self.robot.frame_pose(link)[1][0]
        arm = place_of(offset).after(Place(WORLD.pos, quat)).pos
        return Motion(motion.linear + np.cross(motion.angular, arm), motion.angular)

    def put(self, place: Place, motion: Motion) -> None:
        """Teleport the model. The caller must update the static bodies in the simulation."""
        self._standing = place
        if self.robot is None:
            return
        self.robot.write_base_pose(place.pos[None], place.quat_wxyz[None])
        if self.robot.robot.base != "fixed":
            self.robot.write_base_twist(motion.linear[None], motion.angular[None])

    def state(self) -> tuple[Place, Motion, Floats, Floats]:
        """Return the pose, the velocity, the (dof,) joint positions and the (dof,) joint velocities."""
        robot = self.handle
        return self.place(), self.motion(), robot.joint_positions[0].copy(), robot.joint_velocities[0].copy()

    def write_state(self, place: Place, motion: Motion, positions: Floats, velocities: Floats) -> None:
        """Restore a state that :meth:`state` returned."""
        self.put(place, motion)
        self.handle.write_joint_state(positions[None], velocities[None])
