"""Impedance controller whose actions move the equilibrium of a spring that pulls the tool center point."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from frobs_core.arrays import Action, Floats, Mask, rows_of
from frobs_core.interfaces import CommandMode, Controller, JointGroup, Scene, Simulation, Snapshot
from frobs_core.models import joint_path
from frobs_core.rotations import quat_difference, quat_rotate
from frobs_core.validation import non_negative, positive


class TcpImpedance(Controller):
    """Controller that makes the tool act like a mass on a spring and damper: τ = Jᵀ (K (x* − x) − D v) − d q̇ + g(q).

    The control law is due to Hogan (1985). The first three components of the spring act on the tool's position. The
    spring's last three components maintain the orientation that the tool had at the start of the episode. An action in
    [−1, 1]³ moves the equilibrium point along the world's axes. The term g(q) compensates for the weight of the links
    that the group moves, as specified by the model file.

    The torques are computed at every physics step, so that objects in contact with the tool feel a spring instead of a
    stiff drive. A step takes several times as long to compute as with a controller that runs at the control rate.

    Args:
        max_delta: Motion of the equilibrium point per axis [m] for an action of 1.
        stiffness: Stiffness K of the spring that acts on the position [N/m].
        rotational_stiffness: Stiffness K of the spring that acts on the orientation [N·m/rad].
        damping: Damping D of the tool's linear velocity [N·s/m].
        rotational_damping: Damping D of the tool's angular velocity [N·m·s/rad].
        joint_damping: Damping d of the joint velocities [N·m·s/rad].
        leash: Maximum distance per axis [m] between the equilibrium point and the tool.
    """

    command_mode = CommandMode.EFFORT
    rate = "physics"

    def __init__(
        self,
        *,
        max_delta: float = 0.05,
        stiffness: float = 800.0,
        rotational_stiffness: float = 40.0,
        damping: float = 80.0,
        rotational_damping: float = 2.0,
        joint_damping: float = 0.2,
        leash: float = 0.1,
    ) -> None:
        self.max_delta = positive("tcp_impedance: max_delta", max_delta, "m")
        linear = positive("tcp_impedance: stiffness", stiffness, "N/m")
        angular = positive("tcp_impedance: rotational_stiffness", rotational_stiffness, "N·m/rad")
        self._stiffness: Floats = np.repeat([linear, angular], 3)
        linear = non_negative("tcp_impedance: damping", damping, "N·s/m")
        angular = non_negative("tcp_impedance: rotational_damping", rotational_damping, "N·m·s/rad")
        self._damping: Floats = np.repeat([linear, angular], 3)
        self.joint_damping = non_negative("tcp_impedance: joint_damping", joint_damping, "N·m·s/rad")
        self._gravity: Floats = np.array([0.0, 0.0, -9.81])
        self.leash = positive("tcp_impedance: leash", leash, "m")

    def bind_scene(self, scene: Scene, simulation: Simulation) -> None:
        """Store the direction of gravity."""
        self._gravity = np.array(scene.gravity)

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare to control the given joints."""
        self._joints = joints
        moved = moved_links(joints)
        self._weights = [
            (link.name, link.inertial.mass, np.array(link.inertial.origin.pos))
            for link in joints.model.links
            if link.name in moved and link.inertial is not None
        ]
        self._target_pos, self._target_quat = np.zeros((joints.num_envs, 3)), np.zeros((joints.num_envs, 4))
        self.action_space = gym.spaces.Box(-1.0, 1.0, (3,), np.float32)
        self.reset(None)

    def reset(self, mask: Mask | None) -> None:
        """Set the equilibrium pose to the tool's current pose."""
        pos, quat_wxyz = self._joints.frame_pose("tcp")
        self._target_pos[rows_of(mask)], self._target_quat[rows_of(mask)] = pos[rows_of(mask)], quat_wxyz[rows_of(mask)]

    def apply(self, action: Action) -> Floats:
        """Move the equilibrium point, and return the efforts for the first physics step, (num_envs, dof) [N·m or N]."""
        tool, _ = self._joints.frame_pose("tcp")
        moved = self._target_pos + self.max_delta * np.clip(action, -1.0, 1.0)
        self._target_pos[:] = np.clip(moved, tool - self.leash, tool + self.leash)
        return self.update()

    def update(self) -> Floats:
        """Return the efforts for the next physics step, (num_envs, dof) [N·m or N]."""
        joints = self._joints
        pos, quat_wxyz = joints.frame_pose("tcp")
        jacobian = joints.frame_jacobian("tcp")  # (num_envs, 6, dof)
        error = np.concatenate([self._target_pos - pos, quat_difference(self._target_quat, quat_wxyz)], axis=1)
        velocity = np.concatenate(joints.frame_velocity("tcp"), axis=1)
        wrench = self._stiffness * error - self._damping * velocity  # (num_envs, 6)
        efforts = (jacobian * wrench[:, :, None]).sum(axis=1) - self.joint_damping * joints.joint_velocities
        efforts += self._gravity_efforts()
        return np.asarray(np.clip(efforts, -joints.effort_limit, joints.effort_limit))

    def _gravity_efforts(self) -> Floats:
        """Return the efforts that support the weight of the moved links, (num_envs, dof) [N·m or N]."""
        joints = self._joints
        efforts = np.zeros((joints.num_envs, joints.dof))
        for link, mass, center in self._weights:
            jacobian = joints.frame_jacobian(link)
            _, quat_wxyz = joints.frame_pose(link)
            arm = quat_rotate(quat_wxyz, np.broadcast_to(center, (joints.num_envs, 3)))
            # A force f at the center of mass is equivalent to f at the link's origin plus the torque arm × f.
            lift = np.broadcast_to(-mass * self._gravity, arm.shape)
            wrench = np.concatenate([lift, np.cross(arm, lift)], axis=1)
            efforts += (jacobian * wrench[:, :, None]).sum(axis=1)
        return efforts

    def snapshot(self) -> Snapshot:
        """Return the equilibrium pose."""
        return {"target_pos": self._target_pos.copy(), "target_quat_wxyz": self._target_quat.copy()}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""
        self._target_pos[:], self._target_quat[:] = snapshot["target_pos"], snapshot["target_quat_wxyz"]


def moved_links(joints: JointGroup) -> set[str]:
    """Return the names of all links that a joint group moves."""
    model, moving = joints.model, set(joints.joint_names)
    return {link.name for link in model.links if any(joint.name in moving for joint in joint_path(model, link.name))}
