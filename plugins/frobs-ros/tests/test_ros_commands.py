"""Which controllers a policy's commands may go to, of a real controller manager on the bridge."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

import gymnasium as gym
import pytest

from frobs_core.contracts import RobotHandle
from frobs_core.util.errors import ConfigurationError
from frobs_ros.robot.commands import Commands

DRIVE = {
    "type": "diff_drive_controller/DiffDriveController",
    "left_wheel": "wheel_left_joint",
    "right_wheel": "wheel_right_joint",
    "wheel_separation": 0.23,
    "wheel_radius": 0.035,
}
MANAGED = "/managed"
WHEELS = """<robot name="wheels"><link name="base_link"><inertial><mass value="5"/>
<inertia ixx=".05" iyy=".05" izz=".05" ixy="0" ixz="0" iyz="0"/></inertial></link>{}
<gazebo><plugin name="c" filename="libgazebo_ros_control.so"/></gazebo></robot>"""
WHEEL = """<link name="{side}"><inertial><mass value=".3"/><inertia ixx="5e-4" iyy="9e-4" izz="5e-4" ixy="0" ixz="0" iyz="0"/>
</inertial></link><joint name="wheel_{side}_joint" type="continuous"><origin xyz="0 {y} 0"/><axis xyz="0 1 0"/>
<parent link="base_link"/><child link="{side}"/></joint><transmission name="{side}"><joint name="wheel_{side}_joint">
<hardwareInterface>hardware_interface/VelocityJointInterface</hardwareInterface></joint></transmission>"""


@pytest.fixture(scope="module")
def arm(bridges: Callable[..., Any]) -> None:
    """The bridge with the arm, whose trajectory controller runs and whose group controller is loaded."""
    bridges("--robot", "irb120", "--paused")


@pytest.fixture(scope="module")
def reach() -> Iterator[RobotHandle]:
    with contextlib.closing(gym.make("frobs_core:frobs/Irb120Reach-v0", disable_env_checker=True)) as env:
        yield env.unwrapped.robot  # type: ignore[attr-defined]


@pytest.fixture(scope="module")
def maze() -> Iterator[RobotHandle]:
    with contextlib.closing(gym.make("frobs_core:frobs/KobukiMaze-v0", disable_env_checker=True)) as env:
        yield env.unwrapped.robot  # type: ignore[attr-defined]


def commands(robot: RobotHandle, controller: str, namespace: str = "") -> Commands:
    return Commands(robot, namespace, controller, "cmd_vel")


def test_a_controller_that_runs_is_taken(arm: None, reach: RobotHandle) -> None:
    commands(reach, "arm_controller").hold(0.1)


def test_a_controller_that_is_not_loaded_or_does_not_run_is_refused(arm: None, reach: RobotHandle) -> None:
    with pytest.raises(
        ConfigurationError,
        match=r"controller 'leg': the controller is not loaded in the namespace /; "
        r"loaded controllers: arm_controller, ",
    ):
        commands(reach, "leg")
    with pytest.raises(
        ConfigurationError,
        match=r"'joint_group_position_controller': the controller is .*; running controllers: arm_controller, ",
    ):
        commands(reach, "joint_group_position_controller")


def test_a_drive_that_does_not_run_is_refused_as_others_are(arm: None, maze: RobotHandle) -> None:
    import rospy
    from controller_manager_msgs.srv import LoadController, SwitchController
    from gazebo_msgs.srv import SpawnModel
    from geometry_msgs.msg import Pose

    from frobs_ros.ros.services import call

    rospy.set_param(f"{MANAGED}/drive", DRIVE)
    place = Pose()
    place.position.y, place.position.z, place.orientation.w = 3.0, 1.0, 1.0
    xml = WHEELS.format("".join(WHEEL.format(side=side, y=y) for side, y in (("left", 0.115), ("right", -0.115))))
    assert call("/gazebo/spawn_urdf_model", SpawnModel, "wheels", xml, MANAGED, place, "world").success
    with pytest.raises(
        ConfigurationError, match=r"'drive': the controller is not loaded; running controllers: \(none\)"
    ):
        commands(maze, "drive", MANAGED)
    assert call(f"{MANAGED}/controller_manager/load_controller", LoadController, "drive").ok
    with pytest.raises(ConfigurationError, match="'drive': the controller is initialized; running controllers"):
        commands(maze, "drive", MANAGED)
    switched = call(f"{MANAGED}/controller_manager/switch_controller", SwitchController, ["drive"], [], 2, False, 3.0)
    assert switched.ok
    commands(maze, "drive", MANAGED)
    assert f"{MANAGED}/drive/cmd_vel" in [name for name, _ in rospy.get_published_topics(MANAGED)]


def test_where_nobody_manages_controllers_a_drive_is_trusted(arm: None, maze: RobotHandle) -> None:
    import rospy

    rospy.set_param("/unmanaged/drive", DRIVE)
    commands(maze, "drive", "/unmanaged")
