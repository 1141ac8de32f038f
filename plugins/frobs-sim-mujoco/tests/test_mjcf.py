"""Robots from MJCF files keep their own dynamics, and take the core's drives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from frobs_core.contracts import CommandMode
from frobs_core.description import Placement, Robot, Scene
from frobs_core.models import load_model
from frobs_sim_mujoco.simulation import MujocoSimulation

ARM = """<mujoco><compiler angle="degree" autolimits="true"/>
<default><geom density="500"/><joint damping="0.1"/></default>
<worldbody><body name="base"><geom type="box" size=".05 .05 .05"/>
  <body name="upper" pos="0 0 .05"><joint name="shoulder" axis="0 1 0" range="-120 120"/>
    <geom type="capsule" fromto="0 0 .05 0 0 .3" size=".03"/>
    <body name="lower" pos="0 0 .35"><joint name="elbow" axis="0 1 0" range="-120 120"/>
      <geom type="capsule" fromto="0 0 .05 0 0 .25" size=".03"/>
      <body name="hand" pos="0 0 .3"/></body></body></body></worldbody>
<actuator><motor joint="shoulder"/><motor joint="elbow"/></actuator></mujoco>"""


@pytest.mark.parametrize("num_envs", [1, 3])
def test_an_mjcf_arm_holds_its_home_and_goes_where_it_is_told(tmp_path: Path, num_envs: int) -> None:
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    robot = Robot(model=str(path), tcp="hand", home={"elbow": 0.5})
    placement = Placement(robot=robot, model=load_model(path), command_mode=CommandMode.POSITION)
    sim = MujocoSimulation({"robot": placement}, Scene(), num_envs=num_envs, physics_timestep=0.002)
    sim.reset()
    arm = sim.robots["robot"]
    assert arm.joint_names == ("shoulder", "elbow")
    assert arm.position_upper[0] == pytest.approx(np.deg2rad([120.0, 120.0]))
    arm.command(np.tile([0.3, -0.4], (num_envs, 1)))
    sim.step(500)
    assert arm.joint_positions == pytest.approx(np.tile([0.3, -0.4], (num_envs, 1)), abs=0.05)
    pos, _ = arm.frame_pose("tcp")
    assert pos == pytest.approx(arm.frame_pose("tcp", arm.joint_positions)[0], abs=1e-12)
    model = sim.native.model
    assert model.nu == 2
    assert model.dof_damping.tolist() == [0.1, 0.1]
    assert model.body("robot/upper").mass[0] == pytest.approx(500 * np.pi * 0.03**2 * (0.25 + 4 / 3 * 0.03))
