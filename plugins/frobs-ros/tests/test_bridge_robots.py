"""Whole robots on the bridge: those of FRobs, those with plugins of Gazebo, and two in one world."""

from __future__ import annotations

import math
import subprocess
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import pytest

from frobs_core.models import load_model
from frobs_core.plugins import get_record


def proxy(name: str, kind: Any) -> Any:
    import rospy

    return rospy.ServiceProxy(name, kind)


def step(steps: int) -> None:
    from frobs_msgs.srv import StepWorld

    assert proxy("/gazebo/step", StepWorld)(steps).success


def until(condition: Callable[[], Any], timeout: float = 30.0) -> None:
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end
        step(10)
        time.sleep(0.02)


class Heard(list[Any]):
    """What a topic says."""

    def __init__(self, topic: str, kind: Any) -> None:
        import rospy

        super().__init__()
        self._listener = rospy.Subscriber(topic, kind, self.append)

    def close(self) -> None:
        self._listener.unregister()


@pytest.fixture
def publish(rosmaster: str) -> Iterator[Callable[[str, Any], None]]:
    import rospy

    made = []

    def send(topic: str, message: Any) -> None:
        made.append(rospy.Publisher(topic, type(message), queue_size=1))
        until(lambda: made[-1].get_num_connections() > 0)
        made[-1].publish(message)
        time.sleep(0.3)

    yield send
    for publisher in made:
        publisher.unregister()


def twist(linear: float, angular: float = 0.0) -> Any:
    from geometry_msgs.msg import Twist, Vector3

    return Twist(linear=Vector3(x=linear), angular=Vector3(z=angular))


@pytest.mark.ros_feature("controller manager", "mujoco", "gazebo")
@pytest.mark.ros_feature("tf and robot_state_publisher", "ros", "mujoco", "gazebo")
def test_robot_of_frobs_stands_with_controllers_and_transforms(simulator: str, bridges: Callable[..., Any]) -> None:
    import rospy
    from controller_manager_msgs.srv import ListControllers
    from gazebo_msgs.srv import GetLinkState, SetModelConfiguration
    from sensor_msgs.msg import JointState
    from std_srvs.srv import Empty
    from tf2_msgs.msg import TFMessage

    from frobs_ros.ros.environment import child_variables

    bridges("--simulator", simulator, "--robot", "irb120", "--namespace", "/left", "--paused")
    told = proxy("/left/controller_manager/list_controllers", ListControllers)().controller
    states = {each.name: each.state for each in told}
    assert states["joint_state_controller"] == states["arm_controller"] == "running"
    assert "<robot" in rospy.get_param("/left/robot_description")
    publisher = subprocess.Popen(
        ["/usr/lib/robot_state_publisher/robot_state_publisher", "__ns:=/left"],
        env=child_variables(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    heard, joints = Heard("/tf", TFMessage), Heard("/left/joint_states", JointState)
    try:
        until(lambda: joints and heard)
        model = load_model(get_record("robot", "irb120").load().model)
        positions = dict(zip(joints[-1].name, joints[-1].position, strict=True))
        assert list(positions) == sorted(model.joint_names)
        link = proxy("/gazebo/get_link_state", GetLinkState)("irb120::link_6", "irb120").link_state
        pos, _ = model.frame_pose("link_6", [[positions[name] for name in model.joint_names]])
        place = link.pose.position
        assert (place.x, place.y, place.z) == pytest.approx(tuple(pos[0]), abs=2e-3)
        step(1000)
        time.sleep(0.3)
        before = max(each.header.stamp.to_sec() for message in heard for each in message.transforms)
        proxy("/gazebo/set_model_configuration", SetModelConfiguration)("irb120", "", ["joint_1"], [0.3])
        proxy("/gazebo/reset_simulation", Empty)()
        time.sleep(0.3)
        heard.clear()
        until(lambda: len(heard) > 3)  # transforms go on although the time went back
        assert heard[-1].transforms[0].header.stamp.to_sec() < before
    finally:
        publisher.kill()
        publisher.wait()
        heard.close()
        joints.close()


@pytest.mark.parametrize("robot", ["irb120", pytest.param("kobuki", marks=pytest.mark.slow)])
@pytest.mark.ros_feature("tf and robot_state_publisher", "mujoco", "gazebo")
def test_frames_of_a_served_robot_are_where_its_links_are(
    robot: str, simulator: str, bridges: Callable[..., Any], publish: Callable[[str, Any], None]
) -> None:
    import rospy
    import tf2_ros
    from gazebo_msgs.srv import GetLinkState
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    bridges("--simulator", simulator, "--robot", robot, "--paused")
    model = load_model(get_record("robot", robot).load().model)
    buffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer)
    try:
        if robot == "irb120":
            point = JointTrajectoryPoint(positions=[0.4, 0.3, -0.2, 0.5, 0.6, 0.7], time_from_start=rospy.Duration(1))
            names = list(model.joint_names)
            publish("/arm_controller/command", JointTrajectory(joint_names=names, points=[point]))
        else:
            publish("/cmd_vel", twist(0.2, 0.5))
        step(1500)
        links = [link.name for link in model.links if link.name != model.root]
        until(lambda: all(buffer.can_transform(model.root, link, rospy.Time()) for link in links))
        time.sleep(0.3)  # the newest frames have arrived
        for link in links:
            found = buffer.lookup_transform(model.root, link, rospy.Time()).transform
            state = proxy("/gazebo/get_link_state", GetLinkState)(
                f"{robot}::{link}", f"{robot}::{model.root}"
            ).link_state
            for axis in "xyz":
                assert getattr(found.translation, axis) == pytest.approx(getattr(state.pose.position, axis), abs=5e-3)
            turns = [(getattr(found.rotation, i), getattr(state.pose.orientation, i)) for i in "xyzw"]
            assert abs(sum(a * b for a, b in turns)) == pytest.approx(1.0, abs=2e-3), link
    finally:
        listener.unregister()


@pytest.mark.slow
@pytest.mark.ros_feature("laser scans", "mujoco", "gazebo")
@pytest.mark.ros_feature("odometry", "mujoco", "gazebo")
@pytest.mark.ros_feature("differential drives", "mujoco", "gazebo")
def test_robot_on_wheels_drives_and_scans(
    simulator: str, bridges: Callable[..., Any], publish: Callable[[str, Any], None]
) -> None:
    from gazebo_msgs.srv import GetModelState, SpawnModel
    from geometry_msgs.msg import Pose
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import LaserScan

    bridges("--simulator", simulator, "--robot", "kobuki", "--paused")
    wall = (
        '<sdf version="1.6"><model name="wall"><static>true</static><link name="l"><collision name="c"><geometry><box>'
        "<size>0.2 8 1</size></box></geometry></collision></link></model></sdf>"
    )
    place = Pose()
    place.position.x, place.position.z = 3.0, 0.5
    assert proxy("/gazebo/spawn_sdf_model", SpawnModel)("wall", wall, "", place, "").success
    odom, scans = Heard("/odom", Odometry), Heard("/scan", LaserScan)
    until(lambda: odom and scans)
    scan = scans[-1]
    ahead = min(range(len(scan.ranges)), key=lambda n: abs(scan.angle_min + n * scan.angle_increment))
    assert scan.ranges[ahead] == pytest.approx(2.9, abs=0.05)
    assert math.isinf(scan.ranges[0])
    publish("/cmd_vel", twist(0.3))
    step(3000)
    state = proxy("/gazebo/get_model_state", GetModelState)("kobuki", "")
    assert state.pose.position.x == pytest.approx(0.9, abs=0.12)
    until(
        lambda: odom[-1].pose.pose.position.x == pytest.approx(state.pose.position.x, abs=0.1)
    )  # the last one arrives
    assert odom[-1].twist.twist.linear.x > 0.25
    odom.close()
    scans.close()


ROVER = """<robot name="rover"><link name="base_link"><inertial><mass value="5"/><inertia ixx=".05" iyy=".05" izz=".05" ixy="0" ixz="0" iyz="0"/></inertial></link>
{wheels}
<link name="caster"><inertial><mass value=".1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry><sphere radius=".05"/></geometry></collision></link>
<joint name="c" type="fixed"><origin xyz="-.15 0 -.05"/><parent link="base_link"/><child link="caster"/></joint>
<gazebo reference="caster"><mu1>0</mu1></gazebo>{extra}</robot>"""
WHEEL = """<link name="{side}"><inertial><mass value=".3"/><inertia ixx="5e-4" iyy="9e-4" izz="5e-4" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius=".1" length=".03"/></geometry></collision></link>
<joint name="{side}_joint" type="continuous"><origin xyz="0 {y} 0"/><axis xyz="0 1 0"/><parent link="base_link"/><child link="{side}"/></joint>"""
WHEELS = WHEEL.format(side="left", y=0.2) + WHEEL.format(side="right", y=-0.2)
PLUGINS = """<gazebo><plugin name="d" filename="libgazebo_ros_diff_drive.so"><leftJoint>left_joint</leftJoint><rightJoint>right_joint</rightJoint>
<wheelSeparation>0.4</wheelSeparation><wheelDiameter>0.2</wheelDiameter><wheelAcceleration>2.0</wheelAcceleration><odometrySource>encoder</odometrySource>
<commandTopic>go</commandTopic></plugin><plugin name="odd" filename="libgazebo_ros_unheard_of.so"/></gazebo>
<gazebo reference="base_link"><sensor type="ray" name="laser"><update_rate>20</update_rate><ray><scan><horizontal><samples>5</samples><min_angle>-1</min_angle>
<max_angle>1</max_angle></horizontal></scan><range><min>0.05</min><max>4</max></range></ray><plugin name="l" filename="libgazebo_ros_laser.so">
<topicName>beams</topicName><frameName>base_link</frameName></plugin></sensor></gazebo>"""


def spawn(name: str, xml: str, namespace: str, y: float = 0.0) -> Any:
    from gazebo_msgs.srv import SpawnModel
    from geometry_msgs.msg import Pose

    place = Pose()
    place.position.y, place.position.z, place.orientation.w = y, 0.1, 1.0
    return proxy("/gazebo/spawn_urdf_model", SpawnModel)(name, xml, namespace, place, "world")


@pytest.mark.slow
@pytest.mark.ros_feature("Gazebo plugins in a URDF", "mujoco", "gazebo")
@pytest.mark.ros_feature("laser scans", "mujoco", "gazebo")
@pytest.mark.ros_feature("odometry", "mujoco", "gazebo")
@pytest.mark.ros_feature("plugins of Gazebo that the bridge does not know", "mujoco", "gazebo", works=False)
def test_plugins_of_gazebo_are_honoured_or_named(
    simulator: str, bridges: Callable[..., Any], publish: Callable[[str, Any], None]
) -> None:
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import LaserScan

    bridge = bridges("--simulator", simulator, "--paused")
    assert spawn("rover", ROVER.format(wheels=WHEELS, extra=PLUGINS), "/rover").success
    odom, scans = Heard("/rover/odom", Odometry), Heard("/rover/beams", LaserScan)
    until(lambda: odom and scans)
    assert scans[-1].header.frame_id == "base_link"
    assert [math.isinf(reading) for reading in scans[-1].ranges] == [True] * 5
    publish("/rover/go", twist(0.4, 0.5))
    step(2000)
    until(lambda: odom[-1].twist.twist.linear.x == pytest.approx(0.4, abs=0.05))
    assert odom[-1].twist.twist.angular.z == pytest.approx(0.5, abs=0.1)
    assert "libgazebo_ros_unheard_of.so" in bridge.log.read_text()
    odom.close()
    scans.close()


@pytest.mark.slow
@pytest.mark.ros_feature("differential drives", "mujoco", "gazebo")
@pytest.mark.ros_feature("odometry", "mujoco", "gazebo")
def test_two_robots_live_in_their_namespaces(
    simulator: str, bridges: Callable[..., Any], publish: Callable[[str, Any], None]
) -> None:
    import rospy
    from controller_manager_msgs.srv import LoadController, SwitchController
    from gazebo_msgs.srv import DeleteModel, GetModelState
    from nav_msgs.msg import Odometry

    bridges("--simulator", simulator, "--paused")
    drives = "".join(
        f'<transmission name="{side}"><joint name="{side}_joint"><hardwareInterface>hardware_interface/'
        "VelocityJointInterface</hardwareInterface></joint></transmission>"
        for side in ("left", "right")
    )
    control = '<gazebo><plugin name="c" filename="libgazebo_ros_control.so"/></gazebo>'
    xml = ROVER.format(wheels=WHEELS, extra=drives + control)
    parameters = {
        "type": "diff_drive_controller/DiffDriveController",
        "left_wheel": "left_joint",
        "right_wheel": "right_joint",
        "wheel_separation": 0.4,
        "wheel_radius": 0.1,
        "cmd_vel_timeout": 100.0,
    }
    for name, y in (("one", 0.0), ("two", 2.0)):
        assert spawn(name, xml, f"/{name}", y).success
        rospy.set_param(f"/{name}/base", parameters)
        assert proxy(f"/{name}/controller_manager/load_controller", LoadController)("base").ok
        switch = proxy(f"/{name}/controller_manager/switch_controller", SwitchController)
        assert switch(["base"], [], 2, False, 3.0).ok
    odom = Heard("/two/base/odom", Odometry)
    publish("/one/base/cmd_vel", twist(0.3))
    publish("/two/base/cmd_vel", twist(-0.3))
    step(1500)
    state = proxy("/gazebo/get_model_state", GetModelState)
    first, second = (state(name, "world").pose.position for name in ("one", "two"))
    assert first.x > 0.25
    assert second.x < -0.25
    until(lambda: odom and odom[-1].pose.pose.position.x == pytest.approx(second.x, abs=0.1))  # the last one arrives
    assert proxy("/gazebo/delete_model", DeleteModel)("one").success
    before = state("two", "world").pose.position.x
    step(500)  # the other goes on
    assert state("two", "world").pose.position.x < before - 0.1
    odom.close()


@pytest.mark.ros_feature("the clock", "mujoco", "gazebo")
def test_clock_without_a_rate_is_published_after_every_physics_step(
    simulator: str, bridges: Callable[..., Any]
) -> None:
    import rospy
    from rosgraph_msgs.msg import Clock
    from std_srvs.srv import Empty

    bridges("--simulator", simulator, "--clock-frequency", "0", "--paused")
    heard: list[int] = []
    listener = rospy.Subscriber("/clock", Clock, lambda message: heard.append(message.clock.to_nsec()))
    rospy.ServiceProxy("/gazebo/unpause_physics", Empty)()
    end = time.monotonic() + 20.0
    while len(heard) < 50 and time.monotonic() < end:
        time.sleep(0.01)
    listener.unregister()
    assert 1_000_000 in {b - a for a, b in pairwise(heard)}  # a slow subscriber may miss messages
