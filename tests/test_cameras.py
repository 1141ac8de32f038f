"""Cameras that users add to a scene by keyword."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from frobs_core.description import Camera, Marker, Scene
from frobs_core.kernel.cameras import with_cameras
from frobs_core.kernel.compose import plan
from frobs_core.kernel.config import EnvConfig
from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.plugins import get_record
from frobs_core.plugins.records import SimulatorRecord
from frobs_core.util.errors import CapabilityError, FrobsError
from frobs_core.util.rotations import quat_conjugate, quat_rotate

PARTS: dict[str, Any] = {"task": "reach", "robot": "irb120", "controller": "joint_delta_position"}
LENS = {"fx": 100.0, "fy": 80.0, "cx": 70.0, "cy": 20.0, "width": 96, "height": 64}
WRIST = {"link": "link_3", "pos": [0.3, 0.4, 0.0], "target": [0.3, 0.0, 0.1]}
VIEW = {"wrist": {"camera": "wrist", "size": [64, 96], "markers": True}}


def project(camera: Camera, pose: tuple[np.ndarray, np.ndarray], point: np.ndarray) -> tuple[float, float]:
    """Return the pixel (u, v) of a point in the world frame, which is computed from the intrinsics alone."""
    pos, quat = pose
    in_frame = quat_rotate(quat_conjugate(quat), point[None] - pos)[0]
    forward = np.subtract(camera.target, camera.pos)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, camera.up or (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    offset, lens = in_frame - camera.pos, camera.intrinsics
    assert lens is not None
    depth, down = offset @ forward, np.cross(forward, right)
    return lens.fx * (offset @ right) / depth + lens.cx, lens.fy * (offset @ down) / depth + lens.cy


@pytest.mark.parametrize("simulator", [pytest.param("mujoco", marks=pytest.mark.needs("rendering")), "pybullet"])
@pytest.mark.parametrize("frame", ["link", "world"])
def test_point_is_where_the_intrinsics_project_it(simulator: str, frame: str) -> None:
    settings = WRIST if frame == "link" else {"pos": [1.2, -0.5, 0.9], "target": [0.4, 0.1, 0.4]}
    keywords = {"cameras": {"wrist": {**settings, "intrinsics": LENS}}, "simulator": simulator}
    camera = plan(EnvConfig(**PARTS, **keywords), 1).scene.cameras["wrist"]
    with closing(RobotEnv(**PARTS, **keywords)) as env:
        env.reset(seed=0)
        point = np.array([0.45, 0.0, 0.5])
        here = (np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0, 0.0]]))
        column, row = project(camera, env.robot.frame_pose("link_3") if frame == "link" else here, point)
        assert 5 < column < 90
        assert 5 < row < 58
        marker = Marker(point[None], 0.02, (1.0, 0.0, 0.0, 1.0))
        without, marked = (  # without shadows
            env.simulation.render(None, "wrist", (64, 96), markers=markers, fast=True)[0] for markers in ((), (marker,))
        )
        shown = np.argwhere(np.abs(marked.astype(int) - without).sum(axis=-1) > 60)
        assert shown.mean(axis=0) == pytest.approx([row, column], abs=1.0)


@pytest.mark.needs("rendering")
def test_camera_is_observed_rendered_and_read() -> None:
    keywords = {"cameras": {"wrist": {"robot": "robot", **WRIST}}, "observations": VIEW, "camera": "wrist"}
    with closing(RobotEnv(render_mode="rgb_array", render_size=(64, 96), **keywords, **PARTS)) as env:
        observation = env.reset(seed=0)[0]
        assert observation["wrist"].std() > 5.0
        assert (env.read_terms(VIEW)["wrist"] == observation["wrist"]).all()
        assert env.render().shape == (64, 96, 3)
        before = observation["wrist"].astype(int)
        after = env.step(np.array([1.0, 0, 0, 0, 0, 0]))[0]["wrist"]
        assert np.abs(after - before).max() > 5  # the camera moves with the link


def test_settings_move_the_camera_of_a_robot_or_replace_it() -> None:
    own = plan(EnvConfig(**PARTS), 1).scene.cameras["wrist"]
    assert own.frame == "robot/tool0"
    moved = plan(EnvConfig(**PARTS, cameras={"wrist": {"pos": [0.2, 0, 0]}}), 1).scene.cameras["wrist"]
    assert moved == replace(own, pos=(0.2, 0.0, 0.0))
    new = plan(EnvConfig(**PARTS, cameras={"wrist": {"pos": [1, 0, 1], "target": [0, 0, 0]}}), 1).scene.cameras["wrist"]
    assert new == Camera(pos=(1.0, 0.0, 1.0), target=(0.0, 0.0, 0.0))


def test_settings_change_the_camera_of_the_scene() -> None:
    scene = plan(EnvConfig(**PARTS), 1).scene
    changed = with_cameras(scene, {"overview": {"fov_y": 30}}, {}).cameras["overview"]
    assert changed == replace(scene.cameras["overview"], fov_y=30.0)


def test_field_of_view_follows_from_the_intrinsics() -> None:
    camera = with_cameras(Scene(), {"overview": {"intrinsics": {**LENS, "cy": 31.5}}}, {}).cameras["overview"]
    assert camera.fov_y == pytest.approx(2 * np.degrees(np.arctan(32 / 80)))


def test_simulator_without_intrinsics_refuses_them() -> None:
    mujoco = get_record("simulator", "mujoco")
    assert isinstance(mujoco, SimulatorRecord)
    for lacking, lens in (("camera_intrinsics", {"intrinsics": LENS}), ("cameras", {})):
        levels = {name: level for name, level in mujoco.capabilities.items() if name != lacking}
        config = EnvConfig(
            **PARTS, simulator=replace(mujoco, capabilities=levels), cameras={"wrist": {**WRIST, **lens}}
        )
        with pytest.raises(CapabilityError, match=rf"cameras\.wrist +{lacking}"):
            plan(config, 1)


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        (7, "cameras.wrist is 7; it must be a mapping with some of robot, link"),
        ({**WRIST, "fovy": 60}, "no parameter 'fovy'. Did you mean 'fov_y'"),
        ({**WRIST, "robot": "left"}, r"robot of the scene \(cameras.wrist.robot\) is named 'left'.* Available: robot"),
        ({**WRIST, "link": "tool1"}, r"link of robot 'robot' \(cameras.wrist.link\) is named 'tool1'"),
        ({"body": "cube", "pos": [1, 0, 0], "target": [0, 0, 0]}, r"body of the scene \(cameras.wrist.body\) .*'cube'"),
        ({**WRIST, "body": "cube"}, "cameras.wrist.link and cameras.wrist.body cannot be combined"),
        (
            {"robot": "robot", "pos": [1, 0, 0], "target": [0, 0, 0]},
            "needs link; name the link that carries the camera",
        ),
        ({**WRIST, "target": WRIST["pos"]}, "cameras.wrist.target is .*; it must be a point other than"),
        ({**WRIST, "pos": [0, 0, float("nan")]}, "cameras.wrist: pos.2 is nan; it must be a finite number"),
        ({**WRIST, "fov_y": 180}, "fov_y is 180; it must be less than 180"),
        ({**WRIST, "fov_y": 1e-6}, "cameras.wrist: field of view is 1e-06; it must be at least 0.01 degrees"),
        ({**WRIST, "intrinsics": {**LENS, "fx": 1e9}}, "cameras.wrist: field of view .* at least 0.01 degrees"),
        ({**WRIST, "fov_y": 60, "intrinsics": LENS}, "fov_y and cameras.wrist.intrinsics cannot be combined"),
        ({**WRIST, "intrinsics": {"fx": 100}}, "cameras.wrist needs intrinsics.fy"),
        ({**WRIST, "intrinsics": {**LENS, "k1": 0.1}}, "'intrinsics' of cameras.wrist has no parameter 'k1'"),
        ({**WRIST, "intrinsics": {**LENS, "fx": 0}}, "cameras.wrist: intrinsics.fx is 0; it must be greater than 0"),
        ({**WRIST, "up": [0.0, -0.8, 0.2]}, "up vector .* parallel to the viewing direction"),
    ],
)
def test_wrong_settings_are_named(settings: Any, text: str) -> None:
    with pytest.raises(FrobsError, match=text):
        RobotEnv(**PARTS, cameras={"wrist": settings})


def test_new_camera_needs_a_place() -> None:
    with pytest.raises(
        FrobsError, match="needs pos and target; only cameras of the scene have defaults: overview, wrist"
    ):
        RobotEnv(**PARTS, cameras={"hand": {"link": "link_3", "pos": [1, 0, 0]}})


def test_keyword_survives_a_round_trip() -> None:
    config = EnvConfig(**PARTS, cameras={"wrist": {**WRIST, "intrinsics": LENS}})
    assert EnvConfig.from_dict(config.to_dict()) == config


IMPERFECT = {
    "ideal": {"camera": "overview", "size": [24, 32]},
    "slow": {"camera": "overview", "size": [24, 32], "rate": 5},
    "late": {"camera": "overview", "size": [24, 32], "delay": 0.2},
    "noisy": {"camera": "overview", "size": [24, 32], "noise": 8.0},
    "far": {"camera": "overview", "size": [24, 32], "modality": "depth", "noise": 0.02},
    "depth": {"camera": "overview", "size": [24, 32], "modality": "depth"},
}


@pytest.mark.needs("rendering")
def test_a_camera_has_a_frame_rate_noise_and_a_delay() -> None:
    """The control timestep is 0.1 s: the slow camera takes every second picture, the late one is two steps behind."""
    with closing(RobotEnv(**PARTS, observations={"*": None, **IMPERFECT}, control_timestep=0.1)) as env:
        env.action_space.seed(1)
        seen = [env.reset(seed=0)[0]]
        seen += [env.step(env.action_space.sample())[0] for _ in range(6)]
        ideal = [each["ideal"] for each in seen]
        assert all((one != other).any() for one, other in pairwise(ideal))
        for k, each in enumerate(seen):
            np.testing.assert_array_equal(each["slow"], ideal[k - k % 2])
            np.testing.assert_array_equal(each["late"], ideal[max(0, k - 2)])
            assert each["noisy"].dtype == np.uint8
            gray = (ideal[k] > 40) & (ideal[k] < 215)
            assert np.std(each["noisy"].astype(float)[gray] - ideal[k][gray]) == pytest.approx(8.0, rel=0.15)
            assert each["far"].dtype == np.float32
            assert np.std(each["far"] - each["depth"]) == pytest.approx(0.02, rel=0.15)
        assert (seen[1]["noisy"] != seen[2]["noisy"]).any()
        saved = env.snapshot()
        action = env.action_space.sample()
        first = env.step(action)[0]
        env.restore(saved)
        again = env.step(action)[0]
        for name, picture in first.items():
            np.testing.assert_array_equal(picture, again[name])


@pytest.mark.needs("rendering")
def test_pictures_of_an_imperfect_camera_are_those_of_single_environments() -> None:
    """Episodes have different lengths, so the slow cameras of a vector environment take pictures at different times."""
    keywords = {**PARTS, "observations": IMPERFECT, "control_timestep": 0.1}
    with closing(RobotVectorEnv(2, **keywords)) as vector:
        vector.action_space.seed(0)
        together = [vector.reset(seed=[3, 4])[0]]
        actions = [vector.action_space.sample() for _ in range(5)]
        together += [vector.step(action)[0] for action in actions[:1]]
        mask = np.array([False, True])
        vector.reset(seed=[None, 4], options={"reset_mask": mask})
        together += [vector.step(action)[0] for action in actions[1:]]
    for index, seed in enumerate((3, 4)):
        with closing(RobotEnv(**keywords)) as env:
            env.reset(seed=seed)
            if index == 0:
                env.step(actions[0][index])
            for action, expected in zip(actions[1:], together[2:], strict=True):
                alone = env.step(action[index])[0]
                for name in IMPERFECT:
                    np.testing.assert_array_equal(alone[name], expected[name][index], name)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"rate": 4}, "observations.eye.*rate of 4 Hz does not fit .* use 3.333333333 or 5 Hz, as in observations="),
        ({"delay": 0.15}, "observations.eye.*delay of 0.15 s is not a multiple"),
        ({"noise": -1.0}, "noise"),
        ({"rate": 0}, "rate"),
    ],
)
def test_a_camera_that_does_not_fit_is_refused(setting: dict[str, Any], message: str) -> None:
    with pytest.raises(FrobsError, match=message):
        RobotEnv(**PARTS, observations={"eye": {"camera": "overview", **setting}}, control_timestep=0.1)
