"""What ``frobs migrate`` reads from the source of a package, and that it runs none of it."""

from __future__ import annotations

import ast
import os
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from frobs_core.util.errors import ConfigurationError, UnknownNameError
from frobs_rl_compat.migrate import read_package
from frobs_rl_compat.migrate.comments import insert_in_method, todo
from frobs_rl_compat.migrate.expressions import Evaluator, UnknownValueError

HERE = Path(__file__).parent
PARAMETERS = {"/arm/low": -2.0}

VALUES = {
    "[1, -2.5, 'x']": [1, -2.5, "x"],
    "np.pi / 2": np.pi / 2,
    "np.array([1.0, 2.0]) * scale": np.array([3.0, 6.0]),
    "np.concatenate([np.ones(2), np.array([5])], axis=None)": np.array([1.0, 1.0, 5.0]),
    "{'a': (1, 2)}['a'][0]": 1,
    "rospy.get_param('/arm/low')": -2.0,
    "rospy.get_param('/arm/other', 4)": 4,
    "self.limit[1:]": [2, 3],
}
UNKNOWN = [
    "__import__('os').system('true')",
    "open('/etc/passwd').read()",
    "missing",
    "rospy.get_param('/arm/other')",
    "2 ** 100000",
    "[0] * 10 ** 9",
    "np.zeros((10000, 10000))",
    "(lambda: 1)()",
    "1 / 0",
]


@pytest.fixture
def evaluator():
    return Evaluator({"scale": 3, "self.limit": [1, 2, 3]}, PARAMETERS.__getitem__)


@pytest.mark.parametrize("text", VALUES)
def test_values_are_told_from_their_syntax(evaluator, text):
    assert np.array_equal(evaluator.value(ast.parse(text, mode="eval").body), VALUES[text])


@pytest.mark.parametrize("text", UNKNOWN)
def test_what_would_have_to_be_run_has_no_value(evaluator, text):
    with pytest.raises(UnknownValueError):
        evaluator.value(ast.parse(text, mode="eval").body)


@pytest.mark.parametrize("name", ["old_gym_package", "gymnasium_package"])
def test_a_package_is_read_without_being_imported(name):
    package = read_package(HERE / name)
    said = package.constructed
    assert package.name == name
    assert [old.name for old in package.lineage] == ["PlaneArmReachEnv", "PlaneArmEnv"]
    assert package.registration is not None
    assert package.registration.max_episode_steps == 10000
    assert max(package.time_limits) == 20
    assert said.parameters["urdf_file"] == "plane_arm.urdf.xacro"
    assert said.parameters["controller_list"] == ["joint_state_controller", "arm_controller"]
    assert said.parameters["gazebo_timestep"] == 0.002
    assert said.unknown_parameters == {}
    assert said.values["self.action_space"] == gymnasium.spaces.Box(-0.2, 0.2, (2,), np.float32)
    low = np.array([-2.5, -2.0, -0.4, -0.4, -0.7, -0.7])
    assert np.allclose(said.values["self.observation_space"].low, low)
    assert package.hook("_check_if_done").name == "PlaneArmReachEnv"


TASK = """
from gym import spaces
from gym.envs.registration import register
from frobs_rl.templates import CustomRobotEnv
import rospy

raise RuntimeError("this file was run")

register("One-v0", "lab.one:One", max_episode_steps=50)
register(id="Two-v1", entry_point="lab.one:Two")

class One(CustomRobotEnv.CCustomRobotEnv):
    def __init__(self, easy=True):
        if rospy.has_param("/size"):
            size = 4
        else:
            size = 5
        self.action_space = spaces.Discrete(size)
        self.observation_space = spaces.Box(low=0, high=1, shape=(3,))
        super(One, self).__init__()

    def _get_reward(self):
        raise NotImplementedError()

class Two(One):
    pass
"""


@pytest.fixture
def package_of_two(tmp_path):
    (tmp_path / "one.py").write_text(TASK)
    (tmp_path / "old.py").write_text("print 'python 2'")
    return tmp_path


def test_a_value_under_an_unknown_condition_is_unknown(package_of_two):
    said = read_package(package_of_two).constructed
    assert "self.action_space" in said.unknown
    assert said.values["self.observation_space"].shape == (3,)


def test_one_of_several_environments_is_chosen_by_its_id(package_of_two):
    first, second = read_package(package_of_two, "One-v0"), read_package(package_of_two)
    assert second.registration.id == "Two-v1"  # nothing inherits it, so it is a task and One its robot
    assert second.others == []
    assert [old.name for old in second.lineage] == ["Two", "One"]
    assert first.registration.max_episode_steps == 50
    assert first.hook("_get_reward") is None
    assert [path.name for path in first.python.unread] == ["old.py"]
    with pytest.raises(UnknownNameError, match="One-v0"):
        read_package(package_of_two, "One-v1")


@pytest.mark.parametrize("name", ["one.py", "package.xml"])
def test_files_that_are_huge_or_would_block_are_not_read(package_of_two, name):
    path = package_of_two / name
    with path.open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(ConfigurationError, match=f"{name}.*size limit"):
        read_package(package_of_two)
    path.unlink()
    os.mkfifo(path)
    if name == "package.xml":
        assert read_package(package_of_two).name == package_of_two.name
    else:
        with pytest.raises(ConfigurationError, match="not a regular file"):
            read_package(package_of_two)


def test_a_path_that_is_no_package_is_not_walked_to_its_end(tmp_path):
    for number in range(1_001):
        (tmp_path / str(number)).mkdir()
    with pytest.raises(ConfigurationError, match="more than 1,000 subfolders; pass the folder of one ROS package"):
        read_package(tmp_path)


TASKS = """
from gym.envs.registration import register
from lab.arm import Arm

register(id="Reach-v{version}", entry_point="lab.reach_v{version}:Reach", max_episode_steps={version})

class Reach(Arm):
    pass
"""


def test_the_task_that_a_script_trains_is_chosen_among_classes_of_one_name(tmp_path):
    (tmp_path / "arm.py").write_text(
        "register(id='Arm-v0', entry_point='lab.arm:Arm')\nclass Arm(robot_BasicEnv.RobotBasicEnv): pass\n"
    )
    for version in (1, 2):
        (tmp_path / f"reach_v{version}.py").write_text(TASKS.format(version=version))
    (tmp_path / "a_test.py").write_text("env = TimeLimitWrapper(gym.make('Reach-v1'), max_steps=5)\n")
    script = "env = TimeLimitWrapper(gym.make('Reach-v2'), max_steps=7)\nTD3(env, config_filename='td3.yaml').train()\n"
    (tmp_path / "train.py").write_text(script)
    package = read_package(tmp_path)
    assert package.registration.id == "Reach-v2"
    assert [old.path.name for old in package.lineage] == ["reach_v2.py", "arm.py"]
    assert package.time_limits == [7]
    assert package.others == ["Reach-v1"]


def test_bounds_of_higher_precision_are_read_without_a_warning(recwarn):
    box = Evaluator({}, PARAMETERS.__getitem__).value(
        ast.parse("spaces.Box(low=np.array([-0.1]), high=np.array([0.1]), dtype=np.float32)", mode="eval").body
    )
    assert box == gymnasium.spaces.Box(-0.1, 0.1, (1,), np.float32)
    assert not [each for each in recwarn if "gymnasium" in str(each.filename) or "precision" in str(each.message)]


def test_a_folder_without_environments_is_refused(tmp_path):
    (tmp_path / "other.py").write_text("class Other: pass")
    with pytest.raises(ConfigurationError, match=r"RobotBasicEnv.*Other"):
        read_package(tmp_path)
    with pytest.raises(ConfigurationError, match="neither a folder nor a file"):
        read_package(tmp_path / "nowhere")


def test_comments_keep_indentation_and_width():
    lines = todo(" ".join(["do it"] * 40), 8)
    assert lines[0].startswith("        # TODO: do it")
    assert lines[1].startswith("        # ")
    assert max(map(len, lines)) <= 120
    text = 'class A:\n    def f(self):\n        """Say.\n\n        More.\n        """\n        return 1\n'
    inserted = insert_in_method(text, "f", ["        # here"])
    assert inserted.splitlines()[6] == "        # here"
    assert ast.dump(ast.parse(inserted)) == ast.dump(ast.parse(text))


@pytest.mark.parametrize(
    "text", ["class Reach(Arm):\n    print 'python 2'\n", "register(id='A-v0'\n", "\0\nclass A(B):\n"]
)
def test_a_file_of_the_environment_that_is_no_python_of_today_is_named(package_of_two, text):
    (package_of_two / "reach.py").write_text(text)
    with pytest.raises(ConfigurationError, match=r"reach\.py.*fix the error"):
        read_package(package_of_two)
