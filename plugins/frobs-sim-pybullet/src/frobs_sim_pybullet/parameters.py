"""Physical parameters that differ between environments."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frobs_core.arrays import Floats, Mask
from frobs_core.errors import PhysicsParameterError, UnknownNameError
from frobs_core.interfaces import Snapshot

if TYPE_CHECKING:
    from frobs_sim_pybullet.robot import PybulletRobot
    from frobs_sim_pybullet.simulation import PybulletSimulation

NAMES = ("mass", "friction", "stiffness", "damping", "joint_damping", "gravity")


def check_body(simulation: PybulletSimulation, name: str) -> None:
    """Refuse what is neither a scene body nor ``robot/link``.

    Raises:
        UnknownNameError: There is no such body.
    """
    links = [f"{robot}/{link.name}" for robot, placed in simulation.placements.items() for link in placed.model.links]
    names = [*simulation.scene.bodies, *links]
    if name not in names:
        raise UnknownNameError("body", name, names)


def read(simulation: PybulletSimulation, name: str, target: str) -> Floats:
    """Return a parameter of each environment, (num_envs, …)."""
    match name:
        case "stiffness":
            return _robot(simulation, target).drive_gains()[0].copy()
        case "damping":
            return _robot(simulation, target).drive_gains()[1].copy()
        case "joint_damping":
            return _robot(simulation, target).joint_damping.copy()
        case "mass" | "friction" | "gravity":
            default = _default(simulation, name, target)
            written = simulation.written.get((name, target))
            return np.repeat(default[None], simulation.num_envs, axis=0) if written is None else written.copy()
    raise UnknownNameError("parameter", name, NAMES)


def write(simulation: PybulletSimulation, name: str, target: str, values: Floats, mask: Mask | None) -> None:
    """Change a parameter of the environments of ``mask``."""
    if name not in NAMES:
        raise UnknownNameError("parameter", name, NAMES)
    values = np.asarray(values, np.float64)
    if name != "gravity" and not (values >= 0).all():
        raise PhysicsParameterError(name, target, f"must not be negative or NaN: {values.min()}.")
    rows = slice(None) if mask is None else np.flatnonzero(mask)
    match name:
        case "stiffness" | "damping":
            _robot(simulation, target).write_gains(int(name == "damping"), rows, values)
        case "joint_damping":
            _robot(simulation, target).joint_damping[rows] = values
        case _:
            whole = read(simulation, name, target)
            if name == "mass" and not (values > 0).all():
                raise PhysicsParameterError(name, target, f"must be above 0 for PyBullet: {values.min()}.")
            whole[rows] = values
            simulation.written[name, target] = whole
            simulation.call("write_parameter", mask, name, target, whole[rows])


def snapshot(simulation: PybulletSimulation) -> Snapshot:
    """Return what was written, and the drive gains."""
    state: Snapshot = {
        f"parameter/{name}:{target}": value.copy() for (name, target), value in simulation.written.items()
    }
    for name, robot in simulation.robots.items():
        state[f"stiffness/{name}"], state[f"damping/{name}"] = (gain.copy() for gain in robot.drive_gains())
    return state


def restore(simulation: PybulletSimulation, state: Snapshot) -> None:
    """Return to a snapshot; what it leaves out goes back to the model's."""
    saved = {
        (name, target): value
        for key, value in state.items()
        if key.startswith("parameter/")
        for name, _, target in [key.removeprefix("parameter/").partition(":")]
    }
    for name, target in {*saved, *simulation.written}:
        before = read(simulation, name, target)
        default = np.repeat(_default(simulation, name, target)[None], simulation.num_envs, axis=0)
        value = np.asarray(saved.get((name, target), default))
        if (value != before).any():
            write(simulation, name, target, value, None)
    for name, robot in simulation.robots.items():
        stiffness, damping = robot.drive_gains()
        stiffness[:], damping[:] = state[f"stiffness/{name}"], state[f"damping/{name}"]
        robot.apply_gains()


def _default(simulation: PybulletSimulation, name: str, target: str) -> Floats:
    """Return what the scene or the model says."""
    scene = simulation.scene
    if name == "gravity":
        return np.array(scene.gravity, np.float64)
    if name == "friction" and target == "floor" and scene.floor:
        return np.array(1.0)
    check_body(simulation, target)
    if target in scene.bodies:
        body = scene.bodies[target]
        if name == "friction":
            if not body.collides:
                raise PhysicsParameterError("friction", target, "cannot change: it collides with nothing.")
            return np.array(body.friction)
        if body.mass is None:
            raise PhysicsParameterError("mass", target, "cannot change: it has no mass.")
        return np.array(body.mass)
    robot, _, name_of_link = target.partition("/")
    link = next(link for link in simulation.placements[robot].model.links if link.name == name_of_link)
    if name == "friction":
        if not link.collisions:
            raise PhysicsParameterError("friction", target, "cannot change: it collides with nothing.")
        return np.array(simulation.placements[robot].robot.friction.get(name_of_link, 1.0))
    if link.inertial is None:
        raise PhysicsParameterError("mass", target, "cannot change: it has no mass.")
    return np.array(link.inertial.mass)


def _robot(simulation: PybulletSimulation, name: str) -> PybulletRobot:
    if name not in simulation.robots:
        raise UnknownNameError("robot", name, simulation.robots)
    return simulation.robots[name]
