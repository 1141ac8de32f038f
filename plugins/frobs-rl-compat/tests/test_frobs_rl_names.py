"""The import names of FRobs_RL, and what is behind them."""

from __future__ import annotations

import importlib
import sys
import types
from pathlib import Path

import gym
import gymnasium
import numpy as np
import pytest

import frobs_rl
import frobs_rl_compat.ros.robot_basic_env
import frobs_rl_compat.training
import frobs_rl_compat.wrappers
import frobs_ros
from frobs_core.deprecation import FrobsDeprecationWarning
from frobs_rl.envs.robot_BasicEnv import RobotBasicEnv
from frobs_rl.models.basic_model import BasicModel
from frobs_rl.models.td3 import TD3
from frobs_rl.wrappers.NormalizeActionWrapper import NormalizeActionWrapper
from frobs_rl.wrappers.NormalizeObservationWrapper import NormalizeObservationWrapper
from frobs_rl.wrappers.TimeLimitWrapper import TimeLimitWrapper

SHARE = Path(frobs_rl.__file__).parent
TD3_YAML = Path(__file__).parent / "old_gym_package" / "config" / "td3.yaml"
ALGORITHMS = ["ppo", "a2c", "ddpg", "dqn", "sac", "td3"]


@pytest.mark.parametrize("name", ALGORITHMS)
def test_each_algorithm_has_its_module(name):
    found = getattr(importlib.import_module(f"frobs_rl.models.{name}"), name.upper())
    assert found is getattr(frobs_rl_compat.training, name.upper())


def test_wrappers_have_both_names_of_the_documentation():
    one, other = (
        importlib.import_module(f"frobs_rl.wrappers.{name}")
        for name in ("NormalizeObservationWrapper", "NormalizeObservWrapper")
    )
    assert one.NormalizeObservationWrapper is other.NormalizeObservWrapper is one.NormalizeObservWrapper
    assert issubclass(NormalizeObservationWrapper, frobs_rl_compat.wrappers.NormalizeObservationWrapper)
    assert BasicModel is frobs_rl_compat.training.BasicModel


def make(library: str):
    if library == "gym":
        return gym.make("Pendulum-v1", max_episode_steps=10)
    return gymnasium.make("Pendulum-v1", max_episode_steps=10)


@pytest.mark.parametrize(("library", "values"), [("gym", 4), ("gymnasium", 5)])
def test_wrappers_keep_the_api_of_what_they_wrap(library, values):
    env = TimeLimitWrapper(NormalizeObservationWrapper(NormalizeActionWrapper(make(library))), max_steps=3)
    first = env.reset()
    assert isinstance(first, np.ndarray) is (library == "gym")
    steps = [env.step(env.action_space.sample()) for _ in range(3)]
    assert {len(step) for step in steps} == {values}
    assert steps[-1][2] is (library == "gym")
    assert steps[-1][-1]["time_limit_reached"] is True
    assert steps[-1][-1]["is_success"] == 0.0
    assert env.max_torque == 2.0
    env.close()


@pytest.mark.parametrize("library", ["gym", "gymnasium"])
def test_a_td3_script_of_the_documentation_trains_saves_loads_and_predicts(library, tmp_path):
    env = TimeLimitWrapper(NormalizeObservationWrapper(NormalizeActionWrapper(make(library))), max_steps=10)
    env.reset()
    save_path, log_path = str(tmp_path) + "/models/td3/", str(tmp_path) + "/logs/td3/"
    model = TD3(env, save_path, log_path, config_file_pkg=None, config_filename=str(TD3_YAML))
    model.train()
    model.save_model()
    assert model.model.num_timesteps == 60
    trained = TD3.load_trained(save_path + "trained_model")
    observation = env.reset() if library == "gym" else env.reset()[0]
    action, _ = trained.predict(observation, deterministic=True)
    answer = env.step(action)
    assert len(answer) == (4 if library == "gym" else 5)
    model.close_env()


def test_helpers_of_the_models_check_environments_and_read_the_parameter_server(monkeypatch):
    from frobs_rl.models import utils

    params = {
        "use_custom_policy": True,
        "policy_params": {"net_arch": [8, 4], "activation_fn": "tanh", "optimizer_class": "SGD"},
        "use_action_noise": True,
        "action_noise": {"mean": 0.5, "sigma": 0.1},
    }
    server = types.SimpleNamespace(get_param={"/model_params": params, "/robot/model_params": params}.__getitem__)
    monkeypatch.setitem(sys.modules, "rospy", server)
    assert utils.get_policy_kwargs()["net_arch"] == [8, 4]
    assert utils.get_policy_kwargs("/robot")["activation_fn"].__name__ == "Tanh"
    assert utils.get_action_noise(2)().shape == (2,)
    params |= {"use_custom_policy": False, "use_action_noise": False}
    assert utils.get_policy_kwargs() is None
    assert utils.get_action_noise(2) is None
    assert utils.test_env(NormalizeActionWrapper(make("gym")))


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
def test_each_helper_keeps_its_names_of_frobs_rl_and_of_version_0_2(name):
    new, *kept = (
        importlib.import_module(f"{package}.{name}")
        for package in ("frobs_rl_compat.ros", "frobs_rl.common", "frobs_ros")
    )
    with pytest.warns(FrobsDeprecationWarning, match=f"use frobs_rl_compat.ros.{name}.{COMMON[name]}"):
        assert all(getattr(module, COMMON[name]) is getattr(new, COMMON[name]) for module in kept)


def test_the_algorithms_keep_their_names_of_version_0_2():
    import frobs_algos_sb3.frobs_rl

    with pytest.warns(FrobsDeprecationWarning, match="use frobs_rl_compat.training.TD3"):
        assert frobs_algos_sb3.frobs_rl.TD3 is frobs_rl_compat.training.TD3


def test_the_base_class_keeps_its_names_of_version_0_2():
    with pytest.warns(FrobsDeprecationWarning, match="use frobs_rl_compat.ros.robot_basic_env.RobotBasicEnv"):
        assert frobs_ros.RobotBasicEnv is frobs_rl_compat.ros.robot_basic_env.RobotBasicEnv


def test_the_templates_have_both_names_of_the_documentation():
    from frobs_rl.envs import robot_BasicEnv
    from frobs_rl.templates import CustomRobotEnv, CustomTaskEnv

    assert CustomRobotEnv.CCustomRobotEnv is CustomRobotEnv.CustomRobotEnv
    assert CustomTaskEnv.CCustomTaskEnv is CustomTaskEnv.CustomTaskEnv
    assert issubclass(CustomTaskEnv.CustomTaskEnv, robot_BasicEnv.RobotBasicEnv)
    assert gymnasium.spec("CustomTaskEnv-v0").max_episode_steps == 10000


class Still(RobotBasicEnv):
    """A robot without ROS: only the values that ``reset`` and ``step`` return are looked at."""

    action_space = observation_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)

    def __init__(self):
        self.info = {}


@pytest.fixture
def fake_ros(monkeypatch):
    """Let the class that speaks to ROS return fixed values."""
    base = frobs_rl_compat.ros.robot_basic_env.RobotBasicEnv
    monkeypatch.setattr(base, "reset", lambda self, *, seed=None, options=None: (np.zeros(1, np.float32), {}))
    monkeypatch.setattr(base, "step", lambda self, action: (np.zeros(1, np.float32), 1.0, False, True, {}))


def test_a_class_of_frobs_rl_returns_four_values_and_takes_a_seed(fake_ros):
    env = Still()
    assert isinstance(env.reset(seed=1), np.ndarray)
    assert env.seed(3) == [3]
    assert env.step(None)[1:] == (1.0, True, {"TimeLimit.truncated": True})


@pytest.mark.parametrize(("library", "values"), [(gym, 4), (gymnasium, 5)], ids=["gym", "gymnasium"])
@pytest.mark.parametrize("registered", [gym, gymnasium], ids=["gym", "gymnasium"])
def test_make_decides_how_many_values_whoever_registered_the_class(fake_ros, library, registered, values):
    id = f"Still-{registered.__name__}-v0"
    if id not in gymnasium.registry:
        registered.register(id=id, entry_point=Still)
    env = NormalizeActionWrapper(library.make(id))
    assert isinstance(env.reset(), tuple) is (values == 5)
    assert len(env.step(np.zeros(1, np.float32))) == values
