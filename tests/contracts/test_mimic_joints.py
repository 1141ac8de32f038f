"""A mimic joint follows its leader on every simulator, and stays in place if its multiplier is 0."""

from __future__ import annotations

import math
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from frobs_core import plugins
from frobs_core.contracts import CommandMode
from frobs_core.description import Placement, Robot, Scene
from frobs_core.models import load_model
from frobs_core.util.rotations import quat_conjugate, quat_multiply

INERTIAL = """<inertial><origin xyz="0.1 0 0"/><mass value="1"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>"""
JOINT = """<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="0.3 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="{3}" velocity="9"/>{4}</joint>"""


@pytest.mark.parametrize("simulator", ["mujoco", "pybullet"])
@pytest.mark.parametrize("multiplier", [0.0, 1.0, -0.5])
@pytest.mark.parametrize("offset", [0.0, 0.3])
def test_a_mimic_joint_follows_its_leader(tmp_path: Path, simulator: str, multiplier: float, offset: float) -> None:
    links = "".join(f'<link name="{name}">{INERTIAL}</link>' for name in ("base", "arm", "finger"))
    mimic = f'<mimic joint="arm" multiplier="{multiplier}" offset="{offset}"/>'
    joints = JOINT.format("arm", "base", "arm", 100, "") + JOINT.format("finger", "arm", "finger", 10, mimic)
    path = tmp_path / "robot.urdf"
    path.write_text(f'<robot name="r">{links}{joints}</robot>')
    placement = Placement(robot=Robot(model=str(path)), model=load_model(path), command_mode=CommandMode.POSITION)
    simulation = plugins.get_record("simulator", simulator).load()(
        {"robot": placement}, Scene(), num_envs=1, physics_timestep=0.002
    )
    with closing(simulation):
        simulation.reset()
        robot = simulation.robots["robot"]

        def angle() -> float:
            w, _, y, _ = quat_multiply(quat_conjugate(robot.frame_pose("arm")[1]), robot.frame_pose("finger")[1])[0]
            return 2.0 * math.atan2(y, w)

        def expected() -> float:
            return float(multiplier * robot.joint_positions[0, 0] + offset)

        assert angle() == pytest.approx(expected(), abs=1e-6)
        robot.command(np.array([[0.4]]))
        for _ in range(3):  # gravity, the leader's motion and a push act on the finger
            simulation.apply_wrench("robot/finger", np.array([[0.0, 0.0, -5.0]]), np.array([[0.0, 1.0, 0.0]]))
            simulation.step(100)
            assert angle() == pytest.approx(expected(), abs=0.01)
        robot.write_joint_state(np.array([[0.7]]))
        assert angle() == pytest.approx(multiplier * 0.7 + offset, abs=1e-6)
        # The leader turns the finger, and the finger's own joint turns it by the multiple.
        assert robot.frame_jacobian("finger")[0, 4] == pytest.approx(1.0 + multiplier, abs=1e-6)
