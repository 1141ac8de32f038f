"""Physical parameters that differ between environments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from frobs_core.arrays import Floats, Mask
from frobs_core.errors import PhysicsParameterError, UnknownNameError
from frobs_core.interfaces import Snapshot
from frobs_core.rotations import matrix_from_quat
from frobs_sim_gazebo import protocol
from frobs_sim_gazebo.protocol import Op
from frobs_sim_gazebo.shapes import moments

if TYPE_CHECKING:
    from frobs_sim_gazebo.fleet import Message
    from frobs_sim_gazebo.robot import GazeboRobot
    from frobs_sim_gazebo.simulation import GazeboSimulation

NAMES = ("mass", "friction", "stiffness", "damping", "joint_damping", "gravity")


def check_body(simulation: GazeboSimulation, name: str) -> None:
    """Refuse what is neither a scene body nor ``robot/link``.

    Raises:
        UnknownNameError: There is no such body.
    """
    links = [f"{robot}/{link.name}" for robot, placed in simulation.placements.items() for link in placed.model.links]
    names = [*simulation.scene.bodies, *links]
    if name not in names:
        raise UnknownNameError("body", name, names)


def centre(simulation: GazeboSimulation, target: str) -> tuple[int | None, Floats]:
    """Return the moving body that a scene body or link is part of, and its own centre of mass.

    Returns:
        Number of the body, or None: nothing moves it. The point from the body's centre of mass, in its axes, (3,) [m].
    """
    layout = simulation.layout
    if target in simulation.scene.bodies:
        span = layout.bodies.get(("body", target))
        return (None if span is None else span.start), np.zeros(3)
    robot, _, name = target.partition("/")
    placement = simulation.placements[robot]
    body, offset = layout.skeletons[robot].frames[name]
    number = layout.bodies["robot", robot].start + body
    link = next(link for link in placement.model.links if link.name == name)
    own = np.zeros(3) if link.inertial is None else np.array(link.inertial.origin.pos)
    point = offset[:3] + (matrix_from_quat(offset[3:]) * own).sum(-1) - layout.coms[number]
    return (None if body == 0 and placement.robot.base == "fixed" else number), point


def read(simulation: GazeboSimulation, name: str, target: str) -> Floats:
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


def write(simulation: GazeboSimulation, name: str, target: str, values: Floats, mask: Mask | None) -> None:
    """Change a parameter of the environments of ``mask``."""
    if name not in NAMES:
        raise UnknownNameError("parameter", name, NAMES)
    values = np.asarray(values, np.float64)
    if name != "gravity" and not (values >= 0).all():
        raise PhysicsParameterError(name, target, f"must not be negative or NaN: {values.min()}.")
    envs = simulation.envs(mask)
    match name:
        case "stiffness" | "damping":
            _robot(simulation, target).write_gains(int(name == "damping"), envs, values)
        case "joint_damping":
            _robot(simulation, target).joint_damping[envs] = values
            simulation.stale_gains[envs] = True
        case _:
            whole = read(simulation, name, target)
            if name == "mass" and not (values > 0).all():
                raise PhysicsParameterError(name, target, f"must be above 0 for Gazebo: {values.min()}.")
            whole[envs] = values
            simulation.written[name, target] = whole
            for env in envs:
                for op, body in _messages(simulation, env, name, target):
                    simulation.later(env, op, body)


def messages(simulation: GazeboSimulation, env: int) -> list[Message]:
    """Return what tells a new server of the parameters that were written."""
    return [message for key in simulation.written for message in _messages(simulation, env, *key)]


def _messages(simulation: GazeboSimulation, env: int, name: str, target: str) -> list[Message]:
    value = simulation.written[name, target][env]
    if name == "gravity":
        return [(Op.GRAVITY, protocol.numbers(value))]
    if name == "friction":
        return [(Op.FRICTION, protocol.indices(simulation.layout.shapes[target]) + protocol.numbers(value))]
    number, _ = centre(simulation, target)
    if number is None:
        return []  # what does not move has no use for it
    if target in simulation.scene.bodies:
        weight, inertia = float(value), np.diag(moments(simulation.scene.bodies[target].geometry, float(value)))
    else:
        robot = target.partition("/")[0]
        changed = {
            key.partition("/")[2]: float(values[env])
            for (kind, key), values in simulation.written.items()
            if kind == "mass" and key.partition("/")[0] == robot and key not in simulation.scene.bodies
        }
        found = simulation.layout.skeletons[robot].masses(changed)[
            number - simulation.layout.bodies["robot", robot].start
        ]
        weight, inertia = found.mass, found.inertia
    upper = inertia[np.triu_indices(3)]  # ixx, ixy, ixz, iyy, iyz, izz
    return [(Op.MASS, protocol.count(number) + protocol.numbers([weight, *upper]))]


def snapshot(simulation: GazeboSimulation) -> Snapshot:
    """Return what was written, and the gains."""
    state: Snapshot = {
        f"parameter/{name}:{target}": value.copy() for (name, target), value in simulation.written.items()
    }
    for name, robot in simulation.robots.items():
        state[f"stiffness/{name}"], state[f"damping/{name}"] = (gain.copy() for gain in robot.drive_gains())
        state[f"joint_damping/{name}"] = robot.joint_damping.copy()
    return state


def restore(simulation: GazeboSimulation, state: Snapshot) -> None:
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
        robot.joint_damping[:] = state[f"joint_damping/{name}"]
    simulation.stale_gains[:] = True


def _default(simulation: GazeboSimulation, name: str, target: str) -> Floats:
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
            return _if_it_collides(simulation, target, body.friction)
        if body.mass is None:
            raise PhysicsParameterError("mass", target, "cannot change: it has no mass.")
        return np.array(body.mass)
    robot, _, name_of_link = target.partition("/")
    placement = simulation.placements[robot]
    link = next(link for link in placement.model.links if link.name == name_of_link)
    if name == "friction":
        return _if_it_collides(simulation, target, placement.robot.friction.get(name_of_link, 1.0))
    if link.inertial is None:
        raise PhysicsParameterError("mass", target, "cannot change: it has no mass.")
    return np.array(link.inertial.mass)


def _if_it_collides(simulation: GazeboSimulation, target: str, friction: float) -> Floats:
    shapes: Sequence[int] = simulation.layout.shapes[target]
    if not shapes:
        raise PhysicsParameterError("friction", target, "cannot change: it collides with nothing.")
    return np.array(friction)


def _robot(simulation: GazeboSimulation, name: str) -> GazeboRobot:
    if name not in simulation.robots:
        raise UnknownNameError("robot", name, simulation.robots)
    return simulation.robots[name]
