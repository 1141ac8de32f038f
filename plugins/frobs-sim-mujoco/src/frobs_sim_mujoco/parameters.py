"""Reads and writes per-environment physical parameters, which are stored in the batch's expanded model fields."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frobs_core.contracts import Snapshot
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import PhysicsParameterError, UnknownNameError, check_name
from frobs_sim_mujoco.looks import Looks

if TYPE_CHECKING:
    from frobs_sim_mujoco.robot import MujocoRobot
    from frobs_sim_mujoco.simulation import MujocoSimulation

NAMES = ("mass", "friction", "size", "stiffness", "damping", "joint_damping", "gravity", *Looks.names)
_GEOMETRY = ("geom_size", "geom_pos", "geom_rbound", "geom_aabb")  # all proportional to a geom's size
_FIELDS = (
    "body_mass",
    "body_inertia",
    "body_ipos",
    *_GEOMETRY,
    "geom_friction",
    "dof_damping",
    "actuator_biasprm",
    "opt.gravity",
)


def body_id(simulation: MujocoSimulation, name: str) -> int:
    """Return the MuJoCo body index of a scene body or a ``robot/link``.

    Raises:
        UnknownNameError: The body does not exist.
    """
    check_name("body", name, simulation.body_ids)
    return simulation.body_ids[name]


def read(simulation: MujocoSimulation, name: str, target: str) -> Floats:
    """Return a parameter's value in each environment, (num_envs, …)."""
    match name:
        case "mass":
            return _field(simulation, "body_mass")[:, body_id(simulation, target)].copy()
        case "friction":
            return _field(simulation, "geom_friction")[:, _geoms(simulation, target)[0], 0].copy()
        case "size":
            simulation.scene.check_size(target)
            return np.array(simulation.sizes.get(target, np.ones(simulation.num_envs)))
        case "stiffness":
            return _robot(simulation, target).drive_gains()[0].copy()
        case "damping":
            return _robot(simulation, target).drive_gains()[1].copy()
        case "joint_damping":
            return _field(simulation, "dof_damping")[:, _robot(simulation, target).dofs].copy()
        case "gravity":
            return _field(simulation, "opt.gravity").copy()
    if name in Looks.names:
        return simulation.looks.read(name, target)
    raise UnknownNameError("parameter", name, NAMES)


def write(simulation: MujocoSimulation, name: str, target: str, values: Floats, mask: Mask | None) -> None:
    """Change a parameter in the environments selected by ``mask``."""
    check_name("parameter", name, NAMES)
    values = np.asarray(values, np.float64)
    if name in Looks.names:
        simulation.looks.write(name, target, values, mask)
        return
    if name != "gravity" and not (values >= 0).all():
        raise PhysicsParameterError(name, target, f"must not be negative or NaN: {values.min()}.")
    batch = simulation.batch
    rows = slice(None) if mask is None else np.flatnonzero(mask)
    match name:
        case "mass":
            body = body_id(simulation, target)
            nominal = simulation.model.body_mass[body]
            if not nominal > 0:
                raise PhysicsParameterError("mass", target, "cannot be changed, because this body has no mass.")
            batch.expand("body_mass")[rows, body] = values
            _write_inertia(simulation, target, rows)
            simulation.mark_constants_stale(mask)
        case "size":
            simulation.scene.check_size(target, values)
            simulation.sizes.setdefault(target, np.ones(simulation.num_envs))[rows] = values
            _write_geometry(simulation, target, rows)
            _write_inertia(simulation, target, rows)
            simulation.mark_constants_stale(mask)
        case "friction":
            for geom in _geoms(simulation, target):
                batch.expand("geom_friction")[rows, geom, 0] = values
        case "stiffness" | "damping":
            robot = _robot(simulation, target)
            robot.write_gains(int(name == "damping"), rows, values)
        case "joint_damping":
            dampings, dofs = batch.expand("dof_damping"), _robot(simulation, target).dofs
            current = dampings[rows]
            current[:, dofs] = values
            dampings[rows] = current
        case "gravity":
            batch.expand("opt.gravity")[rows] = values


def snapshot(simulation: MujocoSimulation) -> Snapshot:
    """Return the expanded model fields, the size factors of resized bodies, and the drive gains."""
    state: Snapshot = {}
    for field in _FIELDS:
        expanded = simulation.batch.expanded(field)
        if expanded is not None:
            state[f"parameter/{field}"] = expanded.copy()
    state |= {f"size/{name}": sizes.copy() for name, sizes in simulation.sizes.items()} | simulation.looks.snapshot()
    for name, robot in simulation.robots.items():
        state[f"stiffness/{name}"], state[f"damping/{name}"] = (gain.copy() for gain in robot.drive_gains())
    return state


def restore(simulation: MujocoSimulation, state: Snapshot) -> None:
    """Restore a snapshot. Fields that the snapshot does not contain are reset to the model's values."""
    changed = False
    simulation.looks.restore(state)
    saved = {key.removeprefix("size/"): sizes for key, sizes in state.items() if key.startswith("size/")}
    for name in {*simulation.sizes, *saved}:
        simulation.sizes[name] = np.array(saved.get(name, np.ones(simulation.num_envs)))
    for field in _FIELDS:
        key = f"parameter/{field}"
        if key in state:
            simulation.batch.expand(field)[:] = state[key]
            changed = True
        elif simulation.batch.expanded(field) is not None:
            simulation.batch.expand(field)[:] = _shared(simulation, field)
            changed = True
    for name, robot in simulation.robots.items():
        stiffness, damping = robot.drive_gains()
        stiffness[:], damping[:] = state[f"stiffness/{name}"], state[f"damping/{name}"]
        robot.refresh_gains()
        robot.gains_written = True
    if changed:
        simulation.batch.set_const()


def _write_geometry(simulation: MujocoSimulation, target: str, rows: slice | np.ndarray) -> None:
    """Scale a body's nominal shapes by the body's size factors."""
    model, batch, body = simulation.model, simulation.batch, body_id(simulation, target)
    sizes = simulation.sizes[target][rows]
    batch.expand("body_ipos")[rows, body] = sizes[:, None] * model.body_ipos[body]
    for geom in np.flatnonzero(model.geom_bodyid == body).tolist():
        for field in _GEOMETRY:
            nominal = np.asarray(getattr(model, field)[geom])
            batch.expand(field)[rows, geom] = sizes.reshape(-1, *[1] * nominal.ndim) * nominal


def _write_inertia(simulation: MujocoSimulation, target: str, rows: slice | np.ndarray) -> None:
    """Compute a body's inertia from its current mass and size factor."""
    model, body = simulation.model, body_id(simulation, target)
    if not model.body_mass[body] > 0:
        return
    factor = _field(simulation, "body_mass")[rows, body] / model.body_mass[body]
    if target in simulation.sizes:
        factor = factor * simulation.sizes[target][rows] ** 2
    simulation.batch.expand("body_inertia")[rows, body] = factor[:, None] * model.body_inertia[body]


def _field(simulation: MujocoSimulation, field: str) -> Floats:
    expanded = simulation.batch.expanded(field)
    if expanded is not None:
        return np.asarray(expanded)
    shared = _shared(simulation, field)
    return np.broadcast_to(shared, (simulation.num_envs, *shared.shape))


def _shared(simulation: MujocoSimulation, field: str) -> Floats:
    owner, _, name = field.rpartition(".")
    return np.array(getattr(simulation.model.opt if owner else simulation.model, name))


def _geoms(simulation: MujocoSimulation, target: str) -> list[int]:
    model = simulation.model
    if target == "floor" and simulation.scene.floor:
        return [model.geom("floor").id]
    body = body_id(simulation, target)
    geoms = [g for g in range(model.ngeom) if model.geom_bodyid[g] == body and model.geom_contype[g]]
    if not geoms:
        raise PhysicsParameterError("friction", target, "cannot be changed, because this body does not collide.")
    return geoms


def _robot(simulation: MujocoSimulation, name: str) -> MujocoRobot:
    check_name("robot", name, simulation.robots)
    return simulation.robots[name]
