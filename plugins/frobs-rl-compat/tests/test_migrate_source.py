"""What ``frobs migrate`` reads from the source of a package, and that it runs none of it."""

from __future__ import annotations

import ast
import os
from pathlib import Path

import pytest

from frobs_core.util.errors import ConfigurationError, UnknownNameError
from frobs_rl_compat.migrate import read_package
from frobs_rl_compat.migrate.comments import insert_todo, todo

HERE = Path(__file__).parent


@pytest.mark.parametrize("name", ["old_gym_package", "gymnasium_package"])
def test_a_package_is_read_without_being_imported(name):
    package = read_package(HERE / name)
    assert package.name == name
    assert [old.name for old in package.lineage] == ["PlaneArmReachEnv", "PlaneArmEnv"]
    assert package.registration is not None
    assert package.registration.max_episode_steps == 10000
    assert max(package.time_limits) == 20
    assert package.robot_arguments["urdf_file"] == "plane_arm.urdf.xacro"
    assert package.robot_arguments["controller_list"] == ["joint_state_controller", "arm_controller"]
    assert package.robot_arguments["gazebo_timestep"] == 0.002
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


@pytest.mark.parametrize(
    ("text", "arguments"),
    [
        ("urdf_file = 'arm.urdf'; super().__init__(urdf_file=urdf_file)", {"urdf_file": "arm.urdf"}),
        ("self.pkg_name = 'lab'; super().__init__(pkg_name=self.pkg_name, model_pos_x=-1.5)", {"pkg_name": "lab", "model_pos_x": -1.5}),
        ("super().__init__(urdf_file=__import__('os').system('true'), controller_list=[open('/etc/passwd')])", {}),
        ("self.speed = 3; super().__init__(urdf_xacro_args=[name for name in names])", {}),
    ],
)  # fmt: skip
def test_only_literal_arguments_of_the_robot_are_read(tmp_path, text, arguments):
    (tmp_path / "arm.py").write_text(f"class Arm(RobotBasicEnv):\n    def __init__(self):\n        {text}\n")
    assert read_package(tmp_path).robot_arguments == arguments


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
    text = 'class A:\n    x: int = 1\n\n    def f(self):\n        """Say.\n\n        More.\n        """\n        return 1\n'
    inserted = insert_todo(insert_todo(text, "f", "here"), "x", "there")
    assert inserted.splitlines()[9] == "        # TODO: here"
    assert inserted.splitlines()[1] == "    # TODO: there"
    assert ast.dump(ast.parse(inserted)) == ast.dump(ast.parse(text))


@pytest.mark.parametrize(
    "text", ["class Reach(Arm):\n    print 'python 2'\n", "register(id='A-v0'\n", "\0\nclass A(B):\n"]
)
def test_a_file_of_the_environment_that_is_no_python_of_today_is_named(package_of_two, text):
    (package_of_two / "reach.py").write_text(text)
    with pytest.raises(ConfigurationError, match=r"reach\.py.*fix the error"):
        read_package(package_of_two)
