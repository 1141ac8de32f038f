"""``frobs ros2 serve``, used by nodes that are written with rclpy alone."""

import time

import pytest
from ros2_processes import Start

pytestmark = pytest.mark.needs("ros2")


def test_plain_node_moves_the_arm_resets_it_and_sets_a_parameter(ros2: Start) -> None:
    server = ros2("frobs", "ros2", "serve", "frobs/Irb120Reach-v0", "--param", "seed:=3")
    server.wait_for("serving")
    result = ros2("node", "arm.py", "frobs_server").result()
    assert result["names"] == [f"joint_{i}" for i in range(1, 7)]
    assert result["description"]
    assert result["moved_by_bad_commands"] < 0.02
    assert result["reached"]
    assert result["error"] < 1e-3
    assert result["reset"]
    assert result["home"]
    assert result["clock_continues"]
    assert result["parameter"]
    assert result["paused"]
    errors = "".join(server.errors)
    assert "point 0 moves joint 'joint_1' to 99" in errors
    assert "6 finite ones" in errors


def test_server_holds_when_the_commanding_node_is_killed(ros2: Start) -> None:
    server = ros2("frobs", "ros2", "serve", "frobs/Irb120Reach-v0")
    server.wait_for("serving")
    watch, drive = ros2("node", "watch.py"), ros2("node", "drive.py")
    assert watch.line() == "moving"
    time.sleep(0.5)
    drive.process.kill()
    server.wait_for("holding: no command for 0.2 s")
    result = watch.result()
    assert result["drift"] < 0.01


def test_mobile_robot_drives_and_reports_odometry_and_scans(ros2: Start) -> None:
    server = ros2("frobs", "ros2", "serve", "frobs/KobukiEmpty-v0", "--namespace", "kobuki")
    server.wait_for("serving")
    result = ros2("node", "wheels.py").result()
    assert result["moved"] > 0.1
    assert 0.1 < result["speed"] < 0.25
    assert result["rays"] > 1
    assert result["in_range"]
    assert result["frames"][0] == "odom"


@pytest.mark.needs("ros2-control")
def test_actions_and_frames_work_if_their_types_are_installed(ros2: Start) -> None:
    ros2("frobs", "ros2", "serve", "frobs/Ur5PickAndPlace-v0").wait_for("serving")
    result = ros2("node", "control_types.py", 0.02).result()
    assert result["error_code"] == 0
    assert result["error"] < 0.01
    assert result["reached"]
    assert "gripper_tcp" in result["frames"]["/tf_static"]
    assert "wrist_3_link" in result["frames"]["/tf"]


@pytest.mark.needs("ros2-dds")
def test_dds_of_another_vendor_decodes_the_joint_states(ros2: Start) -> None:
    server = ros2("frobs", "ros2", "serve", "frobs/Irb120Reach-v0", "--lockstep")  # publishes the same state again
    server.wait_for("serving")
    theirs, ours = ros2("node", "dds_joints.py"), ros2("node", "ros_joints.py")
    assert theirs.result() == ours.result()
