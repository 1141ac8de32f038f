"""The drive law for one robot in one environment: plain numbers, because NumPy costs more than it saves at this size.

With M the mass matrix, b the bias forces and h the physics timestep, the acceleration solves

    (M + h·D)·a = clip(Kp·(q* − q) − Kd·q̇ + ff) − d·q̇ − b,

where D holds the joint damping d, and Kd of the joints that are not saturated: MuJoCo's ``implicitfast`` with a position
actuator. What is asked of Bullet is the effort M·a + b, with which its own dynamics arrives at that a.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TypeAlias

import numpy as np

Matrix: TypeAlias = Sequence[Sequence[float]]
Solve: TypeAlias = Callable[[Matrix, Sequence[float], Sequence[float]], Sequence[float]]

_UNROLLED = 20  # equations up to which written-out Python is faster than NumPy


@lru_cache
def solver(size: int) -> Solve:
    """Return a function ``solve(matrix, diagonal, right)`` of ``size`` equations.

    It solves (matrix + diag(diagonal))·x = right for a symmetric, positive definite matrix by LDLᵀ. Up to 20 equations
    it is written out without loops: 3 µs for six, where NumPy takes 13 µs and loops take 15 µs.
    """
    if size > _UNROLLED:
        return _solve_large
    source: dict[str, Solve] = {}
    exec(_written_out(size), source)
    return source["solve"]


def _solve_large(matrix: Matrix, diagonal: Sequence[float], right: Sequence[float]) -> Sequence[float]:
    whole = np.array(matrix)
    whole[np.diag_indices(len(whole))] += diagonal
    solution: list[float] = np.linalg.solve(whole, np.array(right)).tolist()
    return solution


def _written_out(size: int) -> str:
    """Return the source of a solver without loops: L is l, its product with the diagonal u, the diagonal's inverse v."""
    names = range(size)
    lines = [f"({', '.join(f'm{i}_{j}' for j in range(i + 1))}, *_) = matrix[{i}]" for i in names]
    lines += [f"({''.join(f'd{i}, ' for i in names)}) = diagonal", f"({''.join(f'y{i}, ' for i in names)}) = right"]
    for i in names:
        for j in range(i):
            lines.append(f"u{i}_{j} = m{i}_{j}" + "".join(f" - u{i}_{k} * l{j}_{k}" for k in range(j)))
            lines.append(f"l{i}_{j} = u{i}_{j} * v{j}")
        lines.append(f"v{i} = 1.0 / (m{i}_{i} + d{i}" + "".join(f" - u{i}_{k} * l{i}_{k}" for k in range(i)) + ")")
        lines.append(f"y{i} = y{i}" + "".join(f" - l{i}_{k} * y{k}" for k in range(i)))
    for i in reversed(names):
        lines.append(f"x{i} = y{i} * v{i}" + "".join(f" - l{k}_{i} * x{k}" for k in range(i + 1, size)))
    lines.append(f"return ({''.join(f'x{i}, ' for i in names)})")
    return "def solve(matrix, diagonal, right):\n" + "\n".join(f"    {line}" for line in lines)
