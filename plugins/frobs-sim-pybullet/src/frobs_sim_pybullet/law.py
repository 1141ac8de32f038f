"""The drive law for one robot in one environment: plain numbers, because NumPy costs more than it saves at this size.

With M the mass matrix, b the bias forces and h the physics timestep, the acceleration solves

    (M + h·D)·a = clip(Kp·(q* − q) − Kd·q̇ + ff) − d·q̇ − b,

where D holds the joint damping d, and Kd of the joints that are not saturated: MuJoCo's ``implicitfast`` with a position
actuator. What is asked of Bullet is the effort M·a + b, with which its own dynamics arrives at that a.

For robots of up to 20 degrees of freedom the law is written out, without loops, for their number of joints: for six that
takes 6 µs, where loops take 25 µs and NumPy 20 µs, in each physics step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple, TypeAlias

Matrix: TypeAlias = Sequence[Sequence[float]]
Solve: TypeAlias = Callable[[Matrix, Sequence[float], Sequence[float]], Sequence[float]]

MOST_WRITTEN_OUT = 20
"""Equations up to which written-out Python is faster than NumPy."""


class Constants(NamedTuple):
    """What stays the same during a control step, one number for each joint.

    Attributes:
        kp: Stiffness.
        kd: Damping of the drive.
        limit: Of the effort.
        damping: The joint's own.
        inertia: Armature + h · damping.
        drive_inertia: h · kd.
    """

    kp: Sequence[float]
    kd: Sequence[float]
    limit: Sequence[float]
    damping: Sequence[float]
    inertia: Sequence[float]
    drive_inertia: Sequence[float]


Law: TypeAlias = Callable[
    [Sequence[float], Sequence[float], Sequence[float], Constants, Matrix, Sequence[float]],
    tuple[list[float], list[float]],
]


@lru_cache
def solver(size: int) -> Solve:
    """Return ``solve(matrix, diagonal, right)``: x of (matrix + diag(diagonal))·x = right, by LDLᵀ, of a fixed size."""
    names = range(size)
    lines = [*_unpack("d", names, "diagonal"), *_unpack("y", names, "right"), *_solution(size, names)]
    lines.append(f"return ({''.join(f'x{i}, ' for i in names)})")
    return _define("solve(matrix, diagonal, right)", lines)


@lru_cache
def law(offset: int, count: int) -> Law:
    """Return the law of a robot with ``count`` joints whose mass matrix begins with ``offset`` columns of the base.

    The function takes positions, velocities and commands of the joints, their constants, the mass matrix and the bias
    forces; it returns the efforts for Bullet, and those that the drives apply.
    """
    joints = range(offset, offset + count)
    lines = ["kp, kd, limit, damping, inertia, drive_inertia = constants"]
    for prefix, values in {
        "q": "q", "w": "v", "c": "command", "p": "kp", "k": "kd", "g": "limit", "f": "damping", "i": "inertia",
        "h": "drive_inertia",
    }.items():  # fmt: skip
        lines += _unpack(prefix, joints, values)
    lines += _unpack("b", range(offset + count), "bias")
    lines += [f"y{i} = -b{i}; d{i} = 0.0" for i in range(offset)]
    for i in joints:
        lines += [
            f"e{i} = c{i} - p{i} * q{i} - k{i} * w{i}; d{i} = i{i}",
            f"if e{i} >= g{i}: e{i} = g{i}",
            f"elif e{i} <= -g{i}: e{i} = -g{i}",
            f"else: d{i} = i{i} + h{i}",
            f"s{i} = e{i} - f{i} * w{i}; y{i} = s{i} - b{i}",
        ]
    lines += _solution(offset + count, joints)
    efforts, torques = (", ".join(f"e{i}" for i in joints), ", ".join(f"s{i} - d{i} * x{i}" for i in joints))
    lines.append(f"return [{torques}], [{efforts}]")
    return _define("law(q, v, command, constants, matrix, bias)", lines)


def _unpack(prefix: str, names: Sequence[int], values: str) -> list[str]:
    return [f"({''.join(f'{prefix}{i}, ' for i in names)}) = {values}"] if names else []


def _solution(size: int, wanted: Sequence[int]) -> list[str]:
    """Return lines that solve (matrix + diag(d))·x = y: L is l, its product with the diagonal u, that one's inverse v."""
    names = range(size)
    lines = [f"({', '.join(f'm{i}_{j}' for j in range(i + 1))}, *_) = matrix[{i}]" for i in names]
    for i in names:
        for j in range(i):
            lines.append(f"u{i}_{j} = m{i}_{j}" + "".join(f" - u{i}_{k} * l{j}_{k}" for k in range(j)))
            lines.append(f"l{i}_{j} = u{i}_{j} * v{j}")
        lines.append(f"v{i} = 1.0 / (m{i}_{i} + d{i}" + "".join(f" - u{i}_{k} * l{i}_{k}" for k in range(i)) + ")")
        lines.append(f"y{i} = y{i}" + "".join(f" - l{i}_{k} * y{k}" for k in range(i)))
    for i in reversed(names):
        if i >= wanted[0]:
            lines.append(f"x{i} = y{i} * v{i}" + "".join(f" - l{k}_{i} * x{k}" for k in range(i + 1, size)))
    return lines


def _define(signature: str, lines: Sequence[str]) -> Callable[..., Any]:
    """Return the function of this source; it holds numbers of ours alone, nothing from outside."""
    source: dict[str, Any] = {}
    exec(f"def {signature}:\n" + "\n".join(f"    {line}" for line in lines), source)
    function: Callable[..., Any] = source[signature.partition("(")[0]]
    return function
