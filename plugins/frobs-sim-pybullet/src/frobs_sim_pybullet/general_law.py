"""The drive law for robots that the written-out one is not for: with dry friction, joints that follow others, or many."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.models import Mimic
from frobs_sim_pybullet.friction import Friction
from frobs_sim_pybullet.law import Constants, Matrix


class GeneralLaw:
    """A law as :func:`frobs_sim_pybullet.law.law` returns them, in NumPy.

    Joints that follow others do so exactly: the equations are those of the independent joints.

    Args:
        offset: Columns of the mass matrix that are the base's.
        count: Joints.
        friction: Dry friction of the joints; None: none has any.
        armature: Of the joints [kg·m² or kg].
        mimics: (follower, leader) among the joints, and how it follows.
    """

    def __init__(
        self,
        offset: int,
        count: int,
        friction: Friction | None,
        armature: Sequence[float],
        mimics: Sequence[tuple[int, int, Mimic]],
    ) -> None:
        self._offset, self._friction, self._armature = offset, friction, armature
        self._reduction: Floats | None = None
        if mimics:
            whole = np.eye(offset + count)
            for follower, leader, mimic in mimics:
                whole[offset + follower, offset + leader] = mimic.multiplier
            self._reduction = np.delete(whole, [offset + follower for follower, _, _ in mimics], axis=1)

    def __call__(
        self,
        q: Sequence[float],
        v: Sequence[float],
        command: Sequence[float],
        constants: Constants,
        matrix: Matrix,
        bias: Sequence[float],
    ) -> tuple[list[float], list[float]]:
        """Return the efforts for Bullet, and those that the drives apply."""
        kp, kd, limit, damping, inertia, drive_inertia = (np.array(values) for values in constants)
        speeds = np.array(v)
        explicit = np.array(command) - kp * np.array(q) - kd * speeds
        saturated = np.abs(explicit) >= limit
        efforts = np.clip(explicit, -limit, limit)
        lead = np.zeros(self._offset)
        right = np.concatenate([lead, efforts - damping * speeds]) - bias
        mass = np.array(matrix)
        if self._friction is not None:
            right = right + self._friction(mass, self._armature, right, np.concatenate([lead, speeds]))
        whole = mass + np.diag(np.concatenate([lead, inertia + np.where(saturated, 0.0, drive_inertia)]))
        if self._reduction is None:
            accelerations = np.linalg.solve(whole, right)
        else:
            follow = self._reduction
            accelerations = follow @ np.linalg.solve(follow.T @ whole @ follow, follow.T @ right)
        torques: list[float] = (mass @ accelerations + bias)[self._offset :].tolist()
        return torques, efforts.tolist()
