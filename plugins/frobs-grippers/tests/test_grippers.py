from __future__ import annotations

import numpy as np
import pytest

from frobs_core import plugins
from frobs_core.description import ForceTorque, Robot
from frobs_core.kernel.robot_config import RobotConfig
from frobs_core.models import Box, RobotModel, load_model
from frobs_core.util.errors import UnknownNameError
from frobs_devkit.doctor.robot import examine_robot
from frobs_grippers.plugin import frobs_robots

ARMS = ["irb120", "irb140", "ur5", "panda_arm"]
FINGERED = {"two_finger_hand": (0.04, 0.73, 70.0, 0.05), "parallel_gripper": (0.0425, 0.9, 100.0, 0.075)}
"""Stroke of a finger [m], mass [kg], force of a finger [N] and its speed [m/s]."""


def tool(name: str) -> Robot:
    found: Robot = plugins.get_record("robot", name).load()
    return found


def model_of(robot: Robot, **xacro_args: str) -> RobotModel:
    return load_model(robot.model, xacro_args=xacro_args)


def test_the_records_lead_to_the_tools() -> None:
    assert [record.load().name for record in frobs_robots()] == [record.name for record in frobs_robots()]


@pytest.mark.parametrize("name", FINGERED)
def test_stroke_mass_force_and_speed_are_the_makers(name: str) -> None:
    stroke, mass, force, speed = FINGERED[name]
    model = model_of(tool(name))
    (joint,) = model.actuated_joints
    assert (joint.limits.lower, joint.limits.upper) == (0.0, stroke)
    assert joint.limits.effort == 2 * force  # shared by both fingers
    assert joint.limits.velocity == speed
    assert sum(link.inertial.mass for link in model.links if link.inertial) == pytest.approx(mass)
    assert tool(name).end_effectors["fingers"].open == {"finger_joint": stroke}
    assert tool(name).end_effectors["fingers"].closed == {"finger_joint": 0.0}


@pytest.mark.parametrize("name", FINGERED)
def test_the_force_is_an_argument(name: str) -> None:
    (joint,) = model_of(tool(name), force="25").actuated_joints
    assert joint.limits.effort == 50.0


@pytest.mark.parametrize("name", FINGERED)
def test_pads_are_boxes_that_meet_around_the_tool_center_point(name: str) -> None:
    model = model_of(tool(name))
    tcp = model.frame_pose("tcp", np.zeros((1, 1)))[0][0]
    for side, link in ((1, "left_finger"), (-1, "right_finger")):
        (collision,) = next(each for each in model.links if each.name == link).collisions
        assert isinstance(collision.geometry, Box)
        origin = model.frame_pose(link, np.zeros((1, 1)))[0][0]
        center, half = origin + collision.origin.pos, np.array(collision.geometry.size) / 2
        assert side * center[1] - half[1] == pytest.approx(0.0, abs=1e-12)  # the faces touch when closed
        assert center[2] - half[2] < tcp[2] - 0.005 < tcp[2] + 0.005 < center[2] + half[2]
        opened = model.frame_pose(link, np.array([[0.03]]))[0][0]
        np.testing.assert_allclose(opened - origin, [0.0, side * 0.03, 0.0], atol=1e-12)


@pytest.mark.parametrize("name", ["two_finger_hand", "parallel_gripper"])
def test_the_doctor_finds_nothing(name: str) -> None:
    assert examine_robot(name, simulators=("mujoco", "pybullet")).findings == ()


def test_a_suction_cup_has_no_joints_and_feels_what_hangs_on_it() -> None:
    assert model_of(tool("suction_cup")).joint_names == ()
    assert tool("suction_cup").sensors["wrench"] == ForceTorque(frame="cup")


@pytest.mark.parametrize("simulator", ["mujoco", "pybullet"])
@pytest.mark.parametrize("name", [record.name for record in frobs_robots()])
@pytest.mark.parametrize("arm", ARMS)
def test_every_tool_attaches_to_every_arm(arm: str, name: str, simulator: str) -> None:
    robot = RobotConfig(robot=f"{arm}+{name}").describe()
    report = examine_robot(model_of(robot).path, simulators=[simulator])
    assert report.simulators[0].builds
    arm_alone, tool_alone = tool(arm), tool(name)
    masses = [
        sum(i.inertial.mass for i in model_of(each).links if i.inertial) for each in (arm_alone, tool_alone, robot)
    ]
    assert masses[0] + masses[1] == pytest.approx(masses[2])
    assert robot.tcp == "gripper_tcp"
    fingers = () if name == "suction_cup" else ("gripper_finger_joint",)
    assert robot.groups == {"arm": model_of(arm_alone).joint_names, **({"gripper": fingers} if fingers else {})}


def test_the_pose_of_a_tool_may_consist_of_numbers_of_numpy() -> None:
    turned = tool("irb120").attach("tool0", tool("suction_cup"), pos=tuple(np.array([0.0, 0.0, 0.02])))
    (mount,) = [joint for joint in turned.read_model().joints if joint.name == "gripper_mount"]
    assert mount.origin.pos == (0.0, 0.0, 0.02)


def test_a_tool_that_does_not_exist_is_named() -> None:
    with pytest.raises(UnknownNameError, match=r"paralel_gripper.*parallel_gripper"):
        RobotConfig(robot="irb120+paralel_gripper").describe()


def test_the_path_of_a_model_file_may_be_the_arm() -> None:
    path = model_of(tool("irb120")).path
    assert RobotConfig(robot=f"{path}+suction_cup").describe().tcp == "gripper_tcp"
