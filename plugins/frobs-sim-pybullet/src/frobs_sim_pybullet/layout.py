"""Arrays of shape (num_envs, …) that the simulation shares with all its worker processes."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterable, Mapping
from multiprocessing.context import BaseContext
from typing import Any, TypeAlias

import numpy as np

from frobs_core.contracts import ContactState
from frobs_core.description import Placement, Scene

Layout: TypeAlias = dict[str, tuple[tuple[int, ...], str]]
"""Row shape and dtype of each shared array, by array name. Each environment has one row."""

Arrays: TypeAlias = dict[str, np.ndarray[Any, Any]]


def layout(robots: Mapping[str, Placement], scene: Scene) -> Layout:
    """Return the layout of the shared arrays.

    Poses, twists and Jacobians are written only on request, so unused arrays do not occupy physical memory.
    """
    fields: Layout = {"time": ((), "f8"), "diverged": ((), "?"), **ContactState.fields(scene)}
    for name, placement in robots.items():
        dof = len(placement.model.joint_names)
        for field in ("command", "positions", "velocities", "efforts"):
            fields[f"robots/{name}/{field}"] = (dof,), "f8"
        # Kp and Kd in the current command mode, and the joint damping
        fields[f"robots/{name}/gains"] = (3, dof), "f8"
        for sensor in placement.force_torque_sensors:
            fields[f"robots/{name}/wrench/{sensor}"] = (6,), "f8"
        for link in placement.model.links:
            fields[f"robots/{name}/pose/{link.name}"] = (7,), "f8"  # position and quat_wxyz
            fields[f"robots/{name}/twist/{link.name}"] = (6,), "f8"  # linear, angular
            fields[f"robots/{name}/jacobian/{link.name}"] = (6, dof), "f8"
    for name in scene.bodies:
        fields[f"bodies/{name}/pose"] = (7,), "f8"
        fields[f"bodies/{name}/twist"] = (6,), "f8"
    return fields


def allocate(fields: Layout, num_envs: int, context: BaseContext | None) -> Any:
    """Return a zeroed buffer for all arrays, in shared memory if a multiprocessing context is given."""
    size = sum(_size(shape, num_envs) for shape, _ in fields.values())
    if context is None:
        return (ctypes.c_byte * size)()
    return context.RawArray(ctypes.c_byte, size)


def arrays(fields: Layout, num_envs: int, buffer: Any) -> Arrays:
    """Return the arrays as views of a buffer."""
    views, offset = {}, 0
    for name, (shape, dtype) in fields.items():
        size = (num_envs, *shape)
        view = np.frombuffer(buffer, dtype, math.prod(size), offset) if math.prod(size) else np.zeros(0, dtype)
        views[name] = view.reshape(size)
        offset += _size(shape, num_envs)
    return views


def row(batch: Arrays, env: int) -> Arrays:
    """Return a view of one environment's row in each array."""
    return {name: array[env, ...] for name, array in batch.items()}


def state_names(names: Iterable[str]) -> list[str]:
    """Return the names of the state arrays, which are all arrays except poses, twists and Jacobians."""
    return [name for name in names if split(name)[2:3] not in (["pose"], ["twist"], ["jacobian"])]


def split(name: str) -> list[str]:
    """Split an array's name into kind, robot or body, field, and link. Body names may contain slashes."""
    kind, _, rest = name.partition("/")
    if kind == "bodies":
        body, _, field = rest.rpartition("/")
        return [kind, body, field]
    return [kind, *rest.split("/", 2)]


def _size(shape: tuple[int, ...], num_envs: int) -> int:
    return 64 * math.ceil(8 * math.prod(shape) * num_envs / 64)  # rounded up so that arrays do not share cache lines
