"""Saves and restores a simulation's state, including the poses and velocities of all bodies and the drive targets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frobs_core.contracts import CommandMode, Snapshot

if TYPE_CHECKING:
    from frobs_sim_gazebo.simulation import GazeboSimulation

_MODES = tuple(CommandMode)
_STATE = ("positions", "velocities", "efforts", "raw", "steps")


def take(simulation: GazeboSimulation) -> Snapshot:
    """Return a copy of the state."""
    state: Snapshot = {name: getattr(simulation, name).copy() for name in _STATE}
    state["diverged"] = np.zeros(simulation.num_envs, bool) | (simulation.diverged is not None and simulation.diverged)
    state |= simulation.contacts.snapshot()
    for name, stands in simulation.stands.items():
        state[f"stands/{name}"] = stands.copy()
    for name, robot in simulation.robots.items():
        state[f"base/{name}"] = simulation.bases[name].copy()
        state[f"target/{name}"] = robot.target.copy()
        state[f"modes/{name}"] = np.tile([_MODES.index(mode) for mode in robot.command_modes], (simulation.num_envs, 1))
    return state


def put_back(simulation: GazeboSimulation, state: Snapshot) -> None:
    """Restore a state."""
    envs = range(simulation.num_envs)
    for name, robot in simulation.robots.items():
        robot.set_command_mode([_MODES[int(number)] for number in state[f"modes/{name}"][0]])
    for name in simulation.layout.placed:
        simulation.place(name, state[f"stands/{name}"], envs)
    bodies, joints = slice(0, simulation.layout.body_count), slice(0, simulation.layout.joint_count)
    simulation.write(bodies, state["raw"], envs, joints, state["positions"])
    for name in _STATE:
        getattr(simulation, name)[...] = state[name]
    simulation.contacts.restore(state)
    for name, robot in simulation.robots.items():
        simulation.bases[name][...] = state[f"base/{name}"]
        robot.target[...] = state[f"target/{name}"]
    simulation.set_diverged(state["diverged"])
    simulation.command_rows.clear()
