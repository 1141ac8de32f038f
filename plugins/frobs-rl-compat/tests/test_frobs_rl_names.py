"""The import names of FRobs_RL, and what is behind them."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from pathlib import Path

import gym
import gymnasium
import numpy as np
import pytest

import frobs_algos_sb3.frobs_rl
import frobs_core.wrappers
import frobs_rl
from frobs_rl.models.basic_model import BasicModel
from frobs_rl.models.td3 import TD3
from frobs_rl.wrappers.NormalizeActionWrapper import NormalizeActionWrapper
from frobs_rl.wrappers.NormalizeObservationWrapper import NormalizeObservationWrapper
from frobs_rl.wrappers.TimeLimitWrapper import TimeLimitWrapper
from frobs_rl_compat.manner import manner_of

SHARE = Path(frobs_rl.__file__).parent
TD3_YAML = Path(__file__).parent / "old_gym_package" / "config" / "td3.yaml"
ALGORITHMS = ["ppo", "a2c", "ddpg", "dqn", "sac", "td3"]


@pytest.mark.parametrize("name", ALGORITHMS)
def test_each_algorithm_has_its_module(name):
    found = getattr(importlib.import_module(f"frobs_rl.models.{name}"), name.upper())
    assert issubclass(found, getattr(frobs_algos_sb3.frobs_rl, name.upper()))


def test_wrappers_have_both_names_of_the_documentation():
    one, other = (
        importlib.import_module(f"frobs_rl.wrappers.{name}")
        for name in ("NormalizeObservationWrapper", "NormalizeObservWrapper")
    )
    assert one.NormalizeObservationWrapper is other.NormalizeObservWrapper is one.NormalizeObservWrapper
    assert issubclass(NormalizeObservationWrapper, frobs_core.wrappers.NormalizeObservationWrapper)
    assert issubclass(BasicModel, frobs_algos_sb3.frobs_rl.BasicModel)


@pytest.mark.parametrize("name", ALGORITHMS)
def test_the_default_files_are_those_of_the_algorithms(name):
    original = Path(frobs_algos_sb3.frobs_rl.__file__).parent / "config" / f"{name}_config.yaml"
    assert (SHARE / "config" / original.name).read_bytes() == original.read_bytes()


def test_the_ros_package_is_found_by_whoever_python_starts():
    code = "import os; print(os.environ['ROS_PACKAGE_PATH'])"
    environment = {**os.environ, "ROS_PACKAGE_PATH": "/somewhere/else"}
    paths = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert paths.stdout.strip().split(os.pathsep) == ["/somewhere/else", str(SHARE)]
    assert (SHARE / "package.xml").is_file()


def make(manner: str):
    if manner == "gym":
        return gym.make("Pendulum-v1", max_episode_steps=10)
    return gymnasium.make("Pendulum-v1", max_episode_steps=10)


@pytest.mark.parametrize(("manner", "values"), [("gym", 4), ("gymnasium", 5)])
def test_wrappers_answer_as_what_they_wrap(manner, values):
    env = TimeLimitWrapper(NormalizeObservationWrapper(NormalizeActionWrapper(make(manner))), max_steps=3)
    first = env.reset()
    assert isinstance(first, np.ndarray) is (manner == "gym")
    steps = [env.step(env.action_space.sample()) for _ in range(3)]
    assert {len(step) for step in steps} == {values}
    assert steps[-1][2] is (manner == "gym")
    assert steps[-1][-1]["time_limit_reached"] is True
    assert steps[-1][-1]["is_success"] == 0.0
    assert env.max_torque == 2.0
    env.close()


@pytest.mark.parametrize("manner", ["gym", "gymnasium"])
def test_a_td3_script_of_the_documentation_trains_saves_loads_and_predicts(manner, tmp_path):
    env = TimeLimitWrapper(NormalizeObservationWrapper(NormalizeActionWrapper(make(manner))), max_steps=10)
    env.reset()
    save_path, log_path = str(tmp_path) + "/models/td3/", str(tmp_path) + "/logs/td3/"
    model = TD3(env, save_path, log_path, config_file_pkg=None, config_filename=str(TD3_YAML))
    model.train()
    model.save_model()
    assert model.model.num_timesteps == 60
    trained = TD3.load_trained(save_path + "trained_model")
    observation = env.reset() if manner == "gym" else env.reset()[0]
    action, _ = trained.predict(observation, deterministic=True)
    answer = env.step(action)
    assert len(answer) == (4 if manner == "gym" else 5)
    model.close_env()


def test_the_default_package_is_found_without_ros(tmp_path):
    from frobs_rl.models.ppo import PPO

    env = make("gym")
    model = PPO(env, tmp_path / "models", tmp_path / "logs")
    assert model.settings.params.training_steps == 5000
    model.close_env()


COMMON = {
    "ros_controllers": "load_controller_srv",
    "ros_gazebo": "launch_Gazebo",
    "ros_launch": "ros_launch_from_pkg",
    "ros_node": "ros_kill_all_processes",
    "ros_params": "ros_load_yaml_from_pkg",
    "ros_spawn": "spawn_model_in_gazebo",
    "ros_urdf": "urdf_load_from_pkg",
}


@pytest.mark.parametrize("name", COMMON)
def test_each_helper_is_that_of_frobs_ros(name):
    ours, theirs = (importlib.import_module(f"{package}.{name}") for package in ("frobs_rl.common", "frobs_ros"))
    assert getattr(ours, COMMON[name]) is getattr(theirs, COMMON[name])


def test_the_templates_have_both_names_of_the_documentation():
    from frobs_rl.envs import robot_BasicEnv
    from frobs_rl.templates import CustomRobotEnv, CustomTaskEnv

    assert CustomRobotEnv.CCustomRobotEnv is CustomRobotEnv.CustomRobotEnv
    assert CustomTaskEnv.CCustomTaskEnv is CustomTaskEnv.CustomTaskEnv
    assert issubclass(CustomTaskEnv.CustomTaskEnv, robot_BasicEnv.RobotBasicEnv)
    assert gymnasium.spec("CustomTaskEnv-v0").max_episode_steps == 10000


@pytest.mark.parametrize("name", ["gym", "gymnasium"])
def test_a_robots_environment_has_the_manner_that_its_file_imports(name, tmp_path, monkeypatch):
    (tmp_path / f"robot_{name}.py").write_text(
        f"from {name} import spaces\nfrom frobs_rl.envs import robot_BasicEnv\n"
        "class Robot(robot_BasicEnv.RobotBasicEnv):\n    pass\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    made = object.__new__(importlib.import_module(f"robot_{name}").Robot)  # its constructor would want ROS
    assert manner_of(made).value == name


WITHOUT_ROS = """
from pathlib import Path
from frobs_ros import environment

environment.SYSTEM = environment.DISTRIBUTION = Path("/nowhere")
"""


@pytest.mark.parametrize(
    ("module", "told"),
    [
        ("rospy", "it is not installed for this Python. Install it with 'apt-get install ros-core"),
        ("sensor_msgs.msg", "'frobs doctor ros' says"),
        ("moveit_commander", "MoveIt is not installed, and nothing stands in for it"),
        ("moveit_commander.conversions", "frobs migrate PATH"),
    ],
)
def test_what_a_package_imports_and_is_missing_says_what_to_do(module, told):
    code = WITHOUT_ROS + f"import {module}"
    done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True)
    last = done.stderr.strip().splitlines()[-1]
    top = module.partition(".")[0]
    if done.returncode == 0:
        pytest.skip(f"{top} is installed in this environment")
    assert last.startswith(f"ModuleNotFoundError: No module named '{top}': ")
    assert told in last


def test_who_only_asks_for_a_missing_module_is_told_that_it_is_not_there():
    code = WITHOUT_ROS + (
        "import importlib.util\n"
        "print(importlib.util.find_spec('moveit_msgs'))\n"
        "try:\n    import moveit_msgs\nexcept ImportError as error:\n    print(error.name)\n"
        "import frobs_rl.common.ros_gazebo, frobs_rl.envs.robot_BasicEnv"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["None", "moveit_msgs"]
