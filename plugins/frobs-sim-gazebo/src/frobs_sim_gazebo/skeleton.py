"""Represents a robot as moving bodies and joints by merging fixed links, and computes batched kinematics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from frobs_core.models import (
    Joint,
    JointType,
    Link,
    Pose,
    RobotModel,
    compose,
    inertia_matrix,
    parallel_axis,
    pose_array,
)
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import matrix_from_quat, quat_from_matrix
from frobs_models import joints_below


@dataclass(frozen=True)
class Mass:
    """Mass properties of a body.

    Attributes:
        mass: [kg]
        com: Center of mass in the body's frame [m], (3,).
        inertia: Inertia about the center of mass, in the body's axes [kg·m²], (3, 3).
    """

    mass: float
    com: Floats
    inertia: Floats


class Skeleton:
    """The moving bodies and joints of a robot model.

    Args:
        model: Model of the robot.
        armatures: Armature of each moving joint [kg·m² or kg], by name. If None, the model's armatures are used.

    Attributes:
        bodies: Name of each body's first link. The base is the first body, and parents precede their children.
        frames: For each link, the index of the body that includes the link, and the link's pose in this body's frame,
            (7,).
        joints: The moving joints, including mimic joints. Joint i moves body i + 1.
        parents: Index of each joint's parent body.
        actuated: Index in ``joints`` of each actuated joint, in the file's order.
        leaders: Index of each mimic joint's leader, or the joint's own index for any other joint.
        multipliers: Factor by which the leader's position is multiplied, (joints,).
        offsets: Offset that is added to the multiplied position, (joints,) [rad or m].

    Raises:
        ModelFileError: The model has a joint that cannot be simulated.
    """

    def __init__(self, model: RobotModel, armatures: Mapping[str, float] | None = None) -> None:
        self.model = model
        self._armatures = {joint.name: joint.armature for joint in model.joints} if armatures is None else armatures
        children = joints_below(model)
        self.bodies, self.joints, self.parents = [model.root], list[Joint](), list[int]()
        self.frames: dict[str, tuple[int, Floats]] = {model.root: (0, pose_array(Pose()))}
        origins, queue = [], [model.root]
        while queue:
            name = queue.pop(0)
            body, at = self.frames[name]
            for joint in children.get(name, ()):
                origin = compose(at, pose_array(joint.origin))
                if joint.type is JointType.FIXED:
                    self.frames[joint.child] = body, origin
                else:
                    self.joints.append(joint)
                    self.parents.append(body)
                    origins.append(origin)
                    self.frames[joint.child] = len(self.bodies), pose_array(Pose())
                    self.bodies.append(joint.child)
                queue.append(joint.child)
        count = len(self.joints)
        names = [joint.name for joint in self.joints]
        self.actuated = [names.index(name) for name in model.joint_names]
        self.leaders = [names.index(joint.mimic.joint) if joint.mimic else i for i, joint in enumerate(self.joints)]
        self.multipliers = np.array([joint.mimic.multiplier if joint.mimic else 1.0 for joint in self.joints])
        self.offsets = np.array([joint.mimic.offset if joint.mimic else 0.0 for joint in self.joints])
        self._slides = np.array([joint.type is JointType.PRISMATIC for joint in self.joints], bool)
        self.axes = np.array([joint.axis for joint in self.joints]).reshape(count, 3)
        self._origins = np.array([origin[:3] for origin in origins]).reshape(count, 3)
        self._turns = matrix_from_quat(np.array([origin[3:] for origin in origins]).reshape(count, 4))
        x, y, z = self.axes.T
        zero = np.zeros(count)
        self._cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(count, 3, 3)
        self._cross_squared = np.matmul(self._cross, self._cross)

    def all_positions(self, actuated: Floats) -> Floats:
        """Return the positions of all joints, (n, joints), for given positions of the actuated joints, (n, dof)."""
        full = np.zeros((len(actuated), len(self.joints)))
        full[:, self.actuated] = actuated
        positions: Floats = full[:, self.leaders] * self.multipliers + self.offsets
        return positions

    def all_velocities(self, actuated: Floats) -> Floats:
        """Return the velocities of all joints, (n, joints), for given velocities of the actuated joints, (n, dof)."""
        full = np.zeros((len(actuated), len(self.joints)))
        full[:, self.actuated] = actuated
        velocities: Floats = full[:, self.leaders] * self.multipliers
        return velocities

    def place(self, base: Floats, positions: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the poses of all bodies and the axes of all joints.

        Args:
            base: Position [m] and quat_wxyz of the root link in the world frame, (n, 7).
            positions: Joint positions, (n, joints) [rad or m].

        Returns:
            Positions (n, bodies, 3) [m], rotation matrices (n, bodies, 3, 3), and joint axes (n, joints, 3), in the
            world frame.
        """
        n, count = positions.shape
        angles = np.where(self._slides, 0.0, positions)[..., None, None]
        # Rodrigues' formula: 1 + sin·[axis]× + (1 − cos)·[axis]×²
        own = np.eye(3) + np.sin(angles) * self._cross + (1.0 - np.cos(angles)) * self._cross_squared
        relative = np.matmul(self._turns, own)  # (n, joints, 3, 3)
        pos, turn = np.empty((n, count + 1, 3)), np.empty((n, count + 1, 3, 3))
        pos[:, 0], turn[:, 0] = base[:, :3], matrix_from_quat(base[:, 3:])
        axes = np.empty((n, count, 3))
        for j, parent in enumerate(self.parents):
            turn[:, j + 1] = np.matmul(turn[:, parent], relative[:, j])
            axes[:, j] = (turn[:, j + 1] * self.axes[j]).sum(-1)
            pos[:, j + 1] = pos[:, parent] + (turn[:, parent] * self._origins[j]).sum(-1)
            if self._slides[j]:
                pos[:, j + 1] += axes[:, j] * positions[:, j, None]
        return pos, turn, axes

    def move(self, pos: Floats, axes: Floats, base_twist: Floats, velocities: Floats) -> tuple[Floats, Floats]:
        """Return the linear and angular velocities of all bodies.

        Args:
            pos: Positions of the bodies, as returned by :meth:`place`.
            axes: Axes of the joints, as returned by :meth:`place`.
            base_twist: lin_vel_world [m/s] and ang_vel_world [rad/s] at the root link's origin, (n, 6).
            velocities: Joint velocities, (n, joints) [rad/s or m/s].

        Returns:
            lin_vel_world of the bodies' origins and ang_vel_world of the bodies, (n, bodies, 3) each.
        """
        lin, ang = np.empty_like(pos), np.empty_like(pos)
        lin[:, 0], ang[:, 0] = base_twist[:, :3], base_twist[:, 3:]
        for j, parent in enumerate(self.parents):
            moved = axes[:, j] * velocities[:, j, None]
            arm = pos[:, j + 1] - pos[:, parent]
            lin[:, j + 1] = lin[:, parent] + np.cross(ang[:, parent], arm)
            ang[:, j + 1] = ang[:, parent]
            if self._slides[j]:
                lin[:, j + 1] += moved
            else:
                ang[:, j + 1] += moved
        return lin, ang

    def on_body(self, link: str, pos: Floats, turn: Floats) -> tuple[int, Floats, Floats]:
        """Return the index of the body that includes a link, and the link's pos (n, 3) and quat_wxyz (n, 4)."""
        body, offset = self.frames[link]
        at = pos[:, body] + (turn[:, body] * offset[:3]).sum(-1)
        return body, at, quat_from_matrix(np.matmul(turn[:, body], matrix_from_quat(offset[3:])))

    def jacobian(self, link: str, pos: Floats, turn: Floats, axes: Floats) -> Floats:
        """Return the world Jacobian of a link's origin, (n, 6, dof), with linear rows 0–2 and angular rows 3–5."""
        body, at, _ = self.on_body(link, pos, turn)
        jacobian = np.zeros((len(pos), 6, len(self.joints)))
        while body > 0:
            j = body - 1
            leader, share = self.leaders[j], self.multipliers[j]
            if self._slides[j]:
                jacobian[:, :3, leader] += share * axes[:, j]
            else:
                jacobian[:, :3, leader] += share * np.cross(axes[:, j], at - pos[:, body])
                jacobian[:, 3:, leader] += share * axes[:, j]
            body = self.parents[j]
        return jacobian[:, :, self.actuated]

    def masses(self, changed: Mapping[str, float] | None = None) -> list[Mass]:
        """Return the mass properties of each body, which are 0 for a body without mass.

        Args:
            changed: Changed link masses [kg], by link name. The inertias of these links are scaled by the same ratios
                as the masses.
        """
        parts: list[list[tuple[Link, int, Floats]]] = [[] for _ in self.bodies]
        for link in self.model.links:
            body, offset = self.frames[link.name]
            if link.inertial is not None:
                parts[body].append((link, body, offset))
        return [_joined(links, changed or {}, self._armature(body)) for body, links in enumerate(parts)]

    def _armature(self, body: int) -> Floats:
        """Return the armature of the revolute joint that moves a body, as an inertia of this body, (3, 3) [kg·m²]."""
        if body == 0 or self._slides[body - 1]:
            return np.zeros((3, 3))
        axis = self.axes[body - 1]
        return self._armatures[self.joints[body - 1].name] * np.outer(axis, axis)


def _joined(links: list[tuple[Link, int, Floats]], changed: Mapping[str, float], armature: Floats) -> Mass:
    parts = []
    for link, _, offset in links:
        inertial = link.inertial
        assert inertial is not None
        mass = changed.get(link.name, inertial.mass)
        rotation = matrix_from_quat(offset[3:])
        com = offset[:3] + (rotation * np.array(inertial.origin.pos)).sum(-1)
        inertia = rotation @ inertia_matrix(inertial) @ rotation.T * (mass / inertial.mass)
        parts.append((mass, com, inertia))
    total = sum(mass for mass, _, _ in parts)
    if total <= 0.0:
        return Mass(0.0, np.zeros(3), np.zeros((3, 3)))
    com = np.sum([mass * at for mass, at, _ in parts], axis=0) / total
    inertia = armature + np.sum([own + parallel_axis(mass, at - com) for mass, at, own in parts], axis=0)
    return Mass(total, com, inertia)
