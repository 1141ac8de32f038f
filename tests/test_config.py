"""The configuration of environments."""

from __future__ import annotations

import json
from contextlib import closing
from dataclasses import FrozenInstanceError, fields
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import frobs_core.plugins
from frobs_core.kernel.config import KEYWORDS, EnvConfig
from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.robot_config import RobotConfig, RobotKeywords
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.models import load_model
from frobs_core.plugins.registry import environments
from frobs_core.util.errors import ConfigurationError, ModelFileError, UnknownParameterError

PARTS = {"task": "reach", "robot": "irb120", "controller": "joint_delta_position"}
FULL = {
    **PARTS,
    "simulator": "pybullet",
    "reward_type": "sparse",
    "render_size": (84, 84),
    "control_timestep": 0.02,
    "controller_kwargs": {"max_delta": 0.1},
    "simulator_kwargs": {"iterations": 20},
    "home": {"joint_2": 0.1},
    "num_threads": 1,
    "randomize": {"mass": {"target": "robot/link_3", "scale": [0.9, 1.1]}},
    "goal_low": np.array([0.1, -0.2, 0.3]),
    "goal_high": (0.5, 0.2, np.float64(0.6)),
}


@pytest.mark.parametrize("id", sorted(environments()))
def test_keywords_of_every_id_survive_json(id):
    config = EnvConfig.from_dict(gym.spec(id).kwargs)
    plain = config.to_dict()
    assert EnvConfig.from_dict(plain) == config
    assert EnvConfig.from_dict(json.loads(json.dumps(plain))) == config


def test_every_kind_of_keyword_survives_json():
    config = EnvConfig.from_dict(FULL)
    plain = json.loads(json.dumps(config.to_dict()))
    assert EnvConfig.from_dict(plain) == config
    assert plain["goal_low"] == [0.1, -0.2, 0.3]
    assert plain["goal_high"] == [0.5, 0.2, 0.6]


def test_plain_keywords_leave_out_the_defaults():
    assert EnvConfig.from_dict({**PARTS, "num_threads": 0, "camera": None, "home": None}).to_dict() == PARTS


def test_keywords_that_are_no_field_are_the_tasks():
    config = EnvConfig.from_dict({**PARTS, "tolerance": 0.1})
    assert config.task_parameters == {"tolerance": 0.1}
    assert config == EnvConfig(**PARTS, task_parameters={"tolerance": 0.1})
    assert config != EnvConfig(**PARTS)


def test_arguments_of_a_robot_file_reach_it_with_a_tool_too(tmp_path):
    arm = tmp_path / "my+arm.urdf.xacro"
    text = (Path(__file__).parents[1] / "templates" / "my_arm.urdf.xacro").read_text()
    arm.write_text(text.replace('<xacro:arg name="effort" default="30"/>', ""))
    for robot in (str(arm), f"{arm}+parallel_gripper"):
        found = RobotConfig(robot=robot, xacro_args={"effort": "7"}).describe()
        model = load_model(found.model, xacro_args=found.xacro_args)
        assert [joint.limits.effort for joint in model.actuated_joints[:2]] == [7.0, 7.0]
        with pytest.raises(ModelFileError, match=r"set it with xacro_args=\{'effort': VALUE\} in an environment"):
            load_model(RobotConfig(robot=robot).describe().model)


def test_a_configuration_cannot_be_changed():
    with pytest.raises(FrozenInstanceError):
        EnvConfig(**PARTS).task = "navigate"


@pytest.mark.parametrize("build", [RobotEnv, RobotVectorEnv])
def test_an_environment_holds_its_configuration(build):
    with closing(build(**PARTS, tolerance=0.1)) as env:
        assert env.config.to_dict() == {**PARTS, "tolerance": 0.1}


def test_objects_are_accepted_but_have_no_plain_form():
    robot = frobs_core.plugins.get_record("robot", "irb120").load()
    config = EnvConfig.from_dict({**PARTS, "robot": robot})
    with closing(RobotEnv(**{**PARTS, "robot": robot})) as env:
        assert env.config == config
    with pytest.raises(ConfigurationError, match="keyword 'robot' cannot be converted to JSON"):
        config.to_dict()
    record = frobs_core.plugins.get_record("simulator", "mujoco")
    with pytest.raises(ConfigurationError, match="keyword 'simulator' cannot be converted to JSON"):
        EnvConfig.from_dict({**PARTS, "simulator": record}).to_dict()


@pytest.mark.parametrize(
    ("keywords", "says"),
    [
        ({"task": 3}, "task is 3; it must be a name or a TaskRecord"),
        ({"robot": None}, "robot is None; it must be a name, the path of a model file or a Robot"),
        ({"simulator": b"mujoco"}, "simulator is b'mujoco'"),
        ({"controller_kwargs": ["max_delta"]}, "controller_kwargs is .* must be a mapping"),
        ({"simulator_kwargs": "newton"}, "simulator_kwargs is 'newton'; it must be a mapping"),
        ({"control_timestep": "0.04"}, "control_timestep is '0.04'; it must be a number of seconds"),
        ({"num_threads": 1.5}, "num_threads is 1.5; it must be a whole number"),
        ({"num_threads": -1}, "num_threads is -1; it must be a whole number from 0 to 1,024"),
        ({"render_size": 84}, r"render_size is 84; it must be \(height, width\)"),
        ({"render_size": (84, 0)}, r"render_size is \(84, 0\)"),
        ({"render_mode": "rgb"}, "render_mode is 'rgb'; it must be one of .rgb_array., .human."),
    ],
)
def test_a_wrong_type_is_named(keywords, says):
    with pytest.raises(ConfigurationError, match=says):
        EnvConfig.from_dict({**PARTS, **keywords})


def test_a_misspelled_keyword_of_the_environment_is_suggested():
    with pytest.raises(UnknownParameterError, match="Did you mean 'simulator_kwargs'"):
        RobotEnv(**PARTS, simulator_kwarg={})


def test_every_keyword_is_documented():
    documented = EnvConfig.__doc__ + RobotKeywords.__doc__
    assert all(f"\n        {field.name}: " in documented for field in fields(EnvConfig))
    assert {field.name for field in fields(EnvConfig)} - {"task_parameters"} == KEYWORDS


def test_simulator_keywords_reach_mujoco():
    chosen = {"solver": "cg", "cone": "elliptic", "impratio": 10.0, "iterations": 7, "tolerance": 1e-6}
    with closing(gym.make("frobs/Irb120Reach-v0", simulator_kwargs=chosen)) as env:
        option = env.unwrapped.simulation.native.model.opt
        found = (option.solver, option.cone, option.impratio, option.iterations, option.tolerance)
    assert found == (1, 1, 10.0, 7, 1e-6)


@pytest.mark.needs("pybullet")
@pytest.mark.parametrize("num_envs", [1, 2])
def test_simulator_keywords_reach_bullet(num_envs):
    import pybullet

    keywords = {**PARTS, "simulator": "pybullet", "num_threads": 1, "simulator_kwargs": {"iterations": 7}}
    with closing(RobotVectorEnv(num_envs, **keywords)) as env:
        for world in env.simulation.native:
            assert pybullet.getPhysicsEngineParameters(world.client)["numSolverIterations"] == 7


@pytest.mark.parametrize("simulator", ["mujoco", "pybullet"])
@pytest.mark.parametrize(
    ("given", "error", "says"),
    [
        ({"itrations": 5}, UnknownParameterError, "Did you mean 'iterations'"),
        ({"num_threads": 1}, UnknownParameterError, "has no parameter 'num_threads'"),
        ({"iterations": 0}, ConfigurationError, "iterations is 0; it must be a whole number of at least 1"),
        ({"cone": "round"}, ConfigurationError, "cone is 'round'; it must be one of 'pyramidal', 'elliptic'"),
    ],
)
def test_wrong_simulator_keywords_are_named(simulator, given, error, says):
    with pytest.raises(error, match=says):
        RobotEnv(**PARTS, simulator=simulator, simulator_kwargs=given)
