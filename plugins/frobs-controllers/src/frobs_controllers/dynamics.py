"""Mass matrix and gravity efforts of a joint group, computed from the model file."""

from __future__ import annotations

import numpy as np

from frobs_core.contracts import JointGroup
from frobs_core.models import JointType, inertia_matrix, joint_path
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import UnsuitableRobotError
from frobs_core.util.rotations import cross, matrix_from_quat


class Dynamics:
    """Dynamics of the links that a joint group moves while all other joints and the base are held.

    The masses, inertias and armatures are those of the robot's description. Objects that the robot holds and randomized
    masses are not included. All matrix products are computed as stacks of small products, so that each environment in a
    batch gets results that are bit-identical to those of a single environment.

    Args:
        joints: The joints.

    Raises:
        UnsuitableRobotError: The model file does not define the mass of a link, and only the engine can compute it.
    """

    def __init__(self, joints: JointGroup) -> None:
        self._joints = joints
        model, names = joints.model, np.array(joints.joint_names)
        leaders = [(joint, model.leader(joint)) for joint in model.joints]
        # All joints that the group moves, which include joints that mimic others.
        coupled = [(joint, leader) for joint, leader in leaders if leader is not None and leader.joint in names]
        moving = [joint for joint, _ in coupled]
        paths = {link.name: joint_path(model, link.name) for link in model.links}
        bodies = [
            (link.name, link.inertial)
            for link in model.links
            if link.inertial is not None and any(joint in moving for joint in paths[link.name])
        ]
        notes = {note.element for note in model.notes if note.rule == "mesh-mass"}
        unknown = [name for name in paths if f'<body name="{name}">' in notes and {*paths[name]} & {*moving}]
        if unknown:
            raise UnsuitableRobotError(
                joints.robot.name,
                f"has bodies whose masses only MuJoCo can compute ({', '.join(unknown)}), so their weight cannot be "
                "compensated; add an <inertial> to each of them.",
            )
        self._frames = [joint.child for joint in moving] + [name for name, _ in bodies]
        self._axes = np.array([joint.axis for joint in moving])[:, :, None]
        self._slides = np.array([[joint.type is JointType.PRISMATIC] for joint in moving])
        self._moved = np.array([[joint in paths[name] for joint in moving] for name, _ in bodies])[:, :, None]
        self._columns = np.array([leader.multiplier * (names == leader.joint) for _, leader in coupled]).T
        armatures = [joints.robot.armature.get(joint.name, joint.armature) for joint in moving]
        self._armature = np.diag(self._columns**2 @ armatures)
        self._masses = np.array([inertial.mass for _, inertial in bodies])[:, None, None]
        self._centers = np.array([inertial.origin.pos for _, inertial in bodies])[:, :, None]
        self._inertias = np.array([inertia_matrix(inertial) for _, inertial in bodies])

    def __call__(self, gravity: Floats) -> tuple[Floats, Floats]:
        """Return the mass matrix and the gravity efforts at the current joint positions.

        Args:
            gravity: Acceleration due to gravity in the world frame, (3,) [m/s²].

        Returns:
            The mass matrix, (num_envs, dof, dof) [kg·m² or kg], and the efforts that support the weight of the links,
            (num_envs, dof) [N·m or N].
        """
        poses = [self._joints.frame_pose(frame) for frame in self._frames]
        pos = np.stack([pos for pos, _ in poses], axis=1)  # (num_envs, frames, 3)
        rotations = matrix_from_quat(np.stack([quat_wxyz for _, quat_wxyz in poses], axis=1))
        k = len(self._axes)
        axes = (rotations[:, :k] @ self._axes)[:, None, :, :, 0]  # (num_envs, 1, moving, 3)
        arms = (pos[:, k:] + (rotations[:, k:] @ self._centers)[..., 0])[:, :, None] - pos[:, None, :k]
        # Velocities of the centers of mass in the world's axes, and of the links in their own axes, per joint velocity.
        linear = self._columns @ (np.where(self._slides, axes, cross(axes, arms)) * self._moved)  # (…, links, dof, 3)
        angular = self._columns @ (np.where(self._slides, 0.0, axes) * self._moved) @ rotations[:, k:]
        mass = self._masses * (linear @ linear.swapaxes(2, 3)) + angular @ self._inertias @ angular.swapaxes(2, 3)
        weights = self._masses * gravity * linear
        return mass.sum(axis=1) + self._armature, -weights.sum(axis=(1, 3))
