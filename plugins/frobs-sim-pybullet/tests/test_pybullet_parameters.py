"""What writing a physical parameter leaves behind, beyond the value: nothing that depends on what was before."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from robots import place

from frobs_core.errors import ConfigurationError
from frobs_core.interfaces import Body, CommandMode, Scene
from frobs_core.models import Sphere
from frobs_sim_pybullet.simulation import PybulletSimulation


def simulate(folder: Path, num_envs: int = 2, scene: Scene | None = None, **placing: object) -> PybulletSimulation:
    robots = {"robot": place(folder, "arm", **placing)}
    return PybulletSimulation(robots, scene or Scene(), num_envs=num_envs, physics_timestep=0.002, num_threads=1)


def test_inertia_depends_on_the_mass_alone_and_not_on_those_before(tmp_path: Path) -> None:
    sim, straight = simulate(tmp_path), simulate(tmp_path)
    for mass in (1.1, 0.7, 3.3, 1.9):
        sim.write_parameter("mass", "robot/link_1", np.full(2, mass))
    straight.write_parameter("mass", "robot/link_1", np.full(2, 1.9))
    for each in (sim, straight):
        each.robots["robot"].command(np.full((2, 2), -0.3))
        each.step(10)
    assert sim.robots["robot"].joint_positions.tolist() == straight.robots["robot"].joint_positions.tolist()


@pytest.mark.parametrize("mode", [CommandMode.POSITION, CommandMode.VELOCITY])
def test_a_drive_holds_what_it_was_told_when_its_gains_change(tmp_path: Path, mode: CommandMode) -> None:
    sim = simulate(tmp_path, scene=Scene(gravity=(0.0, 0.0, 0.0)), mode=mode)
    arm = sim.robots["robot"]
    target = np.full((2, 2), 0.4 if mode is CommandMode.POSITION else 0.0)
    arm.command(target)
    for name, factor in (("stiffness", 0.5), ("damping", 2.0)):
        sim.write_parameter(name, "robot", sim.parameter(name, "robot")[:1] * factor, np.array([True, False]))
    sim.step(2000)
    expected = target if mode is CommandMode.POSITION else arm.home
    assert arm.joint_positions == pytest.approx(expected, abs=1e-3)


def test_a_reset_holds_home_with_the_gains_that_were_written(tmp_path: Path) -> None:
    sim = simulate(tmp_path, scene=Scene(gravity=(0.0, 0.0, 0.0)))
    arm = sim.robots["robot"]
    kept = sim.snapshot()
    sim.write_parameter("stiffness", "robot", arm.drive_gains()[0] * 0.25)
    written = sim.snapshot()
    for state in (None, kept, written):
        if state is not None:
            sim.restore(state)
        sim.reset()
        sim.step(50)
        assert arm.joint_positions == pytest.approx(arm.home, abs=1e-9)


def test_a_body_without_mass_is_refused(tmp_path: Path) -> None:
    sim = simulate(tmp_path, scene=Scene(bodies={"post": Body(geometry=Sphere(0.1))}))
    with pytest.raises(ConfigurationError, match="'robot/tool' has no mass"):
        sim.write_parameter("mass", "robot/tool", np.ones(2))
