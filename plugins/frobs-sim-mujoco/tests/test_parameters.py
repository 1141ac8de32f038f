"""What writing a physical parameter leaves behind, beyond the value: nothing that depends on what was before."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from robots import place

from frobs_core.description import Scene
from frobs_sim_mujoco.simulation import MujocoSimulation


def simulate(folder: Path, num_envs: int = 2, scene: Scene | None = None, **placing: object) -> MujocoSimulation:
    robots = {"robot": place(folder, "arm", **placing)}
    return MujocoSimulation(robots, scene or Scene(), num_envs=num_envs, physics_timestep=0.002)


def test_inertia_depends_on_the_mass_alone_and_not_on_those_before(tmp_path: Path) -> None:
    sim, straight = simulate(tmp_path), simulate(tmp_path)
    for mass in (1.1, 0.7, 3.3, 1.9):
        sim.write_parameter("mass", "robot/link_1", np.full(2, mass))
    straight.write_parameter("mass", "robot/link_1", np.full(2, 1.9))
    for each in (sim, straight):
        each.step(10)
    assert sim.batch.expanded("body_inertia").tolist() == straight.batch.expanded("body_inertia").tolist()
    assert sim.batch.state.tolist() == straight.batch.state.tolist()


def test_what_follows_from_masses_is_computed_before_it_counts(tmp_path: Path) -> None:
    """One environment keeps what it has computed for the next step; many compute it anew: both know of the mass."""
    states = []
    for num_envs in (1, 2):
        sim = simulate(tmp_path, num_envs)
        sim.step(5)
        sim.write_parameter("mass", "robot/link_1", np.array([2.5]), np.arange(num_envs) == 0)
        sim.step(5)
        states.append(sim.batch.state[0].tolist())
        assert sim.batch.expanded("body_subtreemass")[0, 1] == pytest.approx(2.0 + 1.0 + 2.5)
    assert states[0] == states[1]
