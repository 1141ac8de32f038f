"""Packages of FRobs_RL run unmodified: a real ROS master, real nodes, and behind the names of Gazebo the bridge, over MuJoCo
and over a real Gazebo."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

HERE = Path(__file__).parent
EXAMPLES = HERE.parent / "examples"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["old_gym_package", "gymnasium_package"])
@pytest.mark.ros_feature("packages that use FRobs_RL", "mujoco", "gazebo")
def test_an_old_package_spawns_trains_saves_loads_and_predicts(name, backend, run_package, tmp_path):
    run = run_package(HERE / name, backend)
    trained = run("train.py")
    assert re.search(r"total_timesteps \| 60", trained)
    folder = tmp_path / name
    assert {path.name for path in (folder / "models" / "td3").glob("*.zip")} == {
        "td3_model_30_steps.zip",
        "td3_model_60_steps.zip",
        "trained_model.zip",
    }
    assert (folder / "logs" / "td3" / "TD3_1" / "progress.csv").is_file()
    assert "Episode: 2 success" in run("predict.py")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["abb_irb120_reacher", "kobuki_maze_rl"])
@pytest.mark.ros_feature("packages that use FRobs_RL", "mujoco", "gazebo")
def test_the_examples_train_for_a_short_while(name, backend, run_package, tmp_path):
    run = run_package(EXAMPLES / name, backend)
    config = tmp_path / name / "config"
    text = (config / "td3.yaml").read_text()
    for key, value in (("training_steps", 60), ("learning_starts", 20), ("save_freq", 60), ("batch_size", 16)):
        text = re.sub(rf"{key}: \d+", f"{key}: {value}", text)
    (config / "short.yaml").write_text(text)
    run("train.py", "short.yaml")
    assert (tmp_path / name / "models" / "td3" / "trained_model.zip").is_file()


BOXES = """
import gym
import numpy as np
import rospy
from frobs_rl.common import ros_gazebo
from kobuki_maze_rl.task_env import kobuki_maze

ros_gazebo.launch_Gazebo(paused=True, gui=False, custom_world_pkg="kobuki_maze_rl", custom_world_name="maze.world")
rospy.init_node("boxes")
env = gym.make("KobukiMazeEnv-v0")


def places():
    poses = [ros_gazebo.gazebo_get_model_state(name)[1].position for name in kobuki_maze.BOXES]
    return np.array([[pose.x, pose.y] for pose in poses])


for episode in range(2):
    env.seed(episode)
    env.reset()
    begin = places()
    assert np.allclose(begin, list(kobuki_maze.BOXES.values()), atol=1e-3), begin
    for _ in range(3):
        env.step([0.0, 0.0])
    gone = np.linalg.norm(places() - begin, axis=1)
    assert np.allclose(gone, 3 * env.unwrapped.box_step, atol=1e-3), (gone, env.unwrapped.box_step)
    assert gone.max() > 1e-3

kobuki_maze.BOXES["box_1"] = (-5.0, 8.7)  # so near that the lidar sees it, wherever it and the robot look
env.reset()
scan = env.step([0.0, 0.0])[0][-8:]
assert 0.4 < scan.min() < 0.9, scan
env.close()
"""


@pytest.mark.slow
@pytest.mark.ros_feature("packages that use FRobs_RL", "mujoco", "gazebo")
def test_the_boxes_of_the_maze_move_begin_anew_and_are_seen(backend, run_package, tmp_path):
    run = run_package(EXAMPLES / "kobuki_maze_rl", backend)
    (tmp_path / "kobuki_maze_rl" / "scripts" / "boxes.py").write_text(BOXES)
    run("boxes.py")
