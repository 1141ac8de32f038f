"""Differential inverse kinematics for batches of arms by damped least squares within joint limits."""

from __future__ import annotations

from typing import Any

import numpy as np

from frobs_core.contracts import JointGroup
from frobs_core.models import joint_path
from frobs_core.util.arrays import Floats


class DampedLeastSquares:
    """Differential inverse kinematics that removes a frame's pose error e: u += z + Jᵀ (J Jᵀ + λ² 1)⁻¹ (e − J z).

    The damping λ limits the joints' motion near singularities and lets them come to rest if the target is out of reach
    (Nakamura and Hanafusa 1986; Wampler 1986). The posture step z = g · (home − u) uses the remaining degrees of
    freedom. The posture step prevents a redundant arm from drifting. It also bends a fully stretched arm, for which the
    Jacobian alone does not provide a direction (Siciliano et al., "Robotics", 2009, §3.5).

    Two limits are respected:

    - No joint moves farther than its velocity limit allows in one control step.
    - Joints that would move beyond a position limit are excluded, and the other joints compensate for them (as in the
    projected Newton method, Bertsekas 1982).

    All matrix products are computed as stacks of small products, so that each environment in a batch gets results that
    are bit-identical to those of a single environment.

    Args:
        joints: Joints to move. The controlled frame is the group's ``"tcp"``.
        rows: Number of Jacobian rows to use: 3 to control the frame's position, 6 to control its pose.
        damping: Damping λ > 0, in the Jacobian's units [m/rad].
        posture_gain: Gain g in [0, 1): fraction of the remaining distance to home that is covered at each step.
        control_timestep: [s]

    Attributes:
        free_row: Row of the Jacobian in which the pose is not controlled, or None.
        commanded: Commanded joint positions u, (num_envs, dof) [rad or m].
    """

    def __init__(
        self, joints: JointGroup, *, rows: int, damping: float, posture_gain: float, control_timestep: float
    ) -> None:
        n, dof = joints.num_envs, joints.dof
        self._group = joints
        self._rows = rows
        self._lower, self._upper = joints.position_lower.copy(), joints.position_upper.copy()
        self._fastest = joints.velocity_limit * control_timestep  # [rad or m] per control step
        self._slowest = -self._fastest
        self._damping = np.broadcast_to(damping**2 * np.eye(rows), (n, rows, rows)).copy()
        self._home = joints.home.copy()
        # Wheels and fingers do not move the tool, so nothing would compensate for the posture step.
        moving = {joint.name for joint in joint_path(joints.model, joints.tcp)}
        gains = [posture_gain if joint in moving else 0.0 for joint in joints.joint_names]
        self._posture_gain = np.broadcast_to(gains, (n, dof)).copy()
        self.free_row: int | None = None
        self.commanded: Floats = np.zeros((n, dof))

        # One matrix product with Jᵀ yields the Gram matrix J Jᵀ, and maps the command's lead and the posture step to the
        # tool.
        factors, products = np.zeros((n, rows + 2, dof)), np.zeros((n, rows + 2, rows))
        self._factors, self._products = factors, products
        self._jacobian, self._offset, self._posture = factors[:, :rows], factors[:, rows], factors[:, rows + 1]
        self._gram, self._ahead, self._drift = products[:, :rows], products[:, rows], products[:, rows + 1]
        self._transposed = self._jacobian.transpose(0, 2, 1)
        self._solve = solve_3x3 if rows == 3 else np.linalg.solve
        self._task, self._delta = np.zeros((n, rows, 1)), np.zeros((n, dof, 1))
        self._task_flat, self._delta_flat = self._task[:, :, 0], self._delta[:, :, 0]
        self._before, self._beyond = np.zeros((n, dof)), np.zeros((n, dof))

    def lead(self) -> Floats:
        """Read the Jacobian, and return how far the command is ahead of the arm: J (u − q), (num_envs, rows).

        To first order, the tool's pose plus this lead is the pose at the commanded joint positions. Therefore, the
        drives' remaining motion and their deflection under gravity are not treated as pose errors.
        """
        self._jacobian[...] = self._group.frame_jacobian("tcp")[:, : self._rows]
        if self.free_row is not None:
            self._jacobian[:, self.free_row] = 0.0
        np.subtract(self.commanded, self._group.joint_positions, out=self._offset)
        np.subtract(self._home, self.commanded, out=self._posture)
        np.multiply(self._posture, self._posture_gain, out=self._posture)
        self._multiply()
        return self._ahead

    def move(self, error: Floats) -> Floats:
        """Update the commanded joint positions to move the tool by ``error``, and return the updated positions.

        Call :meth:`lead` first.

        Args:
            error: (num_envs, rows)
        """
        commanded, beyond = self.commanded, self._beyond
        self._before[...] = commanded
        self._step(error)
        if commanded.tobytes() != beyond.tobytes() and self._hold_at_limits():
            self._step(error)
        return commanded

    def numbers(self) -> dict[str, Any]:
        """Return the numbers of the first environment: limits, home and posture gain of the joints, and the damping."""
        return {
            "lower": self._lower[0].tolist(),
            "upper": self._upper[0].tolist(),
            "max_change": self._fastest[0].tolist(),  # [rad or m] per control step
            "home": self._home[0].tolist(),
            "posture_gain": self._posture_gain[0].tolist(),
            "damping": float(self._damping[0, 0, 0]),  # λ²
            "free_row": self.free_row,
        }

    def _multiply(self) -> None:
        np.matmul(self._factors, self._transposed, out=self._products)
        np.add(self._gram, self._damping, out=self._gram)

    def _step(self, error: Floats) -> None:
        """Compute the commanded joint positions, and in ``_beyond`` the positions without the position limits."""
        commanded, delta = self.commanded, self._delta_flat
        np.subtract(error, self._drift, out=self._task_flat)
        np.matmul(self._transposed, self._solve(self._gram, self._task), out=self._delta)
        np.add(delta, self._posture, out=delta)
        np.maximum(delta, self._slowest, out=delta)
        np.minimum(delta, self._fastest, out=delta)
        np.add(self._before, delta, out=self._beyond)
        np.maximum(self._beyond, self._lower, out=commanded)
        np.minimum(commanded, self._upper, out=commanded)

    def _hold_at_limits(self) -> bool:
        """Exclude joints that would move beyond a position limit, and return whether any joints were excluded.

        In an environment without such joints, all values are multiplied by 1, so they remain bit-identical.
        """
        before, delta = self._before, self._delta_flat
        held = ((before <= self._lower) & (delta < 0.0)) | ((before >= self._upper) & (delta > 0.0))
        if not held.any():
            return False
        np.multiply(self._jacobian, ~held[:, None], out=self._jacobian)
        np.multiply(self._posture, ~held, out=self._posture)
        self._multiply()
        return True


def solve_3x3(matrix: Floats, vector: Floats) -> Floats:
    """Solve well-conditioned symmetric 3 × 3 systems like ``np.linalg.solve``, but in half the time.

    A single system is solved with Python floats, which are faster. Python floats round like NumPy floats, so the result
    is bit-identical to the result for a batch.

    Args:
        matrix: (n, 3, 3)
        vector: (n, 3, 1)

    Returns:
        (n, 3, 1)
    """
    if len(matrix) == 1:
        (((a, b, c), (_, d, e), (_, _, f)),) = matrix.tolist()
        (((x,), (y,), (z,)),) = vector.tolist()
        return np.array(_cramer(a, b, c, d, e, f, x, y, z)).reshape(1, 3, 1)
    a, b, c = matrix[:, 0, 0], matrix[:, 0, 1], matrix[:, 0, 2]
    d, e, f = matrix[:, 1, 1], matrix[:, 1, 2], matrix[:, 2, 2]
    return np.stack(_cramer(a, b, c, d, e, f, *vector[:, :, 0].T), axis=-1)[:, :, None]


def _cramer(a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, x: Any, y: Any, z: Any) -> tuple[Any, Any, Any]:
    """Solve [[a, b, c], [b, d, e], [c, e, f]] s = (x, y, z) by Cramer's rule, for floats or arrays."""
    aa, bb, cc = d * f - e * e, c * e - b * f, b * e - c * d  # the cofactors
    dd, ee, ff = a * f - c * c, b * c - a * e, a * d - b * b
    inverse = 1.0 / (a * aa + b * bb + c * cc)
    return (
        (aa * x + bb * y + cc * z) * inverse,
        (bb * x + dd * y + ee * z) * inverse,
        (cc * x + ee * y + ff * z) * inverse,
    )
