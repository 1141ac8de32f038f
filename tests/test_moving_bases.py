"""Robots from files whose base moves: where they start, and how they drive."""

from __future__ import annotations

from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.util.errors import MissingSettingError, ParameterValueError, UnknownNameError, UnknownParameterError

SIMULATORS = ("mujoco", "pybullet")
WALKER = """<robot name="walker"><link name="trunk">
  <inertial><mass value="4"/><inertia ixx=".05" iyy=".05" izz=".05" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><box size=".4 .2 .1"/></geometry></collision></link>{legs}</robot>"""
LEG = """<link name="leg{i}"><inertial><origin xyz="0 0 -.2"/><mass value=".5"/>
    <inertia ixx=".005" iyy=".005" izz=".001" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><origin xyz="0 0 -.2"/><geometry><box size=".04 .04 .4"/></geometry></collision></link>
  <joint name="hip{i}" type="revolute"><parent link="trunk"/><child link="leg{i}"/><origin xyz="{x} {y} 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="50" velocity="5"/></joint>"""
CORNERS = [(x, y) for x in (-0.15, 0.15) for y in (-0.1, 0.1)]
ROVER = """<robot name="rover"><link name="base">
  <inertial><origin xyz="-.02 0 .06"/><mass value="3"/><inertia ixx=".03" iyy=".03" izz=".04" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><origin xyz="-.03 0 .07"/><geometry><box size=".2 .2 .05"/></geometry></collision></link>
  <link name="caster"><inertial><mass value=".1"/><inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><sphere radius=".02"/></geometry></collision></link>
  <joint name="to_caster" type="fixed"><parent link="base"/><child link="caster"/><origin xyz="-.1 0 .02"/></joint>{wheels}</robot>"""
WHEEL = """<link name="{s}"><inertial><mass value=".2"/><inertia ixx="2e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius=".04" length=".02"/></geometry></collision></link>
  <joint name="{s}_joint" type="continuous"><parent link="base"/><child link="{s}"/><origin xyz="0 {y} .04"/>
    <axis xyz="0 1 0"/><limit effort="5" velocity="30"/></joint>"""
DRIVE = {
    "left": ["left_joint"],
    "right": "right_joint",
    "separation": 0.26,
    "wheel_radius": 0.04,
    "max_linear_velocity": 0.4,
    "max_angular_velocity": 2.0,
}


@pytest.fixture
def walker(tmp_path: Path) -> str:
    path = tmp_path / "walker.urdf"
    path.write_text(WALKER.format(legs="".join(LEG.format(i=i, x=x, y=y) for i, (x, y) in enumerate(CORNERS))))
    return str(path)


@pytest.fixture
def rover(tmp_path: Path) -> str:
    path = tmp_path / "rover.urdf"
    path.write_text(ROVER.format(wheels=WHEEL.format(s="left", y=0.13) + WHEEL.format(s="right", y=-0.13)))
    return str(path)


def make(robot: str, **keywords: object) -> gym.Env:
    return gym.make("frobs/Reach-v0", robot=robot, disable_env_checker=True, **keywords)


@pytest.mark.parametrize("simulator", SIMULATORS)
def test_a_floating_robot_starts_with_its_lowest_point_on_the_floor(walker, simulator):
    env = make(walker, base="floating", controller="joint_delta_position", simulator=simulator)
    robot = env.unwrapped.robot
    assert robot.robot.base == "floating"
    assert robot.base_pose[0][0, 2] == pytest.approx(0.4, abs=1e-9)
    env.unwrapped.simulation.step(250)
    assert robot.base_pose[0][0, 2] == pytest.approx(0.4, abs=0.03)
    env.close()


@pytest.mark.parametrize("simulator", SIMULATORS)
def test_a_floating_mjcf_robot_keeps_the_orientation_of_its_root(tmp_path, simulator):
    path = tmp_path / "lying.xml"
    path.write_text(
        '<mujoco><worldbody><body name="torso" pos="0 0 9" euler="0 90 0"><freejoint/><geom type="capsule" size=".1 .5"/>'
        '<body name="arm" pos="0 0 .5"><joint name="elbow" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 .3" size=".05"/>'
        "</body></body></worldbody></mujoco>"
    )
    env = make(str(path), base="floating", controller="joint_delta_position", simulator=simulator)
    pos, quat = env.unwrapped.robot.base_pose
    assert pos[0] == pytest.approx([0.0, 0.0, 0.1], abs=1e-9)
    assert quat[0] == pytest.approx([0.5**0.5, 0.0, 0.5**0.5, 0.0], abs=1e-9)
    env.close()


def test_the_humanoid_of_gymnasium_stays_where_it_stands():
    path = Path(gym.__file__).parent / "envs" / "mujoco" / "assets" / "humanoid.xml"
    env = make(str(path), base="floating", controller="joint_delta_position")
    robot = env.unwrapped.robot
    start = robot.base_pose[0][0, 2]
    assert start == pytest.approx(0.98, abs=0.05)  # with bent knees, as 0 is outside of their range
    heights = []
    for _ in range(50):
        env.unwrapped.simulation.step(5)
        heights.append(robot.base_pose[0][0, 2])
    assert max(heights) < start + 0.05
    env.close()


def test_a_pose_that_is_given_is_kept(walker):
    env = gym.make(
        "frobs/Reach-v0",
        robots={
            "robot": {
                "robot": walker,
                "base": "floating",
                "pose": {"pos": [1.0, 0.0, 2.0]},
                "controller": "joint_position",
            }
        },
        disable_env_checker=True,
    )
    assert env.unwrapped.robot.base_pose[0][0] == pytest.approx([1.0, 0.0, 2.0])
    env.close()


@pytest.mark.parametrize("simulator", SIMULATORS)
def test_a_differential_drive_can_be_stated_and_its_casters_glide(rover, simulator):
    env = gym.make(
        "frobs/Navigate-v0",
        robot=rover,
        controller="differential_drive",
        differential_drive=DRIVE,
        observation=["distance", "bearing"],
        sensors={"bumper": {"type": "bumper", "frame": "base"}},
        simulator=simulator,
        disable_env_checker=True,
    )
    robot = env.unwrapped.robot
    assert robot.robot.base == "wheeled"
    assert robot.robot.friction == {"caster": 0.0}
    env.reset(seed=0)
    start, steps = robot.base_pose[0][0].copy(), 20
    for _ in range(steps):
        env.unwrapped.step(np.array([1.0, 0.0], np.float32))
    moved = np.linalg.norm(robot.base_pose[0][0, :2] - start[:2])
    assert moved == pytest.approx(0.4 * steps * env.unwrapped.control_timestep, rel=0.2)
    upward = 1.0 - 2.0 * (robot.base_pose[1][0, 1:3] ** 2).sum()
    assert upward > 0.99
    env.close()


def test_wheels_and_bases_can_be_stated_on_the_command_line(rover):
    from frobs_train.configuration.resolve import resolve_config

    prefix = "environment_kwargs.differential_drive"
    settings = [f"{prefix}.{key}={value}" for key, value in {**DRIVE, "left": "[left_joint]"}.items()]
    flags = {"robot": rover, "base": "wheeled", "controller": "differential_drive"}
    config = resolve_config("frobs/Navigate-v0", flags=flags, settings=settings)
    assert config.environment_kwargs["differential_drive"] == DRIVE
    assert config.environment_kwargs["base"] == "wheeled"


def test_a_base_and_wheels_that_cannot_be_are_errors(walker, rover):
    with pytest.raises(ParameterValueError, match="base"):
        make(walker, base="flying", controller="joint_position")
    with pytest.raises(UnknownParameterError, match="differential_drive"):
        make(rover, differential_drive={"wheels": 4}, controller="joint_position")
    for side in (5, [], [5], {"a": 1}):
        with pytest.raises(ParameterValueError, match=r"differential_drive\.left"):
            make(rover, differential_drive={**DRIVE, "left": side}, controller="joint_position")
    with pytest.raises(UnknownNameError, match="left_joint"):
        make(rover, differential_drive={**DRIVE, "left": "left_joind"}, controller="joint_position")
    with pytest.raises(MissingSettingError, match="differential_drive needs separation, wheel_radius"):
        make(rover, differential_drive={"left": "left_joint", "right": "right_joint"}, controller="joint_position")
