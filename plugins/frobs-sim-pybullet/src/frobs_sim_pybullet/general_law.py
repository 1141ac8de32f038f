"""The drive law in NumPy, for robots with dry friction, mimic joints, many joints, or joints beyond their limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from frobs_core.models import Mimic
from frobs_core.util.arrays import Floats
from frobs_sim_pybullet.constraints import Constraints
from frobs_sim_pybullet.law import Constants, Matrix


class GeneralLaw:
    """The drive law of :func:`frobs_sim_pybullet.law.law` in NumPy, with mimic joints and constraints.

    Mimic joints follow their leaders exactly, because the equations are solved only for the independent joints.

    Args:
        offset: Number of columns in the mass matrix that belong to the base.
        count: Number of joints.
        constraints: Dry friction and position limits, or None to ignore them.
        armature: Armature of each joint [kg·m² or kg].
        mimics: For each mimic joint, the index of the joint, the index of its leader, and the model's mimic element.

    Attributes:
        accelerations: Accelerations of the joints without contacts, (count,), computed by the last call.
    """

    accelerations: Floats

    def __init__(
        self,
        offset: int,
        count: int,
        constraints: Constraints | None,
        armature: Sequence[float],
        mimics: Sequence[tuple[int, int, Mimic]],
    ) -> None:
        self._offset, self._constraints = offset, constraints
        self._armature = np.diag([0.0] * offset + list(armature))
        self._reduction: Floats | None = None
        if mimics:
            reduction = np.eye(offset + count)
            for follower, leader, mimic in mimics:
                reduction[offset + follower, offset + leader] = mimic.multiplier
            self._reduction = np.delete(reduction, [offset + follower for follower, _, _ in mimics], axis=1)

    def __call__(
        self,
        q: Sequence[float],
        v: Sequence[float],
        command: Sequence[float],
        constants: Constants,
        matrix: Matrix,
        bias: Sequence[float],
    ) -> tuple[list[float], list[float]]:
        """Return the efforts to pass to Bullet, and the efforts that the drives apply."""
        kp, kd, limit, damping, inertia, drive_inertia = np.reshape(constants, (-1, 6)).T
        speeds = np.array(v)
        explicit = np.array(command) - kp * np.array(q) - kd * speeds
        saturated = np.abs(explicit) >= limit
        efforts = np.clip(explicit, -limit, limit)
        lead = np.zeros(self._offset)
        right = np.concatenate([lead, efforts - damping * speeds]) - bias
        mass = np.array(matrix)
        if self._constraints is not None:
            inverse = self._inverse(mass + self._armature)
            held = self._constraints(inverse, inverse @ right, q, v)
            right = right if held is None else right + held
        effective_mass = mass + np.diag(np.concatenate([lead, inertia + np.where(saturated, 0.0, drive_inertia)]))
        if self._reduction is None:
            accelerations = np.linalg.solve(effective_mass, right)
        else:
            follow = self._reduction
            accelerations = follow @ np.linalg.solve(follow.T @ effective_mass @ follow, follow.T @ right)
        torques: list[float] = (mass @ accelerations + bias)[self._offset :].tolist()
        self.accelerations = accelerations[self._offset :]
        return torques, efforts.tolist()

    def _inverse(self, mass: Floats) -> Floats:
        """Return the inverse mass matrix of all joints, including mimic joints, which follow their leaders."""
        if self._reduction is None:
            return np.asarray(np.linalg.inv(mass), np.float64)
        follow = self._reduction
        return np.asarray(follow @ np.linalg.inv(follow.T @ mass @ follow) @ follow.T)
