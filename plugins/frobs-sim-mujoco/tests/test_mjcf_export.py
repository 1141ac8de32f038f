"""The model of a simulation as MJCF text with exact arrays."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
import pytest

from frobs_core.contracts import CommandMode
from frobs_core.description import Placement, Robot, Scene
from frobs_core.models import load_model
from frobs_core.util.errors import SimulationError
from frobs_sim_mujoco.simulation import MujocoSimulation

ARM = """<mujoco><asset><mesh name="box" file="box.obj"/></asset><worldbody><body name="base"><body name="arm">
<joint name="hinge" axis="0 1 0" limited="true" range="-1 1"/><geom type="mesh" mesh="box"/></body></body></worldbody></mujoco>
"""
BOX = "".join(f"v {x} {y} {z}\n" for x in (0, 0.1) for y in (0, 0.1) for z in (0, 0.1))
FACES = "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"


@pytest.mark.parametrize("id", ["frobs/Irb120Reach-v0", "frobs/PandaPickAndPlace-v0"])
def test_the_text_and_its_exact_arrays_give_the_same_motion(id: str) -> None:
    env: Any = gym.make(f"frobs_core:{id}").unwrapped
    env.reset(seed=0)
    simulation = env.simulation
    xml, arrays = simulation.export_mjcf()
    model = mujoco.MjModel.from_xml_string(xml)
    for name, array in arrays.items():
        getattr(model, name)[:] = array
    data = mujoco.MjData(model)
    for name in ("qpos", "qvel", "ctrl", "mocap_pos", "mocap_quat"):
        getattr(data, name)[:] = simulation.states[name][0]
    controls = simulation.states["ctrl"][0] * np.linspace(0.9, 1.0, model.nu)
    simulation.states["ctrl"][0] = data.ctrl[:] = controls
    simulation.step(200)
    mujoco.mj_step(model, data, 200)
    np.testing.assert_allclose(data.qpos, simulation.states["qpos"][0], rtol=0, atol=1e-12)
    assert "jnt_range" in arrays or "body_inertia" in arrays
    env.close()


def test_a_model_that_needs_other_files_is_refused(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text(ARM)
    (tmp_path / "box.obj").write_text(BOX + FACES)
    placement = Placement(
        robot=Robot(model=str(tmp_path / "arm.xml")),
        model=load_model(tmp_path / "arm.xml"),
        command_mode=CommandMode.POSITION,
    )
    simulation = MujocoSimulation({"robot": placement}, Scene(), num_envs=1, physics_timestep=0.002)
    with pytest.raises(SimulationError, match=r"refers to .*box\.obj; use a robot without meshes"):
        simulation.export_mjcf()
