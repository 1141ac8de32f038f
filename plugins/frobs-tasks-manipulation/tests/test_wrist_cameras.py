"""The wrist camera of each robot with a gripper: it sees the fingers and, at the start of an episode, the object."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_core import plugins
from frobs_core.description import Camera, Robot, Scene

OWN = Path(__file__).parents[3] / "tests" / "docs" / "files" / "my_gripper_arm.urdf"
ARMS = ("panda_arm", "irb120", "irb140", "ur5")
MOUNTED = [f"{arm}+{gripper}" for arm in ARMS for gripper in ("two_finger_hand", "parallel_gripper")]
ROBOTS = ("panda", "so101", *(pytest.param(robot, marks=pytest.mark.slow) for robot in (str(OWN), *MOUNTED)))
LEAST = 20  # pixels of 64 × 64
EPISODES = 8


@pytest.mark.needs("rendering")
@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: Path(robot).stem)
def test_the_wrist_camera_sees_the_fingers_and_the_object(robot: str) -> None:
    env: Any = gym.make("frobs_core:frobs/PickAndPlace-v0", robot=robot).unwrapped
    try:
        simulation = env.simulation
        model = simulation.robots["robot"].model
        fingers = {joint.child for joint in model.joints if joint.name in env.robot.end_effector.open}
        names = [simulation.model.body(i).name for i in range(simulation.model.nbody)]
        for seed in range(EPISODES):
            env.reset(seed=seed)
            picture = simulation.render(None, "wrist", (64, 64), "segmentation", ())[0]
            seen = {names[i]: int((picture == i).sum()) for i in np.unique(picture) if i >= 0}
            assert seen.get("cube", 0) >= LEAST, seen
            assert all(sum(n for name, n in seen.items() if name.endswith(finger)) >= LEAST for finger in fingers), seen
    finally:
        env.close()


def test_all_robots_have_a_camera() -> None:
    names = [name for name in plugins.records("robot") if "legacy" not in name]
    without = [name for name in names if not plugins.get_record("robot", name).load().cameras]
    assert without == []


def test_cameras_of_several_robots_have_different_names() -> None:
    camera = Camera(pos=(0.0, 0.0, 0.1), target=(0.0, 0.0, 1.0), frame="flange")
    robots = {name: Robot(model="arm.urdf", cameras={"wrist": camera}) for name in ("left", "right")}
    cameras = Scene(cameras={}).with_cameras_of(robots).cameras
    assert {name: each.frame for name, each in cameras.items()} == {
        "wrist": "left/flange",
        "right_wrist": "right/flange",
    }


def test_a_gripper_brings_its_camera_along() -> None:
    gripper = plugins.get_record("robot", "parallel_gripper").load()
    arm = plugins.get_record("robot", "ur5").load()
    joined = arm.attach("tool0", gripper, name="hand")
    assert joined.cameras == {"wrist": replace(gripper.cameras["wrist"], frame="hand_tcp")}
