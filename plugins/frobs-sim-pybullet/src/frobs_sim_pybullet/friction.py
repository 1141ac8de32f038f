"""Dry friction in joints, as MuJoCo's ``frictionloss`` has it, so that both engines make the same motion of it.

It is a constraint that wants a joint's velocity to decay, and whose effort is bounded: the effort f minimises

    ½·fᵀ·(A + R)·f + fᵀ·(a + B·q̇),   |f| ≤ friction,

with A the inverse mass matrix, a the acceleration without friction, and MuJoCo's default softness: R = (1 − d)/d of A's
diagonal at zero positions with d = 0.9, and B = 2 / (0.95 · 20 ms). See "Computation: Constraint model" of its manual.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from frobs_core.arrays import Floats

_IMPEDANCE, _LARGEST_IMPEDANCE = 0.9, 0.95
_TIME_CONSTANT = 0.02  # [s]
_SWEEPS, _TOLERANCE = 200, 1e-13


class Friction:
    """Dry friction of the joints of one robot.

    Args:
        friction: Largest effort of each joint that moves [N·m or N].
        mass_at_zero: Mass matrix at zero positions; its last columns are the joints'.
        physics_timestep: [s]
    """

    def __init__(self, friction: Sequence[float], mass_at_zero: Floats, physics_timestep: float) -> None:
        lead = len(mass_at_zero) - len(friction)
        rubbing = [i for i, limit in enumerate(friction) if limit > 0.0]
        self._columns = np.array(rubbing) + lead
        self._limits = [friction[i] for i in rubbing]
        self._lead = lead
        diagonal = np.diag(np.linalg.inv(mass_at_zero))[self._columns]
        self._softness = (1.0 - _IMPEDANCE) / _IMPEDANCE * diagonal
        self._decay = 2.0 / (_LARGEST_IMPEDANCE * max(_TIME_CONSTANT, 2.0 * physics_timestep))  # [1/s]

    def __call__(self, mass: Floats, armature: Sequence[float], right: Floats, v: Sequence[float]) -> Floats:
        """Return the friction efforts, (size,).

        Args:
            mass: (size, size)
            armature: Of the joints [kg·m² or kg].
            right: All other efforts, (size,).
            v: Velocities, (size,).
        """
        columns = self._columns
        inverse = np.linalg.inv(mass + np.diag([0.0] * self._lead + list(armature)))
        coupling = inverse[np.ix_(columns, columns)] + np.diag(self._softness)
        slope = (inverse[columns] @ right + self._decay * np.array(v)[columns]).tolist()
        rows, efforts = coupling.tolist(), [0.0] * len(columns)
        for _ in range(_SWEEPS):  # projected Gauss-Seidel
            change = 0.0
            for i, (row, limit) in enumerate(zip(rows, self._limits, strict=True)):
                residual = slope[i] + sum(a * f for a, f in zip(row, efforts, strict=True))
                value = min(limit, max(-limit, efforts[i] - residual / row[i]))
                change = max(change, abs(value - efforts[i]) / limit)
                efforts[i] = value
            if change < _TOLERANCE:
                break
        result = np.zeros(len(right))
        result[columns] = efforts
        return result
