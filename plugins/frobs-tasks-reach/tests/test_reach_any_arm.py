"""Reach with a robot that nobody has described: a model file, and the name of a link."""

from __future__ import annotations

from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
import trimesh

from frobs_core.util.errors import ConfigurationError, ModelFileError, UnsuitableRobotError
from frobs_tasks_reach.sampling import box_of

ID = "frobs_core:frobs/Reach-v0"
INERTIAL = '<inertial><origin xyz="0 0 0.2"/><mass value="1"/><inertia ixx="0.02" iyy="0.02" izz="0.004"/></inertial>'


def arm(scale: float = 1.0, mesh: str = "", suffix: str = "") -> str:
    """An arm of two links of 0.4 m: lying on the floor at home, where its first joint is at 90°."""
    length = 0.4 * scale
    shape = f'<mesh filename="{mesh}"/>' if mesh else f'<cylinder radius="0.03" length="{length}"/>'
    solid = f'<collision><origin xyz="0 0 {length / 2}"/><geometry>{shape}</geometry></collision>'
    limit = '<limit lower="-2.5" upper="2.5" velocity="3" effort="100"/>'
    return f"""<robot name="lying">
    <link name="base">{INERTIAL}</link><link name="upper">{INERTIAL}{solid}</link>
    <link name="lower">{INERTIAL}{solid}</link><link name="tool0{suffix}"/>
    <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.05" rpy="0 1.5707963 0"/><axis xyz="0 1 0"/>{limit}</joint>
    <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0 0 {length}"/><axis xyz="1 0 0"/>{limit}</joint>
    <joint name="tip" type="fixed"><parent link="lower"/><child link="tool0{suffix}"/><origin xyz="0 0 {length}"/></joint>
    </robot>"""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = tmp_path / "arm.urdf"
    path.write_text(arm())
    return path


def test_without_a_robot_the_message_says_what_to_give():
    with pytest.raises(ConfigurationError, match=r"robot='path/to/arm\.urdf'.*'irb120'"):
        gym.make(ID)


def test_a_path_is_a_robot(make, file):
    env = make(ID, robot=str(file), tcp="tool0")
    observation, _ = env.reset(seed=0)
    assert observation.shape == (2 + 12,)
    env.step(env.action_space.sample())


def test_a_xacro_takes_its_arguments(make, tmp_path):
    path = tmp_path / "arm.urdf.xacro"
    macro = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="lying"><xacro:arg name="side" default="_left"/>'
    path.write_text(arm(suffix="$(arg side)").replace('<robot name="lying">', macro))
    env = make(ID, robot=str(path), xacro_args={"side": "_right"}, tcp="tool0_right")
    assert env.unwrapped.robot.tcp == "tool0_right"


def test_an_mjcf_file_is_a_robot(make, tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(
        """<mujoco><worldbody><body name="base"><geom size="0.05"/><body name="upper" pos="0 0 0.1">
        <joint axis="0 1 0" range="-90 90"/><geom type="capsule" size="0.03" fromto="0 0 0 0 0 0.4"/>
        <body name="tool0" pos="0 0 0.4"><joint axis="0 1 0" range="-90 90"/><geom size="0.03"/></body>
        </body></body></worldbody></mujoco>"""
    )
    env = make(ID, 4, robot=str(path), tcp="tool0")
    env.reset(seed=0)
    env.step(np.zeros((4, 3), np.float32))


@pytest.mark.parametrize("scale", [0.1, 1.0, 5.0])
def test_the_goal_box_grows_with_the_arm(make, tmp_path, scale):
    path = tmp_path / "arm.urdf"
    path.write_text(arm(scale))
    task = make(ID, robot=str(path), tcp="tool0").unwrapped.task
    assert (task.goal_high - task.goal_low).max() == pytest.approx(1.4 * scale, rel=0.2)
    assert task.goal_low[2] >= 0.0


def test_a_given_corner_of_the_goal_box_stays(make, file):
    task = make(ID, robot=str(file), tcp="tool0", goal_low=(0.0, -0.1, 0.2)).unwrapped.task
    assert task.goal_low.tolist() == [0.0, -0.1, 0.2]
    assert (task.goal_high > task.goal_low).all()


def test_the_goal_box_ignores_what_is_below_the_floor_and_is_never_flat():
    reached = np.array([[0.0, x, z] for x in np.linspace(-1, 1, 101) for z in (-5.0, 0.5)])
    low, high = box_of(reached)
    assert low.tolist() == [0.0, -0.95, 0.5]
    assert high == pytest.approx([0.01, 0.95, 0.51])


@pytest.mark.parametrize("mesh", ["", "limb.stl"])
def test_an_arm_that_lies_in_the_floor_begins_above_it(make, tmp_path, file, mesh):
    trimesh.creation.cylinder(0.03, 0.4).export(tmp_path / "limb.stl")
    file.write_text(arm(mesh=mesh))
    env = make(ID, 3, robot=str(file), tcp="tool0")
    robot = env.unwrapped.robot
    env.reset(seed=0)
    assert (np.abs(robot.joint_positions - robot.home).max(axis=1) > 0.01).all()
    assert (robot.frame_pose("lower")[0][:, 2] > 0.05).all()
    assert (robot.joint_positions == robot.joint_positions[0]).all()


def test_home_may_be_given_and_is_where_episodes_begin(make, file):
    env = make(ID, robot=str(file), tcp="tool0", home={"shoulder": -1.5}).unwrapped
    env.reset(seed=0)
    assert env.robot.joint_positions[0].tolist() == [-1.5, 0.0]


def test_package_paths_are_given_by_keyword(make, tmp_path, file):
    (tmp_path / "elsewhere").mkdir()
    trimesh.creation.cylinder(0.03, 0.4).export(tmp_path / "elsewhere" / "limb.stl")
    file.write_text(arm(mesh="package://my_arm/limb.stl"))
    with pytest.raises(ModelFileError, match="the ROS package 'my_arm' is not found"):
        gym.make(ID, robot=str(file))
    make(ID, robot=str(file), package_paths={"my_arm": str(tmp_path / "elsewhere")})


def test_a_robot_on_wheels_is_rejected() -> None:
    with pytest.raises(UnsuitableRobotError, match="'kobuki' has a wheeled base"):
        gym.make("frobs/Reach-v0", robot="kobuki", controller="joint_velocity")


LOOSE = """<robot name="loose"><link name="base"/>
<link name="slide"><inertial><mass value="5"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="arm"><inertial><origin xyz="0 0 .3"/><mass value="5"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="lift" type="prismatic"><parent link="base"/><child link="slide"/><origin xyz="0 0 .5"/><axis xyz="0 0 1"/>
  <limit lower="-0.01" upper="0.01" effort="5000" velocity="5"/></joint>
<joint name="turn" type="revolute"><parent link="slide"/><child link="arm"/><axis xyz="1 0 0"/>
  <limit lower="-0.05" upper="0.05" effort="500" velocity="5"/></joint>
<joint name="end" type="fixed"><parent link="arm"/><child link="tool0"/><origin xyz="0 0 .6"/></joint><link name="tool0"/></robot>"""


@pytest.mark.parametrize("simulator", ["mujoco", "pybullet"])
def test_observations_stay_inside_of_their_space_where_joints_go_beyond_their_limits(tmp_path, simulator):
    path = tmp_path / "loose.urdf"
    path.write_text(LOOSE)
    env = gym.make("frobs/Reach-v0", robot=str(path), controller="joint_effort", simulator=simulator).unwrapped
    robot, space = env.robot, env.observation_space
    env.reset(seed=0)
    robot.write_joint_state(robot.position_upper + 0.3)
    term = env.task.observation_terms()["joint_positions"]
    assert (robot.joint_positions > term.high).all()
    assert (term.read() == term.high).all()
    assert np.isinf(space.low[2:5]).all()  # of the tool's position, as its slide has no hard end
    for _ in range(20):
        observation, *_ = env.step(env.action_space.sample())
        assert observation in space
    env.close()
