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
from typing import Any, TypeAlias

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
    return _solver(len(right))(matrix, diagonal, right)[first:]


@lru_cache
def _solver(size: int) -> Callable[[Matrix, Sequence[float], Sequence[float]], Sequence[float]]:
    """Return a function that solves ``size`` equations without loops, which would take more than twice as long.

    In its variable names, u denotes an entry of the matrix and later of L·D, l an entry of L, and p an inverse pivot.
    """
    numbers = range(size)

    def unpack(name: str, values: str) -> str:
        return f"{''.join(f'{name}{i}, ' for i in numbers)}= {values}"

    code = [unpack(f"u{i}_", f"matrix[{i}]") for i in numbers] + [unpack("d", "diagonal"), unpack("y", "right")]
    for i in numbers:
        for j in range(i):
            terms = "".join(f" - u{i}_{k} * l{j}_{k}" for k in range(j))
            code += [f"u{i}_{j} = u{i}_{j}{terms}", f"l{i}_{j} = u{i}_{j} * p{j}"]
        pivot = f"u{i}_{i} + d{i}" + "".join(f" - u{i}_{k} * l{i}_{k}" for k in range(i))
        code += [f"p{i} = 1.0 / ({pivot})", f"y{i} = y{i}" + "".join(f" - l{i}_{k} * y{k}" for k in range(i))]
    for i in reversed(numbers):
        code.append(f"x{i} = y{i} * p{i}" + "".join(f" - l{k}_{i} * x{k}" for k in range(i + 1, size)))
    code.append(f"return [{', '.join(f'x{i}' for i in numbers)}]")
    scope: dict[str, Any] = {}
    exec("\n    ".join(["def solve(matrix, diagonal, right):", *code]), scope)  # contains nothing but the names above
    solver: Callable[[Matrix, Sequence[float], Sequence[float]], Sequence[float]] = scope["solve"]
    return solver
