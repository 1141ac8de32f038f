"""A robot from an MJCF file moves as in MuJoCo; its shapes are not read, which the doctor is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from frobs_core.contracts import CommandMode
from frobs_core.description import DriveGains, Placement, Robot, Scene
from frobs_core.models import load_model
from frobs_sim_mujoco.simulation import MujocoSimulation
from frobs_sim_pybullet.simulation import PybulletSimulation

ARM = """<mujoco><compiler angle="degree" autolimits="true"/>
<default><geom density="500"/><joint damping="0.1" armature="0.02"/></default>
<worldbody><body name="base"><geom type="box" size=".05 .05 .05"/>
  <body name="upper" pos="0 0 .05"><joint name="shoulder" axis="0 1 0" range="-120 120"/>
    <geom type="capsule" fromto="0 0 .05 0 0 .3" size=".03"/>
    <body name="lower" pos="0 0 .35" euler="0 0 30"><joint name="elbow" axis="0 1 0" range="-120 120"/>
      <geom type="capsule" fromto="0 0 .05 0 0 .25" size=".03"/>
      <body name="hand" pos="0 0 .3"/></body></body></body></worldbody>
<actuator><motor joint="shoulder"/><motor joint="elbow"/></actuator></mujoco>"""


def test_an_mjcf_arm_moves_as_in_mujoco(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    gains = DriveGains(stiffness=40.0, damping=3.0)
    robot = Robot(model=str(path), tcp="hand", home={"elbow": 0.5}, gains=gains, self_collision=False)
    placement = Placement(robot=robot, model=load_model(path), command_mode=CommandMode.POSITION)
    found = []
    for cls in (MujocoSimulation, PybulletSimulation):
        sim = cls({"robot": placement}, Scene(floor=False), num_envs=1, physics_timestep=0.002)
        sim.reset()
        arm = sim.robots["robot"]
        arm.command(np.array([[0.3, -0.4]]))
        sim.step(100)
        found.append(np.concatenate([arm.joint_positions[0], arm.frame_pose("tcp")[0][0]]))
        sim.close()
    assert found[1] == pytest.approx(found[0], abs=1e-9)
    assert abs(found[1][0]) > 0.05
