"""Descriptions of scenes as data: everything in a simulation except the controlled robots."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from math import dist
from typing import Literal

import numpy as np

from frobs_core.description.bodies import Body
from frobs_core.description.camera import Camera
from frobs_core.description.robot import CommandMode, Robot
from frobs_core.description.sensor import ForceTorque
from frobs_core.models.defaults import DriveGains, default_gains, home_positions
from frobs_core.models.kinematics import compose, joint_path, pose_array, pose_from_array
from frobs_core.models.model import JointType, Pose, RobotModel
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import PhysicsParameterError, SceneError, UnsuitableRobotError, check_name
from frobs_core.util.rotations import quat_conjugate, quat_multiply, quat_rotate


@dataclass(frozen=True, kw_only=True)
class Contact:
    """A declared contact between two bodies, whose state tasks can read.

    Each side is ``"floor"``, the name of a scene body, ``"robot/link"`` for one link, ``"robot"`` for all links of a
    robot, or ``"*"`` for any body.

    Attributes:
        first: First side of the contact.
        second: Second side of the contact.
        ignore: Bodies that ``"*"`` excludes. ``ignore`` may be set only if ``second`` is ``"*"``. If a contact ignores
            any bodies, its force is not available.
    """

    first: str
    second: str = "*"
    ignore: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.ignore and self.second != "*":
            raise SceneError(
                f"a contact of '{self.first}' with '{self.second}'",
                f"ignores {', '.join(self.ignore)}; only a contact whose second side is '*' can ignore bodies.",
            )


@dataclass(frozen=True)
class Marker:
    """A sphere that is rendered but does not collide.

    Attributes:
        pos: (num_envs, 3) [m] in the world frame.
        radius: [m]
        rgba: Color, each component in [0, 1].
        name: Meaning of the marker. Viewers such as RViz show and hide markers by name.
    """

    pos: Floats
    radius: float
    rgba: tuple[float, float, float, float] = (0.1, 0.75, 0.3, 0.6)
    name: str = "goal"


@dataclass(frozen=True, kw_only=True)
class Placement:
    """A robot in a scene.

    Attributes:
        robot: Description of the robot.
        model: Parsed model file of the robot.
        pose: Pose of the base in the world frame at reset.
        command_mode: Command mode of the drives: one for all joints, or a mapping by joint name. Omitted joints use
            position commands.
    """

    robot: Robot
    model: RobotModel
    pose: Pose = field(default_factory=Pose)
    command_mode: CommandMode | Mapping[str, CommandMode]

    @property
    def command_modes(self) -> tuple[CommandMode, ...]:
        """Command mode of each actuated joint, (dof,), in the order of the model's ``joint_names``."""
        given = self.command_mode
        if isinstance(given, Mapping):
            return tuple(given.get(joint, CommandMode.POSITION) for joint in self.model.joint_names)
        return (given,) * len(self.model.joint_names)

    @property
    def drive_gains(self) -> tuple[Floats, Floats]:
        """Kp and Kd, (dof,) each, from the robot's description, or the model's default gains if it specifies none."""
        gains = self.robot.gains or default_gains(self.model, home_positions(self.model, self.robot.home))
        pairs = [gains.of(joint) for joint in self.model.joint_names]
        return np.array([kp for kp, _ in pairs], float), np.array([kd for _, kd in pairs], float)

    @cached_property
    def armatures(self) -> dict[str, float]:
        """Armature of each moving joint by name [kg·m² or kg], from the robot's description or the model file.

        Raises:
            UnknownNameError: The description names a joint that does not exist or does not move.
        """
        found = {joint.name: joint.armature for joint in self.model.joints if joint.type is not JointType.FIXED}
        for joint, armature in self.robot.armature.items():
            check_name(f"moving joint in 'armature' of robot '{self.robot.name}'", joint, found)
            found[joint] = armature
        return found

    def start_pose(self, link: str) -> Floats:
        """Return the pose of a link in the world frame at reset, (7,): position [m] and quat_wxyz."""
        home = home_positions(self.model, self.robot.home)
        pos, quat = self.model.frame_pose(link, home[None])
        return compose(pose_array(self.pose), np.concatenate([pos[0], quat[0]]))

    @cached_property
    def force_torque_sensors(self) -> dict[str, tuple[str, Pose]]:
        """Force-torque sensors by name: the link whose parent joint is measured, and the sensor's pose in that link.

        Raises:
            UnsuitableRobotError: There is no joint above a force-torque sensor's link.
        """
        sensors = {name: each for name, each in self.robot.sensors.items() if isinstance(each, ForceTorque)}
        if not sensors:
            return {}
        above = {joint.child: joint for joint in self.model.joints}
        heavy = [link.name for link in self.model.links if link.inertial is not None and link.inertial.mass > 0.0]
        carry = {*heavy, *(joint.parent for name in heavy for joint in joint_path(self.model, name))}
        found = {}
        for name, sensor in sensors.items():
            link = sensor.frame
            while link not in carry and link in above and above[link].type is JointType.FIXED:
                link = above[link].parent
            if link not in above:
                reason = (
                    f"has no joint above link '{link}', so the force-torque sensor '{name}' cannot measure anything."
                )
                raise UnsuitableRobotError(self.robot.name, reason)
            found[name] = link, _relative_pose(self.start_pose(link), self.start_pose(sensor.frame))
        return found


def _relative_pose(first: Floats, second: Floats) -> Pose:
    """Return the second pose relative to the first, given two (7,) poses."""
    back = quat_conjugate(first[3:])
    pos, quat = quat_rotate(back, second[:3] - first[:3]), quat_multiply(back, second[3:])
    return pose_from_array(np.concatenate([pos, quat]))


@dataclass(frozen=True)
class Attachment:
    """Two bodies or links that are fixed to each other and do not collide with each other.

    Attributes:
        first: A scene body, or ``"robot/link"``.
        second: A free scene body, or ``"robot/link"``.
        pose: Pose of ``second`` in the frame of ``first``, or None to keep their relative pose at reset, when the
            robots are in their home positions. If the actual relative pose differs from ``pose``, for example because a
            task has moved one of the two sides, the engine pulls the sides into this pose.
    """

    first: str
    second: str
    pose: Pose | None = None


@dataclass(frozen=True, kw_only=True)
class Prop:
    """An articulated object without a controller, such as a drawer.

    The model file defines how the joints move. Contacts and cameras refer to a prop's links as ``"prop/link"``. Read
    the joint positions and velocities from the prop's handle, which ``Simulation.robots`` contains by name.

    Attributes:
        model: Model file of the prop, as in :class:`~frobs_core.description.Robot`.
        pose: Pose of the prop's root link in the world frame at reset.
        base: ``"fixed"`` or ``"floating"``.
        home: Joint positions at reset by joint name [rad or m]. Omitted joints rest at 0, or at the middle of their
            limits if the limits exclude 0.
        friction: Coefficient of sliding friction by link, for links that should not use the simulator's default.
        xacro_args: Arguments of the xacro file.
        package_paths: Folders of the ROS packages that the model file refers to, by package name.
    """

    model: str
    pose: Pose = field(default_factory=Pose)
    base: Literal["fixed", "floating"] = "fixed"
    home: Mapping[str, float] = field(default_factory=dict)
    friction: Mapping[str, float] = field(default_factory=dict)
    xacro_args: Mapping[str, str] = field(default_factory=dict)
    package_paths: Mapping[str, str] = field(default_factory=dict)

    def placement(self, name: str) -> Placement:
        """Return the prop as a robot called ``name`` whose drives apply no effort.

        Raises:
            ModelFileError: The model file cannot be read.
        """
        own = {item.name: getattr(self, item.name) for item in fields(self) if item.name != "pose"}
        robot = Robot(**own, name=name, gains=DriveGains(stiffness=0.0, damping=0.0))
        model = robot.read_model()
        return Placement(robot=robot, model=model, pose=self.pose, command_mode=CommandMode.EFFORT)


@dataclass(frozen=True, kw_only=True)
class Scene:
    """Everything in a simulation except the controlled robots.

    Attributes:
        floor: Whether there is a floor at z = 0.
        floor_friction: Coefficient of sliding friction of the floor. The effective friction coefficient of a free body
            that slides over the floor is at least this value in MuJoCo and PyBullet, and at most this value in Gazebo.
        gravity: Acceleration due to gravity [m/s²].
        hard_contacts: Whether contacts of bodies are as hard as the simulator allows, so that a robot cannot press the
            bodies into other objects. Use hard contacts if a robot grasps or pushes objects. On MuJoCo, contacts are
            soft springs by default. Objects bounce more if their contacts are hard.
        bodies: Bodies, by name.
        contacts: Contacts that the task observes, by name.
        cameras: Cameras, by name. By default, ``render`` uses the first camera.
        robots: Additional robots without controllers, by name.
        props: Articulated objects without a controller, by name.
        attachments: Bodies and links that are fixed to each other, by name.
        robot_pose: Base pose of the controlled robot in the world frame.
        robot_poses: Base poses of the controlled robots in the world frame, by robot name, if there are several
            controlled robots.
    """

    floor: bool = True
    floor_friction: float = 1.0
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    hard_contacts: bool = False
    bodies: Mapping[str, Body] = field(default_factory=dict)
    contacts: Mapping[str, Contact] = field(default_factory=dict)
    cameras: Mapping[str, Camera] = field(
        default_factory=lambda: {"overview": Camera(pos=(1.4, -1.4, 1.1), target=(0.1, 0.0, 0.35))}
    )
    robots: Mapping[str, Placement] = field(default_factory=dict)
    props: Mapping[str, Prop] = field(default_factory=dict)
    attachments: Mapping[str, Attachment] = field(default_factory=dict)
    robot_pose: Pose = field(default_factory=Pose)
    robot_poses: Mapping[str, Pose] = field(default_factory=dict)

    def with_cameras_of(self, robots: Mapping[str, Robot]) -> Scene:
        """Return the scene with the cameras of robots, which are named like ``"wrist"``.

        If the scene already has a camera of this name, or another robot does, the name is ``"robot_wrist"``.

        Args:
            robots: Descriptions of the robots, by name.
        """
        cameras = dict(self.cameras)
        for name, robot in robots.items():
            for key, camera in robot.cameras.items():
                free = key if key not in cameras else f"{name}_{key}"
                cameras[free] = replace(camera, frame=f"{name}/{camera.frame}")
        return replace(self, cameras=cameras)

    @property
    def span(self) -> float:
        """Largest viewing distance among the cameras fixed in the world [m], or 0 if there are no such cameras.

        Simulators may use this distance to scale visual elements without a defined size, such as the floor's pattern.
        """
        far = [dist(camera.pos, camera.target) for camera in self.cameras.values() if camera.frame is None]
        return max(far, default=0.0)

    @property
    def sizable_bodies(self) -> list[str]:
        """Names of bodies whose size can differ between environments if the simulator supports ``randomize_size``."""
        return [name for name, body in self.bodies.items() if body.is_sizable]

    def check_size(self, body: str, factors: Floats | float = 1.0) -> None:
        """Check that a body's size can be changed and that the scale factors are valid.

        Args:
            body: Name of the body.
            factors: Scale factors for the body's lengths, of any shape.

        Raises:
            PhysicsParameterError: The body's size cannot be changed, or a factor is not positive.
        """
        if body not in self.sizable_bodies:
            reason = "cannot be changed, because only scene bodies that consist of primitives can be resized."
            raise PhysicsParameterError("size", body, reason)
        if not np.all(factors > 0):
            raise PhysicsParameterError("size", body, f"must be above 0: {np.min(factors)}.")

    def all_robots(self, controlled: Mapping[str, Placement]) -> dict[str, Placement]:
        """Return all robots of a simulation: the controlled robots, the scene's additional robots, and its props.

        Args:
            controlled: The controlled robots by name.

        Raises:
            ConfigurationError: A prop has the same name as a robot or a body.
            ModelFileError: The model file of a prop cannot be read.
        """
        robots = {**controlled, **self.robots}
        for name in self.props:
            if name in robots or name in self.bodies:
                raise SceneError(
                    f"prop '{name}'", "has the same name as a robot or body in the scene; choose another name."
                )
        return robots | {name: prop.placement(name) for name, prop in self.props.items()}

    def attachment_pose(self, name: str, robots: Mapping[str, Placement]) -> Pose:
        """Return the pose of an attachment's second side in the frame of its first side.

        Args:
            name: Name of the attachment.
            robots: All robots of the simulation.
        """
        attachment = self.attachments[name]
        if attachment.pose is not None:
            return attachment.pose
        return _relative_pose(self._start(attachment.first, robots), self._start(attachment.second, robots))

    def _start(self, side: str, robots: Mapping[str, Placement]) -> Floats:
        """Return the pose of a body or link in the world frame at reset, (7,)."""
        if side in self.bodies:
            return pose_array(self.bodies[side].pose)
        robot, _, link = side.partition("/")
        return robots[robot].start_pose(link)

    def check(self, robots: Mapping[str, Placement], lacking: Collection[str] = ()) -> None:
        """Check that the scene is consistent and that all referenced objects exist. Simulators call this method first.

        Args:
            robots: All robots of the simulation.
            lacking: Features that the simulator does not support, such as ``"contacts"`` or ``"attachments"``.

        Raises:
            ConfigurationError: A kinematic body has a mass, a contact or camera refers to a body that does not exist,
                or the simulator does not support a feature of the scene.
        """
        for problem in self._problems(robots, lacking):
            raise SceneError(*problem)

    def _problems(self, robots: Mapping[str, Placement], lacking: Collection[str]) -> Iterator[tuple[str, str]]:
        """Yield the element and the reason of each problem."""
        for what in lacking:
            if getattr(self, what):
                names = ", ".join(getattr(self, what))
                yield "the scene", f"contains the {what} {names}, but this simulator does not support {what}."
        links = {f"{name}/{link.name}" for name, placement in robots.items() for link in placement.model.links}
        known = [*self.bodies, *robots, *(["floor"] if self.floor else [])]
        for name, contact in self.contacts.items():
            for side in (contact.first, contact.second, *contact.ignore):
                if side != "*" and side not in known and side not in links:
                    yield (
                        f"contact '{name}'",
                        f"refers to '{side}', which does not exist; available: {', '.join(known)}.",
                    )
        for name, camera in self.cameras.items():
            if camera.frame is not None and camera.frame not in links and camera.frame not in self.bodies:
                yield f"camera '{name}'", f"is fixed to '{camera.frame}', which is not a body in the scene."
            if camera.up is not None and not np.any(np.cross(camera.up, np.subtract(camera.pos, camera.target))):
                yield f"camera '{name}'", f"has the up vector {camera.up}, which is parallel to the viewing direction."
        for name, attachment in self.attachments.items():
            for side in (attachment.first, attachment.second):
                if side not in links and side not in self.bodies:
                    yield f"attachment '{name}'", f"refers to '{side}', which is not a body or link in the scene."
            second = self.bodies.get(attachment.second)
            if attachment.first == attachment.second or (second is not None and not second.is_free):
                rule = "it must be a link or a body with a mass, and must differ from the first side."
                yield f"attachment '{name}'", f"has an invalid second side; {rule}"
        for name, body in self.bodies.items():
            if body.is_free and body.kinematic:
                yield f"scene body '{name}'", "is kinematic and has a mass; remove the mass, or set kinematic=False."

    def contact_number(self, name: str, *, force: bool = False) -> int:
        """Return the index of a declared contact.

        Args:
            name: Name of the contact.
            force: Whether the caller requests the contact's force.

        Raises:
            UnknownNameError: The scene does not declare a contact with this name.
            ConfigurationError: The force is requested, but the contact ignores some bodies.
        """
        check_name("declared contact", name, self.contacts)
        if force and self.contacts[name].ignore:
            raise SceneError(
                f"contact '{name}'",
                "ignores some bodies, so its force is not available; declare a contact that does not set 'ignore'.",
            )
        return list(self.contacts).index(name)
