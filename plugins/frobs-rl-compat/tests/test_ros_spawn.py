from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from frobs_rl_compat.ros import ros_controllers, ros_gazebo, ros_node, ros_spawn, ros_urdf
from frobs_ros.ros import nodes, processes

pytestmark = pytest.mark.usefixtures("world")


@pytest.fixture(autouse=True)
def no_publisher_left() -> Iterator[None]:
    yield
    processes.stop(processes.owned(["state publisher"]))


@pytest.mark.slow
def test_the_state_publisher_tells_frames_below_its_namespace() -> None:
    import rospy

    assert ros_urdf.urdf_load_from_pkg("tiny_arm", "arm.urdf.xacro", "robot_description", ns="/told")
    assert ros_spawn.init_robot_state_pub("/told", max_pub_freq=20) is True
    assert "/told/robot_state_publisher" in nodes.ours()
    assert rospy.get_param("/told/robot_state_publisher/publish_frequency") == 20


def test_the_state_publisher_needs_a_description(reasons: Callable[[], str]) -> None:
    assert ros_spawn.init_robot_state_pub("/nothing_here") is False
    assert "the parameter /nothing_here/robot_description does not exist" in reasons()


def test_the_state_publisher_needs_a_robot_in_it(reasons: Callable[[], str]) -> None:
    import rospy

    rospy.set_param("/torn/robot_description", "<robot><link name='a'>")
    assert ros_spawn.init_robot_state_pub("/torn") is False
    assert "/torn/robot_description" in reasons()
    assert "not well-formed XML" in reasons()
    assert "/torn/robot_state_publisher" not in nodes.names()


@pytest.mark.ros_feature("helper functions of FRobs_RL", "mujoco", "gazebo")
def test_a_robot_comes_with_all_that_belongs_to_it() -> None:
    import rospy
    from sensor_msgs.msg import JointState

    ros_gazebo.gazebo_unpause_physics()
    assert ros_spawn.spawn_model_in_gazebo(
        "tiny_arm",
        "arm.urdf.xacro",
        "controllers.yaml",
        ["joint_state_controller", "arm_controller"],
        ns="/two",
        args_xacro=["length:=0.4"],
        max_pub_freq=30,
        gazebo_name="arm",
        pos_x=1.0,
    )
    assert "0 0 0.4" in rospy.get_param("/two/robot_description")
    assert set(ros_controllers._states("/two").values()) == {"running"}
    state = rospy.wait_for_message("/two/joint_states", JointState, timeout=20.0)
    assert set(state.name) == {"joint_one", "joint_two"}
    assert ros_gazebo.gazebo_get_model_state("arm")[1].position.x == pytest.approx(1.0)
    assert ros_node.ros_kill_node("/two/robot_state_publisher")


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"model_urdf_file": "none.urdf"}, "has no file"),
        ({"controllers_list": ["no_controller"]}, "no_controller/type is missing"),
        ({"controllers_file": "none.yaml"}, "has no file"),
        ({"ori_w": 5.0}, "has the norm 5 "),
    ],
)
def test_a_robot_that_cannot_be_spawned_is_refused_with_a_reason(
    given: dict[str, object], reason: str, reasons: Callable[[], str]
) -> None:
    whole = {"model_urdf_file": "arm.urdf.xacro", "controllers_file": "controllers.yaml", "ns": "/three"} | given
    assert ros_spawn.spawn_model_in_gazebo("tiny_arm", **whole) is False  # type: ignore[arg-type]
    assert reason in reasons()
