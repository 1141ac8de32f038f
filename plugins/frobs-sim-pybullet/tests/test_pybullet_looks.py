"""Colors, light and cameras that differ between environments."""

from __future__ import annotations

from contextlib import closing
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_sim_pybullet.bullet import pybullet

ID = "frobs_core:frobs/PandaPickAndPlace-v0"


def share(one: Any, other: Any) -> float:
    """Return the share of pixels in which two pictures differ."""
    return float((np.abs(one.astype(int) - other).max(axis=-1) > 4).mean())


def test_a_link_and_the_floor_are_painted_and_a_resized_cube_keeps_its_color() -> None:
    cameras = {"horizon": {"pos": [2.5, 0.0, 0.5], "target": [0.0, 0.0, 0.6]}}
    env: Any = gym.make_vec(ID, num_envs=2, simulator="pybullet", cameras=cameras)
    with closing(env):
        env.reset(seed=[0, 0])
        simulation = env.unwrapped.simulation
        saved = simulation.snapshot()
        first = np.array([True, False])

        def picture() -> Any:
            return simulation.render(None, "overview", (120, 160))

        before = picture()
        assert share(*before) == 0.0
        assert "robot/gripper_body" in simulation.parameter_targets("color")
        for target in ("robot/gripper_body", "floor", "cube"):
            simulation.write_parameter("color", target, np.array([0.9, 0.1, 0.1]), first)
            painted = picture()
            assert share(painted[1], before[1]) == 0.0
            assert share(painted[0], before[0]) > 0.001, target
            before = painted
        white = simulation.render(None, "horizon", (60, 80))
        empty = simulation.render(None, "horizon", (60, 80), "segmentation")[0, ..., 0] < 0
        simulation.write_parameter("color", "sky", np.array([0.0, 0.2, 0.8]), first)
        blue = simulation.render(None, "horizon", (60, 80))
        assert (white[0][empty] == 255).all()
        assert (blue[0][empty] == [0, 51, 204]).all()
        np.testing.assert_array_equal(blue[0][~empty], white[0][~empty])
        np.testing.assert_array_equal(blue[1], white[1])
        simulation.write_parameter("size", "cube", np.array([1.5]), first)
        larger = picture()
        red = np.abs(larger[0].astype(int) - [230, 26, 26]).max(axis=-1)
        assert share(larger[0], before[0]) > 0.0
        assert red.min() < 120
        simulation.restore(saved)
        assert share(*picture()) == 0.0


def test_depth_is_that_of_the_centers_of_the_pixels() -> None:
    pos, target, up = (0.5, -1.2, 0.5), (0.5, 0.0, 0.1), (1.0, 0.3, 0.2)
    lens = {"fx": 100.0, "fy": 110.0, "cx": 70.0, "cy": 40.0, "width": 128, "height": 96}
    tilted = {"pos": pos, "target": target, "up": up, "intrinsics": lens}
    env: Any = gym.make(ID, simulator="pybullet", cameras={"tilted": tilted}).unwrapped
    with closing(env):
        env.reset(seed=0)
        depth, body = (
            env.simulation.render(None, "tilted", (96, 128), kind)[0, ..., 0] for kind in ("depth", "segmentation")
        )
    ahead = np.subtract(target, pos) / np.linalg.norm(np.subtract(target, pos))
    right = np.cross(ahead, up) / np.linalg.norm(np.cross(ahead, up))
    column, row = np.meshgrid((np.arange(128) - 70.0) / 100.0, (np.arange(96) - 40.0) / 110.0)
    rise = ahead[2] + column * right[2] + row * np.cross(ahead, right)[2]  # of the ray through each pixel
    floor = (body == 0) & (depth < 2.5)
    assert floor.sum() > 3000
    np.testing.assert_allclose(depth[floor], -pos[2] / rise[floor], atol=1e-3)


def test_the_window_shows_what_is_painted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(pybullet, "GUI", pybullet.DIRECT)  # a window needs a display
    env: Any = gym.make(ID, simulator="pybullet").unwrapped
    with closing(env):
        env.reset(seed=0)
        simulation = env.simulation
        simulation.open_viewer()
        simulation.write_parameter("color", "cube", np.array([0.9, 0.1, 0.2]))
        env.step(env.action_space.sample())
        stage = simulation._viewer._stage
        [shape] = pybullet.getVisualShapeData(stage._bodies["cube"], physicsClientId=stage.client)
        np.testing.assert_allclose(shape[7][:3], [0.9, 0.1, 0.2], atol=1e-6)


def test_the_same_seed_gives_the_same_pictures() -> None:
    looks = {
        "color": [
            {"target": ["cube", "floor", "sky"], "set": [0, 1]},
            {"target": "robot/*", "add": [-0.1, 0.1], "shared": True},
        ],
        "light": {"scale": [0.6, 1.3]},
        "camera_position": {"add": {"normal": 0.01}},
        "camera_rotation": {"add": [-0.03, 0.03]},
        "camera_fov": {"add": [-2, 2]},
    }
    with closing(gym.make(ID.replace("-v0", "Vision-v0"), simulator="pybullet", randomize=looks)) as env:
        first, _ = env.reset(seed=0)
        second, _ = env.reset()
        again, _ = env.reset(seed=0)
    assert share(first["scene"], second["scene"]) > 0.5
    np.testing.assert_array_equal(first["scene"], again["scene"])
