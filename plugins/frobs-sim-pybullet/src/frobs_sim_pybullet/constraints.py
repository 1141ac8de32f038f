"""Computes joint friction and position limits as MuJoCo does, so that both engines produce the same motion.

Dry friction decelerates a joint with a bounded effort. A position limit pushes back a joint that has exceeded the
limit. The resulting efforts f minimize

    ½·fᵀ·(A + R)·f + fᵀ·(a − a*),   |f| ≤ friction,   f ≥ 0 at a limit.

Here, A is the inverse mass matrix, a is the acceleration without constraints, and a* = −B·v − K·d·r is the acceleration
that a constraint requests at a velocity v and a distance r. The softness R is (1 − d)/d times the diagonal of A at zero
joint positions. Friction uses MuJoCo's defaults: d = 0.9, K = 0, and B = 2 / (0.95 · 20 ms). Limits are as hard as the
timestep h allows: d rises from 0.99 to 0.999 over 1 mm or 1 mrad, K = 1 / (0.999 · 2h)², and B = 2 / (0.999 · 2h). For
details, see "Computation: Constraint model" in MuJoCo's documentation.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from operator import mul

import numpy as np

from frobs_core.util.arrays import Floats, Mask

_FRICTION_IMPEDANCE, _FRICTION_LARGEST, _FRICTION_TIME = 0.9, 0.95, 0.02  # the last in [s]
_LIMIT_IMPEDANCE, _LIMIT_LARGEST, _LIMIT_WIDTH = 0.99, 0.999, 0.001  # the last in [rad or m]
_GUESSES, _SWEEPS, _TOLERANCES = 10, 20, (1e-12, 1e-11, 1e-10, 1e-9, 1e-8)


class Constraints:
    """Dry friction and position limits of one robot's joints.

    Args:
        friction: Maximum effort of each moving joint's dry friction [N·m or N].
        lower: Lower position limit of each joint [rad or m], or −inf for an unlimited joint.
        upper: Upper position limit of each joint [rad or m], or inf for an unlimited joint.
        inverse_at_zero: Diagonal of the inverse mass matrix at zero joint positions. The last entries of the diagonal
            belong to the joints.
        physics_timestep: [s]
    """

    def __init__(
        self,
        friction: Sequence[float],
        lower: Sequence[float],
        upper: Sequence[float],
        inverse_at_zero: Floats,
        physics_timestep: float,
    ) -> None:
        self._lead = len(inverse_at_zero) - len(friction)
        self._rubbing = [i for i, limit in enumerate(friction) if limit > 0.0]
        self._ends = list(zip(lower, upper, strict=True))
        self._diagonal = inverse_at_zero.tolist()
        self._columns = self._lead + np.array(self._rubbing, np.intp)
        bounds = np.array([friction[i] for i in self._rubbing])
        share = (1.0 - _FRICTION_IMPEDANCE) / _FRICTION_IMPEDANCE
        self._friction = np.stack([np.ones(len(bounds)), share * inverse_at_zero[self._columns], -bounds, bounds])
        self._decay = 2.0 / (_FRICTION_LARGEST * max(_FRICTION_TIME, 2.0 * physics_timestep))  # [1/s]
        self._stiffness = 1.0 / (_LIMIT_LARGEST * 2.0 * physics_timestep) ** 2  # [1/s²]
        self._damping = 2.0 / (_LIMIT_LARGEST * 2.0 * physics_timestep)  # [1/s]

    def __call__(self, inverse: Floats, accelerations: Floats, q: Sequence[float], v: Sequence[float]) -> Floats | None:
        """Return the constraint efforts, (size,), or None if no constraint is active.

        Args:
            inverse: Inverse mass matrix, (size, size).
            accelerations: Accelerations without constraints, (size,).
            q: Joint positions [rad or m].
            v: Joint velocities [rad/s or m/s].
        """
        beyond = [*self._limit_rows(q, v)]
        if not (self._rubbing or beyond):
            return None
        columns, (signs, softness, low, high) = self._columns, self._friction
        requested = -self._decay * np.array([v[i] for i in self._rubbing])
        if beyond:
            numbers, *parts = np.array(beyond).T
            columns = np.concatenate([columns, numbers.astype(np.intp)])
            joined = zip((signs, requested, softness, low, high), parts, strict=True)
            signs, requested, softness, low, high = (np.concatenate(pair) for pair in joined)
        coupling = signs[:, None] * inverse[np.ix_(columns, columns)] * signs + np.diag(softness)
        efforts = _minimise(coupling, signs * accelerations[columns] - requested, low, high)
        result = np.zeros(len(accelerations))
        np.add.at(result, columns, signs * efforts)
        return result

    def _limit_rows(self, q: Sequence[float], v: Sequence[float]) -> Iterator[tuple[float, ...]]:
        """Yield the column, sign, requested acceleration, softness and effort bounds of each joint beyond a limit."""
        for i, (x, (lower, upper)) in enumerate(zip(q, self._ends, strict=True)):
            if lower <= x <= upper:
                continue
            sign, distance = (1.0, x - lower) if x < lower else (-1.0, upper - x)
            impedance = _impedance(-distance)
            softness = (1.0 - impedance) / impedance * self._diagonal[self._lead + i]
            requested = -self._damping * sign * v[i] - self._stiffness * impedance * distance
            yield self._lead + i, sign, requested, softness, 0.0, np.inf


def _impedance(depth: float) -> float:
    """Return a limit's impedance at a given depth, according to MuJoCo's curve with power 2 and midpoint 0.5."""
    x = min(1.0, depth / _LIMIT_WIDTH)
    rise = 2.0 * x * x if x <= 0.5 else 1.0 - 2.0 * (1.0 - x) ** 2
    return _LIMIT_IMPEDANCE + rise * (_LIMIT_LARGEST - _LIMIT_IMPEDANCE)


def _minimise(matrix: Floats, slope: Floats, low: Floats, high: Floats) -> Floats:
    """Return the f in [low, high] that minimizes ½·fᵀ·matrix·f + fᵀ·slope.

    An active-set method guesses which efforts are at their bounds. Gauss-Seidel sweeps then verify the guess and
    correct it if necessary. If the sweeps do not converge, the next guess starts from the result of the sweeps, with a
    larger tolerance. The tolerance increases because rounding errors can prevent very small efforts from converging.
    """
    efforts, free = np.zeros(len(slope)), np.ones(len(slope), np.bool_)
    for tolerance in _TOLERANCES:
        efforts = _guess(matrix, slope, low, high, efforts, free)
        efforts, settled = _sweep(matrix, slope, low, high, efforts, tolerance)
        if settled:
            break
        free = (low < efforts) & (efforts < high)
    return efforts


def _guess(matrix: Floats, slope: Floats, low: Floats, high: Floats, efforts: Floats, free: Mask) -> Floats:
    """Compute efforts, (n,), with an active-set method, from given efforts and a guess of those between their bounds.

    The efforts are exact if the final set of active bounds is correct.
    """
    for _ in range(_GUESSES):
        inner, outer = free.nonzero()[0], (~free).nonzero()[0]
        if not len(outer):
            efforts = np.asarray(np.linalg.solve(matrix, -slope), np.float64)
        elif len(inner):
            right = -slope[inner] - matrix[np.ix_(inner, outer)] @ efforts[outer]
            efforts[inner] = np.linalg.solve(matrix[np.ix_(inner, inner)], right)
        beyond = (efforts < low) | (efforts > high)
        efforts = np.minimum(np.maximum(efforts, low), high)
        pull = -(matrix @ efforts + slope)
        back = ~free & (((efforts == low) & (pull > 0.0)) | ((efforts == high) & (pull < 0.0)))
        if not (beyond | back).any():
            break
        free = (free & ~beyond) | back
    return efforts


def _sweep(
    matrix: Floats, slope: Floats, low: Floats, high: Floats, efforts: Floats, tolerance: float
) -> tuple[Floats, bool]:
    """Improve efforts by Gauss-Seidel sweeps, and return the efforts and whether they have converged."""
    solved = efforts.tolist()
    rows = list(
        zip(matrix.tolist(), slope.tolist(), low.tolist(), high.tolist(), matrix.diagonal().tolist(), strict=True)
    )
    for _ in range(_SWEEPS):
        change = 0.0
        for i, (row, start, least, most, pivot) in enumerate(rows):
            old = solved[i]
            value = solved[i] = min(most, max(least, old - (start + sum(map(mul, row, solved))) / pivot))
            change = max(change, abs(value - old) / max(1e-9, abs(value)))
        if change < tolerance:
            return np.array(solved), True
    return np.array(solved), False
