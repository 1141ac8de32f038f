"""Content of a robot's model file, independent of the file format. Every simulator builds robots from this content."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from frobs_core.models.notes import Note
from frobs_core.util.arrays import Floats

if TYPE_CHECKING:
    from frobs_core.models.kinematics import Chain

Vector3: TypeAlias = tuple[float, float, float]
Quaternion: TypeAlias = tuple[float, float, float, float]


@dataclass(frozen=True)
class Pose:
    """A rigid transform.

    Attributes:
        pos: Position [m].
        quat_wxyz: Unit quaternion, scalar first.
    """

    pos: Vector3 = (0.0, 0.0, 0.0)
    quat_wxyz: Quaternion = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Box:
    """A box.

    Attributes:
        size: Full edge lengths [m].
    """

    size: Vector3


@dataclass(frozen=True)
class Sphere:
    """A sphere.

    Attributes:
        radius: [m]
    """

    radius: float


@dataclass(frozen=True)
class Cylinder:
    """A cylinder along z.

    Attributes:
        radius: [m]
        length: Full length [m].
    """

    radius: float
    length: float


@dataclass(frozen=True)
class Capsule:
    """A capsule along z.

    Attributes:
        radius: [m]
        length: Length of the cylinder between the two hemispheres [m].
    """

    radius: float
    length: float


@dataclass(frozen=True)
class Mesh:
    """A mesh file.

    Attributes:
        path: The file.
        scale: Scale factor for each axis.
        decomposed: Whether collisions are computed for convex pieces that approximate the mesh, so that holes stay
            open. Otherwise, collisions are computed for the mesh's convex hull. Decomposition requires the extra
            ``decomposition`` of ``frobs-models``.
    """

    path: Path
    scale: Vector3 = (1.0, 1.0, 1.0)
    decomposed: bool = False


Geometry: TypeAlias = Box | Sphere | Cylinder | Capsule | Mesh


@dataclass(frozen=True)
class Visual:
    """A visual shape of a link.

    Attributes:
        geometry: Shape.
        origin: Pose in the link's frame.
        rgba: Color with components in [0, 1], or None if the file does not define a color.
    """

    geometry: Geometry
    origin: Pose = field(default_factory=Pose)
    rgba: tuple[float, float, float, float] | None = None


@dataclass(frozen=True)
class Collision:
    """A collision shape of a link.

    Attributes:
        geometry: Shape.
        origin: Pose in the link's frame.
    """

    geometry: Geometry
    origin: Pose = field(default_factory=Pose)


@dataclass(frozen=True)
class Inertial:
    """Mass and inertia of a link.

    Attributes:
        mass: [kg]
        origin: Pose of the inertial frame in the link's frame; the origin is the center of mass.
        inertia: Inertia about the center of mass, (ixx, ixy, ixz, iyy, iyz, izz) [kg·m²].
    """

    mass: float
    origin: Pose
    inertia: tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class Link:
    """One rigid body of a robot.

    Attributes:
        name: Name, unique in the robot.
        inertial: Mass and inertia, or None if the file does not define them.
        visuals: Visual shapes.
        collisions: Collision shapes.
    """

    name: str
    inertial: Inertial | None = None
    visuals: tuple[Visual, ...] = ()
    collisions: tuple[Collision, ...] = ()


class JointType(Enum):
    """Type of a joint's motion. ``continuous`` is revolute without limits."""

    REVOLUTE = "revolute"
    CONTINUOUS = "continuous"
    PRISMATIC = "prismatic"
    FIXED = "fixed"
    FLOATING = "floating"
    PLANAR = "planar"


@dataclass(frozen=True)
class JointLimits:
    """Limits of a joint. Limits that the file does not define are infinite.

    Attributes:
        lower: [rad or m]
        upper: [rad or m]
        velocity: [rad/s or m/s]
        effort: [N·m or N]
    """

    lower: float = -np.inf
    upper: float = np.inf
    velocity: float = np.inf
    effort: float = np.inf


@dataclass(frozen=True)
class Mimic:
    """Coupling of a joint to an actuated joint: position = multiplier · position of ``joint`` + offset.

    Attributes:
        joint: Name of the joint to follow.
        multiplier: Multiplier of the followed joint's position.
        offset: [rad or m]
    """

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Joint:
    """A joint. The child link's frame is at ``origin`` in the parent link's frame, and moves along or about ``axis``.

    Attributes:
        name: Name, unique in the robot.
        type: Type of motion.
        parent: Name of the parent link.
        child: Name of the child link.
        origin: Pose of the joint's frame in the parent link's frame.
        axis: Unit vector in the joint's frame.
        limits: Limits of the motion.
        damping: [N·m·s/rad or N·s/m]
        friction: [N·m or N]
        armature: Inertia of the motor, reflected through the gear [kg·m² or kg].
        mimic: Coupling to another joint, or None.
    """

    name: str
    type: JointType
    parent: str
    child: str
    origin: Pose = field(default_factory=Pose)
    axis: Vector3 = (1.0, 0.0, 0.0)
    limits: JointLimits = field(default_factory=JointLimits)
    damping: float = 0.0
    friction: float = 0.0
    armature: float = 0.0
    mimic: Mimic | None = None


@dataclass(frozen=True)
class RobotModel:
    """Kinematic tree of a robot, in file order.

    Attributes:
        name: The robot's name in the file.
        path: The file.
        format: File format: ``"urdf"`` or ``"mjcf"``. Xacro files are expanded to URDF.
        xml: The file's text with expanded macros and absolute resource paths.
        links: All links, in file order.
        joints: All joints, in file order.
        notes: Notes about everything that was changed or ignored when the file was read.
        passive_joints: Names of the moving joints that have no drive because no actuator in the file acts on them.
        root_pose: Pose of the root link in the file.
    """

    name: str
    path: Path
    format: str
    xml: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    notes: tuple[Note, ...] = ()
    passive_joints: tuple[str, ...] = ()
    root_pose: Pose = field(default_factory=Pose)

    @cached_property
    def root(self) -> str:
        """Name of the link that is not the child of any joint."""
        children = {joint.child for joint in self.joints}
        return next(link.name for link in self.links if link.name not in children)

    @cached_property
    def actuated_joints(self) -> tuple[Joint, ...]:
        """The revolute, continuous and prismatic joints that are neither mimic joints nor passive, in file order."""
        return tuple(joint for joint in self.joints if joint.mimic is None and self.leader(joint) is not None)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of :attr:`actuated_joints`, which define the order of all joint arrays."""
        return tuple(joint.name for joint in self.actuated_joints)

    def leader(self, joint: Joint) -> Mimic | None:
        """Return the coupling of a joint to an actuated joint, or None if no drive moves the joint.

        An actuated joint is coupled to itself.
        """
        if joint.type not in (JointType.REVOLUTE, JointType.CONTINUOUS, JointType.PRISMATIC):
            return None
        return None if joint.name in self.passive_joints else joint.mimic or Mimic(joint.name)

    @cached_property
    def _chains(self) -> dict[str, Chain]:
        return {}

    def frame_pose(self, frame: str, joint_positions: Floats) -> tuple[Floats, Floats]:
        """Return the pose of a link relative to the root link: pos (n, 3) [m] and quat_wxyz (n, 4).

        For the arguments and errors, see :func:`frobs_core.models.forward_kinematics`.
        """
        from frobs_core.models.kinematics import forward_kinematics

        return forward_kinematics(self, frame, joint_positions)
