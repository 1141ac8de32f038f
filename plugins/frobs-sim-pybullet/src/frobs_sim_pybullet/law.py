"""The drive law for one robot in one environment, in pure Python, which is faster than NumPy for few joints.

The acceleration a is the solution of the following equation with the mass matrix M, bias forces b and physics timestep
h:

    (M + h·D)·a = clip(Kp·(q* − q) − Kd·q̇ + ff) − d·q̇ − b.

The diagonal matrix D contains the joint damping d, plus Kd for joints whose drives are not saturated. This equation
corresponds to MuJoCo's ``implicitfast`` integrator with a position actuator. The effort M·a + b is passed to Bullet,
whose own dynamics then yield the acceleration a.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import chain
from typing import TypeAlias

Matrix: TypeAlias = Sequence[Sequence[float]]

LARGEST = 8
"""Largest number of equations for which :func:`law` is as fast as the general law in NumPy."""


Constants: TypeAlias = Sequence[tuple[float, float, float, float, float, float]]
"""Constants of the drive law during a control step, with one row per joint.

The columns are the drive's stiffness, the drive's damping, the effort limit, the joint's damping, the joint's inertia
(armature + h · damping of the joint), and the drive's contribution to the inertia (h · damping of the drive).
"""

Law: TypeAlias = Callable[
    [Sequence[float], Sequence[float], Sequence[float], Constants, Matrix, Sequence[float]],
    tuple[list[float], list[float]],
]


def law(
    q: Sequence[float],
    v: Sequence[float],
    command: Sequence[float],
    constants: Constants,
    matrix: Matrix,
    bias: Sequence[float],
) -> tuple[list[float], list[float]]:
    """Compute the efforts for one physics step.

    Args:
        q: Joint positions, (count,) [rad or m].
        v: Joint velocities, (count,) [rad/s or m/s].
        command: Command of each joint (Kp·q*, Kd·v* or ff), (count,) [N·m or N].
        constants: Constants of each joint, (count, 6).
        matrix: Mass matrix, (size, size), whose first size − count columns belong to a free base.
        bias: Bias forces, (size,).

    Returns:
        The efforts to pass to Bullet, and the efforts that the drives apply, (count,) [N·m or N] each.
    """
    base = len(bias) - len(q)
    right: list[float] = []
    diagonal: list[float] = []
    if base:
        right, diagonal, bias = [-b for b in bias[:base]], [0.0] * base, bias[base:]
    efforts, damped = [], []
    joints = zip(q, v, command, bias, constants, strict=True)
    for x, w, c, b, (kp, kd, limit, damping, inertia, drive_inertia) in joints:
        effort = c - kp * x - kd * w
        if effort >= limit:
            effort = limit
        elif effort <= -limit:
            effort = -limit
        else:
            inertia += drive_inertia
        efforts.append(effort)
        effort -= damping * w
        damped.append(effort)
        right.append(effort - b)
        diagonal.append(inertia)
    accelerations = solve(matrix, diagonal, right, base)
    if base:
        diagonal = diagonal[base:]
    return [s - d * a for s, d, a in zip(damped, diagonal, accelerations, strict=True)], efforts


def solve(matrix: Matrix, diagonal: Sequence[float], right: Sequence[float], first: int = 0) -> Sequence[float]:
    """Solve (matrix + diag(diagonal))·x = right for x by LDLᵀ decomposition.

    Args:
        matrix: Symmetric matrix, (size, size), of which only the lower triangle is used.
        diagonal: (size,)
        right: (size,)
        first: Index of the first component of x to compute.

    Returns:
        The components of x from the index ``first`` to the end, (size − first,).
    """
    size = len(right)
    if size == 6:
        return _solve_six(matrix, diagonal, right)[first:]
    numbers = [*chain.from_iterable(matrix), *right]
    pivots, rows = _elimination(size)
    for (pivot, _, _), extra in zip(pivots, diagonal, strict=True):
        numbers[pivot] += extra
    for pivot, scaled, updates in pivots:
        inverse = numbers[pivot] = 1.0 / numbers[pivot]
        for factor, entry in scaled:
            numbers[factor] = numbers[entry] * inverse
        for target, factor, entry in updates:
            numbers[target] -= numbers[factor] * numbers[entry]
    for target, pivot, terms in rows[: size - first]:  # last component first
        x = numbers[target] * numbers[pivot]
        for factor, other in terms:
            x -= numbers[factor] * numbers[other]
        numbers[target] = x
    return numbers[size * size + first :]


_Pivot: TypeAlias = tuple[int, list[tuple[int, int]], list[tuple[int, int, int]]]
_Row: TypeAlias = tuple[int, int, list[tuple[int, int]]]


@lru_cache
def _elimination(size: int) -> tuple[list[_Pivot], list[_Row]]:
    """Return the indices that :func:`solve` uses in a flat list of the matrix's rows and the right-hand side.

    In the flat list, L·D replaces the lower triangle of the matrix, and Lᵀ replaces the upper triangle.
    """
    right = size * size
    pivots: list[_Pivot] = []
    for k in range(size):
        below = range(k + 1, size)
        scaled = [(k * size + i, i * size + k) for i in below]
        updates = [(i * size + j, i * size + k, k * size + j) for i in below for j in range(k + 1, i + 1)]
        updates += [(right + i, k * size + i, right + k) for i in below]
        pivots.append((k * size + k, scaled, updates))
    rows: list[_Row] = []
    for i in reversed(range(size)):
        terms = [(i * size + k, right + k) for k in range(i + 1, size)]
        rows.append((right + i, i * size + i, terms))
    return pivots, rows


def _solve_six(matrix: Matrix, diagonal: Sequence[float], right: Sequence[float]) -> Sequence[float]:
    """Solve six equations (the usual number) with the same rounding as the loops, but in less than half the time.

    In the variable names, m denotes an entry of the matrix, p an inverse pivot, l an entry of L, and u an entry of L·D.
    """
    row0, row1, row2, row3, row4, row5 = matrix
    m00, _, _, _, _, _ = row0
    u10, m11, _, _, _, _ = row1
    u20, u21, m22, _, _, _ = row2
    u30, u31, u32, m33, _, _ = row3
    u40, u41, u42, u43, m44, _ = row4
    u50, u51, u52, u53, u54, m55 = row5
    d0, d1, d2, d3, d4, d5 = diagonal
    y0, y1, y2, y3, y4, y5 = right

    p0 = 1.0 / (m00 + d0)

    l10 = u10 * p0
    p1 = 1.0 / (m11 + d1 - u10 * l10)
    y1 = y1 - l10 * y0

    l20 = u20 * p0
    u21 = u21 - u20 * l10
    l21 = u21 * p1
    p2 = 1.0 / (m22 + d2 - u20 * l20 - u21 * l21)
    y2 = y2 - l20 * y0 - l21 * y1

    l30 = u30 * p0
    u31 = u31 - u30 * l10
    l31 = u31 * p1
    u32 = u32 - u30 * l20 - u31 * l21
    l32 = u32 * p2
    p3 = 1.0 / (m33 + d3 - u30 * l30 - u31 * l31 - u32 * l32)
    y3 = y3 - l30 * y0 - l31 * y1 - l32 * y2

    l40 = u40 * p0
    u41 = u41 - u40 * l10
    l41 = u41 * p1
    u42 = u42 - u40 * l20 - u41 * l21
    l42 = u42 * p2
    u43 = u43 - u40 * l30 - u41 * l31 - u42 * l32
    l43 = u43 * p3
    p4 = 1.0 / (m44 + d4 - u40 * l40 - u41 * l41 - u42 * l42 - u43 * l43)
    y4 = y4 - l40 * y0 - l41 * y1 - l42 * y2 - l43 * y3

    l50 = u50 * p0
    u51 = u51 - u50 * l10
    l51 = u51 * p1
    u52 = u52 - u50 * l20 - u51 * l21
    l52 = u52 * p2
    u53 = u53 - u50 * l30 - u51 * l31 - u52 * l32
    l53 = u53 * p3
    u54 = u54 - u50 * l40 - u51 * l41 - u52 * l42 - u53 * l43
    l54 = u54 * p4
    p5 = 1.0 / (m55 + d5 - u50 * l50 - u51 * l51 - u52 * l52 - u53 * l53 - u54 * l54)
    y5 = y5 - l50 * y0 - l51 * y1 - l52 * y2 - l53 * y3 - l54 * y4

    x5 = y5 * p5
    x4 = y4 * p4 - l54 * x5
    x3 = y3 * p3 - l43 * x4 - l53 * x5
    x2 = y2 * p2 - l32 * x3 - l42 * x4 - l52 * x5
    x1 = y1 * p1 - l21 * x2 - l31 * x3 - l41 * x4 - l51 * x5
    x0 = y0 * p0 - l10 * x1 - l20 * x2 - l30 * x3 - l40 * x4 - l50 * x5
    return x0, x1, x2, x3, x4, x5
