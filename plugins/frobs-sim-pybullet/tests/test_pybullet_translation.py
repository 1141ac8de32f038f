"""What the doctor is told about PyBullet; that it covers robots, and what overlaps, the conformance kit checks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pybullet
import pytest

from frobs_core.contracts import CommandMode
from frobs_core.description import Placement, Robot, Scene
from frobs_core.models import load_model
from frobs_models import ELEMENTS, read_tables
from frobs_sim_pybullet.simulation import TABLES, PybulletSimulation

THREE = """<robot name="three">{}</robot>"""
LINK = '<link name="{}"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>'
JOINT = (
    '<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/><origin xyz="{}"/>'
    '<limit lower="-1" upper="1" velocity="1" effort="1"/></joint>'
)


def build(path: Path) -> PybulletSimulation:
    placement = Placement(robot=Robot(model=str(path)), model=load_model(path), command_mode=CommandMode.POSITION)
    return PybulletSimulation({"robot": placement}, Scene(), num_envs=1, physics_timestep=0.002)


def test_every_kind_of_element_has_a_row() -> None:
    assert set().union(*read_tables(TABLES).values()) == set(ELEMENTS)


def test_a_joint_that_mimics_another_follows_it_when_it_is_pushed(tmp_path: Path) -> None:
    parts = [LINK.format(name) for name in "abc"]
    parts += [JOINT.format("ab", "a", "b", "0 0 0.5")]
    parts += [JOINT.format("bc", "b", "c", "0 0 0.5").replace("<limit", '<mimic joint="ab" multiplier="2"/><limit')]
    path = tmp_path / "mimic.urdf"
    path.write_text(THREE.format("".join(parts)))
    simulation = build(path)
    simulation.reset()
    robot, native = simulation.robots["robot"], simulation.native[0]
    joints = [pybullet.getJointInfo(native.robots["robot"], i, native.client)[1].decode() for i in (0, 1)]

    def ratio() -> float:
        states = pybullet.getJointStates(native.robots["robot"], [0, 1], native.client)
        position = {joint: state[0] for joint, state in zip(joints, states, strict=True)}
        return float(position["bc"] / position["ab"])

    robot.write_joint_state(np.array([[0.2]]))
    assert ratio() == pytest.approx(2.0)
    robot.command(np.array([[0.4]]))
    simulation.step(50)
    assert ratio() == pytest.approx(2.0, abs=1e-9)
    assert abs(robot.joint_positions[0, 0] - 0.2) > 0.01
    simulation.apply_wrench("robot/c", np.array([0.0, 0.5, 0.5]), np.array([0.2, 0.0, 0.0]))
    simulation.step(20)
    assert ratio() == pytest.approx(2.0, abs=1e-6)
