"""Impedance controller whose actions move the equilibrium of a spring that pulls the tool center point."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from frobs_controllers.dynamics import Dynamics
from frobs_core.contracts import CommandMode, Controller, JointGroup, Simulation, Snapshot
from frobs_core.description import Scene
from frobs_core.util.arrays import Action, Floats, Mask, rows_of
from frobs_core.util.rotations import quat_difference
from frobs_core.util.validation import non_negative, positive


class TcpImpedance(Controller):
    """Controller that makes the tool act like a mass on a spring and damper: τ = Jᵀ (K (x* − x) − D v) − d q̇ + g(q).

    The control law is due to Hogan (1985). The first three components of the spring act on the tool's position. The
    spring's last three components maintain the orientation that the tool had at the start of the episode. An action in
    [−1, 1]³ moves the equilibrium point along the world's axes. The term g(q) compensates for the weight of the links
    that the group moves, as specified by the model file.

    The torques are computed at every physics step, so that objects in contact with the tool feel a spring instead of a
    stiff drive. A step takes several times as long to compute as with a controller that runs at the control rate.

    Within one physics step h, a joint with a small inertia can react so strongly that its motion would grow from step
    to step. Therefore, the spring and the damper are treated implicitly, with the mass matrix M of the joints:
    τ = M (M + h² JᵀKJ)⁻¹ Jᵀ K (x* − x) − M (M + h (JᵀDJ + d))⁻¹ (Jᵀ D v + d q̇) + g(q). For small motions, this law is
    stable for all stiffnesses and dampings, even if the simulated masses are up to a quarter smaller than those in the
    model file, or larger by any factor. At rest, the compliance of the tool is K⁻¹ + h² J M⁻¹ Jᵀ. The second term is
    noticeable only if K requires a faster reaction than one physics step. For example, a bare flange turns more easily
    about its own axis than ``rotational_stiffness`` specifies.

    The weight of a held object is not compensated: it pulls the tool down by the weight divided by the stiffness.

    The equilibrium pose is fixed in the world. If the robot's base moves, the spring keeps the tool in its place until
    the distance per axis reaches ``leash``; then the base drags the tool along. M assumes that the base is held, so a
    base that moves freely must be much heavier than the arm.

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
        rotational_damping: float = 4.0,
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
        self._dynamics, self._physics_timestep = Dynamics(joints), control_timestep / decimation
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
        joints, h = self._joints, self._physics_timestep
        pos, quat_wxyz = joints.frame_pose("tcp")
        jacobian = joints.frame_jacobian("tcp")  # (num_envs, 6, dof)
        transposed = jacobian.transpose(0, 2, 1)
        mass, efforts = self._dynamics(self._gravity)
        error = np.concatenate([self._target_pos - pos, quat_difference(self._target_quat, quat_wxyz)], axis=1)
        velocity = np.concatenate(joints.frame_velocity("tcp"), axis=1)
        spring = transposed @ (self._stiffness * error)[:, :, None]  # (num_envs, dof, 1)
        damper = transposed @ (self._damping * velocity)[:, :, None]
        damper += self.joint_damping * joints.joint_velocities[:, :, None]
        stiffness = transposed @ (self._stiffness[:, None] * jacobian)  # (num_envs, dof, dof)
        damping = transposed @ (self._damping[:, None] * jacobian) + self.joint_damping * np.eye(joints.dof)
        acceleration = np.linalg.solve(mass + h**2 * stiffness, spring) - np.linalg.solve(mass + h * damping, damper)
        efforts += (mass @ acceleration)[:, :, 0]
        return np.asarray(np.clip(efforts, -joints.effort_limit, joints.effort_limit))

    def stored_arrays(self) -> Snapshot:
        """Return the equilibrium pose."""
        return {"target_pos": self._target_pos, "target_quat_wxyz": self._target_quat}
