"""Fast images: drawing less and on several threads changes no pixel."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.contracts import CommandMode
from frobs_core.description import Camera, Placement, Robot, Scene
from frobs_core.models import load_model
from frobs_core.util.errors import SimulationError
from frobs_sim_mujoco.geoms import ROBOT_GROUPS, VISUAL_GROUP
from frobs_sim_mujoco.rendering import Renderer
from frobs_sim_mujoco.simulation import MujocoSimulation

pytestmark = pytest.mark.needs("rendering")
LENS = {"fx": 60.0, "fy": 70.0, "cx": 10.0, "cy": 55.0, "width": 64, "height": 64}
CAMERAS: dict[str, Any] = {
    "lens": {"link": "gripper_body", "pos": [0.08, 0, 0], "target": [0, 0, 0.12], "intrinsics": LENS},
    "inside": {"pos": [0.4, 0.0, 0.1], "target": [0.6, 0.05, 0.0], "fov_y": 100},
    "horizon": {"pos": [2.5, 0.0, 0.5], "target": [0.0, 0.0, 0.6]},
}


@pytest.fixture(scope="module")
def simulation() -> Any:
    env = gym.make_vec(
        "frobs_core:frobs/PandaPickAndPlace-v0",
        num_envs=12,
        cameras=CAMERAS,
        num_threads=3,
        randomize={"size": {"scale": [0.6, 1.4], "target": "cube"}, "distractors": {"set": [0, 8.9]}},
    )
    env.reset(seed=0)
    env.action_space.seed(0)
    for _ in range(15):
        env.step(env.action_space.sample())
    yield env.unwrapped.simulation
    env.close()


@pytest.mark.parametrize("modality", ["rgb", "depth", "segmentation"])
@pytest.mark.parametrize("camera", ["overview", "wrist", "lens", "inside"])
@pytest.mark.parametrize("size", [(64, 64), (40, 72)])
def test_fast_images_show_everything_that_is_in_view(
    simulation: Any, camera: str, modality: str, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    together = simulation.render(None, camera, size, modality, fast=True)
    monkeypatch.setattr(Renderer, "_is_in_view", lambda self, *_: np.ones(self._model.ngeom, np.bool_))
    for row, image in enumerate(together):
        alone = simulation.render(np.arange(12) == row, camera, size, modality, fast=True)[0]
        np.testing.assert_array_equal(image, alone, err_msg=f"row {row}")


def test_what_is_out_of_view_is_not_drawn(simulation: Any) -> None:
    simulation.render(None, "wrist", (64, 64), fast=True)
    renderer = simulation._renderer._first
    drawn = renderer._renderer((64, 64), True).scene.ngeom
    simulation.render(np.arange(12) == 0, "wrist", (64, 64))
    assert drawn < 0.5 * renderer._renderer((64, 64), False).scene.ngeom


def test_the_sky_has_the_color_of_its_environment(simulation: Any) -> None:
    shown, size = np.arange(12) < 4, (64, 64)
    sky = simulation.render(shown, "horizon", size, "segmentation", fast=True)[..., 0] < 0
    assert 0.2 < sky.mean() < 0.8
    before = simulation.render(shown, "horizon", size, fast=True)
    simulation.write_parameter("color", "sky", np.array([0.8, 0.2, 0.0]), np.arange(12) == 1)
    after = simulation.render(shown, "horizon", size, fast=True)
    assert (after[1][sky[1]] == [204, 51, 0]).all()
    np.testing.assert_array_equal(after[1][~sky[1]], before[1][~sky[1]])
    assert (
        np.abs(after[0][sky[0]] - 255.0 * simulation.parameter("color", "sky")[0]).max() <= 0.5
    )  # plain, not a gradient


def test_full_images_after_fast_ones_show_all_shadows(simulation: Any) -> None:
    first = simulation.render(np.arange(12) == 1, "wrist", (96, 96))
    simulation.render(None, "inside", (96, 96), fast=True)
    np.testing.assert_array_equal(simulation.render(np.arange(12) == 1, "wrist", (96, 96)), first)


def test_a_program_ends_without_closing_its_environments() -> None:
    program = (
        "import gymnasium as gym\n"
        "env = gym.make_vec('frobs_core:frobs/PandaPickAndPlace-v0', num_envs=16, num_threads=2)\n"
        "env.reset(seed=0)\n"
        "print(env.unwrapped.simulation.render(None, 'wrist', (32, 32), fast=True).mean() > 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=300, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, "True"), done.stderr
    assert "Traceback" not in done.stderr, done.stderr
    assert "Exception ignored" not in done.stderr, done.stderr


MJCF = """<mujoco><worldbody><body name="base"><geom type="box" size=".2 .2 .2" rgba="1 0 0 1"/>
<body name="arm" pos="0 0 .6"><joint name="a"/><geom type="sphere" size=".1"/>
<geom type="sphere" size=".2" contype="0" conaffinity="0"/>
<body name="tip" pos=".7 0 0"><joint name="b"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<site name="mark" size=".2"/></body></body></body></worldbody></mujoco>"""


def test_bodies_of_mjcf_files_are_drawn_and_segmented(tmp_path: Path) -> None:
    path = tmp_path / "robot.xml"
    path.write_text(MJCF)
    placement = Placement(
        robot=Robot(model=str(path), tcp="tip"), model=load_model(path), command_mode=CommandMode.EFFORT
    )
    camera = Camera(pos=(0.3, -3.0, 0.4), target=(0.3, 0.0, 0.4))
    scene = Scene(cameras={"front": camera}, floor=False)
    sim = MujocoSimulation({"robot": placement}, scene, num_envs=1, physics_timestep=0.002)
    segments = sim.render(size=(120, 160), modality="segmentation")[0, :, :, 0]
    assert set(np.unique(segments)) == {-1, *(sim.body_ids[f"robot/{link}"] for link in ("base", "arm", "tip"))}
    base = sim.render(size=(120, 160))[0][segments == sim.body_ids["robot/base"]]
    assert (base[:, 0] > 2 * base[:, 1]).mean() > 0.9  # red, except at edges
    model = sim._drawn().model  # a body with visual shapes shows only these
    arm = model.geom_bodyid == model.body("robot/arm").id
    assert model.geom_group[arm].tolist() == [ROBOT_GROUPS[0], VISUAL_GROUP]
    assert set(sim.model.geom_group[sim.model.geom_contype > 0]) == {ROBOT_GROUPS[0]}  # its lidars do not see it
    sim.close()


def test_rendering_in_a_second_thread_is_one_clear_error_or_works() -> None:
    env: Any = gym.make("frobs_core:frobs/Irb120Reach-v0", render_mode="rgb_array")
    env.reset(seed=0)
    env.render()
    with ThreadPoolExecutor(1) as thread:
        error = thread.submit(env.render).exception()
    assert error is None or (isinstance(error, SimulationError) and "in one thread" in str(error))
    assert env.render().shape == (480, 640, 3)
    env.close()


def test_a_plane_with_a_size_keeps_it_in_fast_images(tmp_path: Path) -> None:
    path = tmp_path / "robot.xml"
    plane = '<geom type="plane" size=".3 .3 .1" pos="0 0 .3" contype="0" conaffinity="0"/>'
    arm = '<body name="arm"><joint name="a"/><geom size=".1"/></body>'
    path.write_text(f'<mujoco><worldbody><body name="base">{plane}{arm}</body></worldbody></mujoco>')
    placement = Placement(
        robot=Robot(model=str(path), tcp="arm"), model=load_model(path), command_mode=CommandMode.EFFORT
    )
    scene = Scene(cameras={"above": Camera(pos=(0.0, -2.0, 2.0), target=(0.0, 0.0, 0.0))})
    sim = MujocoSimulation({"robot": placement}, scene, num_envs=1, physics_timestep=0.002)
    shares = [
        float((sim.render(size=(64, 64), modality="segmentation", fast=fast) == sim.body_ids["robot/base"]).mean())
        for fast in (False, True)
    ]
    assert 0.005 < shares[0] == pytest.approx(shares[1], rel=0.1)
    sim.close()
