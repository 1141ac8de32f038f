"""Represents a robot as moving bodies and joints by merging fixed links, and computes batched kinematics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from frobs_core.models import (
    Joint,
    JointType,
    Pose,
    RobotModel,
    compose,
    inertia_matrix,
    moved,
    parallel_axis,
    pose_array,
    pose_from_array,
)
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import matrix_from_quat, quat_rotate
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
        joints: The moving joints, including mimic joints, with origins in the parent bodies' frames. Joint i moves body
            i + 1.
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
        queue = [model.root]
        while queue:
            name = queue.pop(0)
            body, at = self.frames[name]
            for joint in children.get(name, ()):
                origin = compose(at, pose_array(joint.origin))
                if joint.type is JointType.FIXED:
                    self.frames[joint.child] = body, origin
                else:
                    self.joints.append(replace(joint, origin=pose_from_array(origin)))
                    self.parents.append(body)
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

    def all_positions(self, actuated: Floats) -> Floats:
        """Return the positions of all joints, (n, joints), for given positions of the actuated joints, (n, dof)."""
        positions: Floats = self.all_velocities(actuated) + self.offsets
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
            Positions (n, bodies, 3) [m], quat_wxyz (n, bodies, 4), and joint axes (n, joints, 3), in the world frame.
        """
        pos, quat = [base[:, :3]], [base[:, 3:]]
        for joint, parent, position in zip(self.joints, self.parents, positions.T, strict=True):
            child_pos, child_quat = moved(joint, pos[parent], quat[parent], position[:, None])
            pos.append(child_pos)
            quat.append(child_quat)
        quats = np.stack(quat, axis=1)
        return np.stack(pos, axis=1), quats, quat_rotate(quats[:, 1:], self.axes)

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

    def on_body(self, link: str, pos: Floats, quat: Floats) -> tuple[int, Floats]:
        """Return the index of the body that includes a link, and the position of the link's origin, (n, 3) [m]."""
        body, offset = self.frames[link]
        return body, pos[:, body] + quat_rotate(quat[:, body], offset[:3])

    def jacobian(self, link: str, pos: Floats, quat: Floats, axes: Floats) -> Floats:
        """Return the world Jacobian of a link's origin, (n, 6, dof), with linear rows 0–2 and angular rows 3–5."""
        body, at = self.on_body(link, pos, quat)
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
        parts: list[list[Mass]] = [[] for _ in self.bodies]
        for link in self.model.links:
            inertial = link.inertial
            if inertial is not None:
                body, offset = self.frames[link.name]
                mass = (changed or {}).get(link.name, inertial.mass)
                rotation = matrix_from_quat(offset[3:])
                com = offset[:3] + (rotation * np.array(inertial.origin.pos)).sum(-1)
                inertia = rotation @ inertia_matrix(inertial) @ rotation.T * (mass / inertial.mass)
                parts[body].append(Mass(mass, com, inertia))
        return [_joined(own, self._armature(body)) for body, own in enumerate(parts)]

    def _armature(self, body: int) -> Floats:
        """Return the armature of the revolute joint that moves a body, as an inertia of this body, (3, 3) [kg·m²]."""
        if body == 0 or self._slides[body - 1]:
            return np.zeros((3, 3))
        axis = self.axes[body - 1]
        return self._armatures[self.joints[body - 1].name] * np.outer(axis, axis)


def _joined(parts: list[Mass], armature: Floats) -> Mass:
    total = sum(part.mass for part in parts)
    if total <= 0.0:
        return Mass(0.0, np.zeros(3), np.zeros((3, 3)))
    com = np.sum([part.mass * part.com for part in parts], axis=0) / total
    inertias = [part.inertia + parallel_axis(part.mass, part.com - com) for part in parts]
    return Mass(total, com, armature + np.sum(inertias, axis=0))
