"""The controller manager and its controllers, as clients of ros_control use them."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

TRANSMISSION = (
    '<transmission name="t{joint}"><type>transmission_interface/SimpleTransmission</type><joint name="{joint}">'
    "<hardwareInterface>hardware_interface/{kind}JointInterface</hardwareInterface></joint></transmission>"
)
LINK = (
    '<link name="{name}"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>'
    '<inertia ixx=".02" iyy=".02" izz=".02" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
JOINTS = ("b_joint", "a_joint")


def arm(kinds: tuple[str, str], plugin: str = "") -> str:
    """Two joints that turn in the plane, so that gravity does not pull at them."""
    links = "".join(LINK.format(name=name) for name in ("upper", "lower"))
    joint = (
        '<joint name="{name}" type="revolute"><origin xyz="{x} 0 0"/><axis xyz="0 0 1"/><parent link="{parent}"/>'
        '<child link="{child}"/><limit lower="-2" upper="2" effort="50" velocity="5"/></joint>'
    )
    joints = joint.format(name="b_joint", x=0, parent="world", child="upper")
    joints += joint.format(name="a_joint", x=0.4, parent="upper", child="lower")
    drives = "".join(TRANSMISSION.format(joint=name, kind=kind) for name, kind in zip(JOINTS, kinds, strict=True))
    return (
        f'<robot name="arm"><link name="world"/>{links}{joints}{drives}<gazebo><plugin name="control" '
        f'filename="libgazebo_ros_control.so">{plugin}</plugin></gazebo></robot>'
    )


class Arm:
    """A robot in a namespace, and its controller manager."""

    def __init__(self, namespace: str) -> None:
        import rospy
        from sensor_msgs.msg import JointState

        self._rospy, self.namespace, self.states = rospy, namespace, []
        self._listener = rospy.Subscriber(f"{namespace}/joint_states", JointState, self.states.append)

    def __getattr__(self, name: str) -> Callable[..., Any]:
        from controller_manager_msgs import srv

        kind = getattr(srv, "".join(word.title() for word in name.split("_")))
        return self._rospy.ServiceProxy(f"{self.namespace}/controller_manager/{name}", kind)

    def spawn(self, name: str, xml: str, y: float = 0.0) -> Any:
        from gazebo_msgs.srv import SpawnModel
        from geometry_msgs.msg import Pose

        pose = Pose()
        pose.position.y, pose.position.z, pose.orientation.w = y, 1.0, 1.0
        proxy = self._rospy.ServiceProxy("/gazebo/spawn_urdf_model", SpawnModel)
        return proxy(name, xml, self.namespace, pose, "world")

    def load(self, name: str, kind: str, **parameters: Any) -> bool:
        self._rospy.set_param(f"{self.namespace}/{name}", {"type": kind, **parameters})
        return bool(self.load_controller(name).ok)

    def start(self, *names: str, stop: tuple[str, ...] = (), strictness: int = 2) -> bool:
        return bool(self.switch_controller(list(names), list(stop), strictness, False, 3.0).ok)

    def step(self, steps: int) -> None:
        from frobs_msgs.srv import StepWorld

        assert self._rospy.ServiceProxy("/gazebo/step", StepWorld)(steps).success

    def rate_and_position(self, joint: str) -> tuple[float, float]:
        from gazebo_msgs.srv import GetJointProperties

        told = self._rospy.ServiceProxy("/gazebo/get_joint_properties", GetJointProperties)(joint)
        return told.rate[0], told.position[0]

    def send(self, topic: str, message: Any) -> None:
        """Publish once, when the controller listens; and leave it the time to arrive."""
        publisher = self._rospy.Publisher(f"{self.namespace}/{topic}", type(message), queue_size=1)
        until(lambda: publisher.get_num_connections() == 1)
        publisher.publish(message)
        time.sleep(0.3)
        publisher.unregister()

    def delete(self, name: str) -> None:
        from gazebo_msgs.srv import DeleteModel

        assert self._rospy.ServiceProxy("/gazebo/delete_model", DeleteModel)(name).success
        self._listener.unregister()


def until(condition: Callable[[], bool], timeout: float = 60.0) -> None:
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.fixture(scope="module")
def server(simulator: str, bridges: Callable[..., Any]) -> Any:
    return bridges("--simulator", simulator, "--paused")


@pytest.fixture(params=["Position"])
def robot(request: pytest.FixtureRequest, server: Any) -> Iterator[Arm]:
    made = Arm("/two")
    kinds = request.param if isinstance(request.param, tuple) else (request.param, request.param)
    assert made.spawn("two", arm(kinds)).success
    yield made
    made.delete("two")
    import rospy

    rospy.delete_param("/two")


@pytest.mark.ros_feature("controller manager", "mujoco", "gazebo")
def test_controllers_go_through_their_life(robot: Arm) -> None:
    import rospy

    rospy.set_param("/two/x", {"type": "none/Such"})
    assert not robot.load_controller("x").ok
    assert not robot.load_controller("nobody").ok
    assert robot.load("states", "joint_state_controller/JointStateController", publish_rate=100)
    assert not robot.load_controller("states").ok
    assert [(each.name, each.state) for each in robot.list_controllers().controller] == [("states", "initialized")]
    assert robot.start("states")
    assert robot.list_controllers().controller[0].state == "running"
    assert not robot.unload_controller("states").ok
    assert robot.start(stop=("states",))
    assert robot.list_controllers().controller[0].state == "stopped"
    assert robot.unload_controller("states").ok
    assert robot.list_controllers().controller == []


@pytest.mark.ros_feature("controller manager", "mujoco", "gazebo")
def test_strictness_decides_about_what_cannot_be_switched(robot: Arm) -> None:
    robot.load("states", "joint_state_controller/JointStateController")
    assert not robot.start("states", "nobody")
    assert robot.list_controllers().controller[0].state == "initialized"
    assert robot.start("states", "nobody", strictness=1)
    assert robot.list_controllers().controller[0].state == "running"
    assert not robot.start("states")
    assert robot.start("states", stop=("states",))  # restarted, as resets do


@pytest.mark.ros_feature("controller manager", "mujoco", "gazebo")
def test_types_are_listed_and_libraries_reloaded(robot: Arm) -> None:
    told = robot.list_controller_types()
    assert "position_controllers/JointTrajectoryController" in told.types
    assert len(told.types) == len(told.base_classes)
    robot.load("states", "joint_state_controller/JointStateController")
    robot.start("states")
    assert not robot.reload_controller_libraries(False).ok
    assert robot.reload_controller_libraries(True).ok
    assert robot.list_controllers().controller == []


@pytest.mark.ros_feature("controller manager", "mujoco", "gazebo")
def test_two_controllers_cannot_claim_one_joint(robot: Arm) -> None:
    robot.load("one", "position_controllers/JointPositionController", joint="a_joint")
    robot.load("both", "position_controllers/JointGroupPositionController", joints=list(JOINTS))
    assert robot.start("one")
    assert not robot.start("both", strictness=1)
    assert robot.start("both", stop=("one",))
    claimed = {each.name: list(each.claimed_resources[0].resources) for each in robot.list_controllers().controller}
    assert claimed["both"] == list(JOINTS)


@pytest.mark.ros_feature("controller manager", "mujoco", "gazebo")
def test_controller_needs_the_interface_of_the_transmission(robot: Arm) -> None:
    assert not robot.load("wrong", "effort_controllers/JointEffortController", joint="a_joint")
    assert not robot.load("nothing", "position_controllers/JointPositionController", joint="c_joint")


@pytest.mark.ros_feature("joint states", "mujoco", "gazebo")
def test_joint_states_are_sorted_and_their_stamps_advance(robot: Arm) -> None:
    import rospy
    from std_srvs.srv import Empty

    robot.load("states", "joint_state_controller/JointStateController", publish_rate=200)
    robot.start("states")
    until(lambda: robot.step(10) or len(robot.states) > 20)  # type: ignore[func-returns-value]
    assert robot.states[-1].name == ["a_joint", "b_joint"]
    stamps = [state.header.stamp.to_nsec() for state in robot.states]
    assert all(later > earlier for earlier, later in itertools.pairwise(stamps))
    rospy.ServiceProxy("/gazebo/reset_simulation", Empty)()
    time.sleep(0.3)
    robot.states.clear()
    until(lambda: robot.step(10) or len(robot.states) > 5)  # type: ignore[func-returns-value]
    after = [state.header.stamp.to_nsec() for state in robot.states]
    assert after[0] < stamps[-1]
    assert all(later > earlier for earlier, later in itertools.pairwise(after))


@pytest.mark.ros_feature("position controllers", "mujoco", "gazebo")
def test_position_commands_are_followed_and_kept_in_the_limits(robot: Arm) -> None:
    from std_msgs.msg import Float64, Float64MultiArray

    robot.load("one", "position_controllers/JointPositionController", joint="a_joint")
    robot.load("both", "position_controllers/JointGroupPositionController", joints=list(JOINTS))
    robot.start("one")
    robot.send("one/command", Float64(0.5))
    robot.step(1000)
    assert robot.rate_and_position("a_joint") == (pytest.approx(0.0, abs=1e-2), pytest.approx(0.5, abs=1e-2))
    robot.start("both", stop=("one",))
    robot.send("both/command", Float64MultiArray(data=[-0.4]))  # too few: nothing happens
    robot.step(500)
    assert robot.rate_and_position("a_joint")[1] == pytest.approx(0.5, abs=1e-2)
    robot.send("both/command", Float64MultiArray(data=[-0.4, 9.0]))
    robot.step(2000)
    assert robot.rate_and_position("b_joint")[1] == pytest.approx(-0.4, abs=1e-2)
    assert robot.rate_and_position("a_joint")[1] == pytest.approx(2.0, abs=1e-2)


@pytest.mark.parametrize("robot", ["Velocity"], indirect=True)
@pytest.mark.ros_feature("velocity controllers", "mujoco", "gazebo")
def test_velocity_commands_are_followed(robot: Arm) -> None:
    from std_msgs.msg import Float64

    robot.load("one", "velocity_controllers/JointVelocityController", joint="a_joint")
    robot.start("one")
    robot.send("one/command", Float64(0.8))
    robot.step(1000)
    assert robot.rate_and_position("a_joint")[0] == pytest.approx(0.8, abs=0.02)
    gains = {"p": 8.0, "i": 0.0, "d": 0.0}
    robot.load("where", "velocity_controllers/JointPositionController", joint="a_joint", pid=gains)
    robot.start("where", stop=("one",))
    robot.send("where/command", Float64(-0.3))
    robot.step(2000)
    assert robot.rate_and_position("a_joint")[1] == pytest.approx(-0.3, abs=0.02)


@pytest.mark.parametrize("robot", ["Effort"], indirect=True)
@pytest.mark.ros_feature("effort controllers", "mujoco", "gazebo")
def test_effort_commands_are_followed(robot: Arm) -> None:
    from std_msgs.msg import Float64, Float64MultiArray

    robot.load("push", "effort_controllers/JointGroupEffortController", joints=["a_joint"])
    robot.start("push")
    robot.send("push/command", Float64MultiArray(data=[0.05]))
    robot.step(200)
    assert robot.rate_and_position("a_joint")[0] > 0.05
    gains = {"p": 20.0, "i": 1.0, "d": 3.0, "i_clamp": 1.0}
    for joint in JOINTS:
        robot.load(f"{joint}_controller", "effort_controllers/JointPositionController", joint=joint, pid=gains)
    assert robot.start("a_joint_controller", "b_joint_controller", stop=("push",))
    robot.send("a_joint_controller/command", Float64(-0.5))
    robot.step(4000)
    assert robot.rate_and_position("a_joint")[1] == pytest.approx(-0.5, abs=0.02)
    assert not robot.load("bare", "effort_controllers/JointPositionController", joint="a_joint")


@pytest.mark.parametrize("robot", [("Position", "Velocity")], indirect=True)
@pytest.mark.ros_feature("position controllers", "mujoco", "gazebo")
@pytest.mark.ros_feature("velocity controllers", "mujoco", "gazebo")
def test_joints_of_one_robot_may_follow_different_things(robot: Arm) -> None:
    from std_msgs.msg import Float64

    robot.load("where", "position_controllers/JointPositionController", joint="b_joint")
    robot.load("fast", "velocity_controllers/JointVelocityController", joint="a_joint")
    assert robot.start("where", "fast")
    robot.send("where/command", Float64(0.6))
    robot.send("fast/command", Float64(0.5))
    robot.step(1500)
    assert robot.rate_and_position("b_joint")[1] == pytest.approx(0.6, abs=0.02)
    assert robot.rate_and_position("a_joint")[0] == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("robot", ["Position", "Effort"], indirect=True)
@pytest.mark.ros_feature("trajectory controllers", "mujoco", "gazebo")
@pytest.mark.ros_feature("actionlib", "ros", "mujoco", "gazebo")
def test_trajectory_goals_succeed_fail_and_are_cancelled(robot: Arm, request: pytest.FixtureRequest) -> None:
    import actionlib
    import rospy
    from actionlib_msgs.msg import GoalStatus
    from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryGoal, FollowJointTrajectoryResult
    from trajectory_msgs.msg import JointTrajectoryPoint

    effort = "Effort" in request.node.name
    gains = {"gains": {joint: {"p": 60.0, "i": 0.0, "d": 8.0} for joint in JOINTS}} if effort else {}
    limits = {"constraints": {"goal_time": 1.0, **{joint: {"goal": 0.02} for joint in JOINTS}}}
    kind = f"{'effort' if effort else 'position'}_controllers/JointTrajectoryController"
    assert robot.load("arm", kind, joints=list(JOINTS), **gains, **limits)
    client = actionlib.SimpleActionClient("/two/arm/follow_joint_trajectory", FollowJointTrajectoryAction)
    assert client.wait_for_server(rospy.Duration(20))
    goal = FollowJointTrajectoryGoal()
    goal.trajectory.joint_names = ["a_joint", "b_joint"]  # in an order of its own

    def aim(a: float, b: float, duration: float) -> None:
        goal.trajectory.points = [
            JointTrajectoryPoint(
                positions=[a, b], velocities=[0.0, 0.0], time_from_start=rospy.Duration.from_sec(duration)
            )
        ]

    def run() -> int:
        client.send_goal(goal)
        end = time.monotonic() + 30.0
        while client.get_result() is None and time.monotonic() < end:  # comes after the state that it brings about
            robot.step(50)
        return int(client.get_state())

    aim(0.4, -0.3, 0.5)
    assert run() == GoalStatus.REJECTED  # it does not run yet
    assert robot.start("arm")
    assert run() == GoalStatus.SUCCEEDED
    assert client.get_result().error_code == FollowJointTrajectoryResult.SUCCESSFUL
    assert robot.rate_and_position("a_joint")[1] == pytest.approx(0.4, abs=0.03)
    assert robot.rate_and_position("b_joint")[1] == pytest.approx(-0.3, abs=0.03)
    aim(3.5, 0.0, 0.5)  # beyond the joint's limit
    assert run() == GoalStatus.ABORTED
    assert client.get_result().error_code == FollowJointTrajectoryResult.GOAL_TOLERANCE_VIOLATED
    goal.trajectory.joint_names = ["a_joint", "c_joint"]
    assert run() == GoalStatus.REJECTED
    assert client.get_result().error_code == FollowJointTrajectoryResult.INVALID_JOINTS
    goal.trajectory.joint_names = ["a_joint", "b_joint"]
    aim(0.0, 0.0, 100.0)  # so long that it has not ended when the cancellation arrives
    client.send_goal(goal)
    until(lambda: client.get_state() == GoalStatus.ACTIVE)  # accepted, but not begun before the next step
    client.cancel_goal()
    until(lambda: robot.step(10) or client.get_state() == GoalStatus.PREEMPTED)  # type: ignore[func-returns-value]
    client.stop_tracking_goal()


@pytest.mark.ros_feature("trajectory controllers", "mujoco", "gazebo")
def test_trajectory_topic_is_followed_and_told(robot: Arm) -> None:
    import rospy
    from control_msgs.msg import JointTrajectoryControllerState
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    robot.load("arm", "position_controllers/JointTrajectoryController", joints=list(JOINTS), state_publish_rate=50)
    robot.start("arm")
    told: list[Any] = []
    listener = rospy.Subscriber("/two/arm/state", JointTrajectoryControllerState, told.append)
    points = [
        JointTrajectoryPoint(positions=[0.2 * n, 0.1 * n], time_from_start=rospy.Duration.from_sec(0.3 * n))
        for n in (1, 2, 3)
    ]
    robot.send("arm/command", JointTrajectory(joint_names=list(JOINTS), points=points))
    robot.step(450)
    rate, position = robot.rate_and_position("b_joint")
    assert (rate, position) == (pytest.approx(0.2 / 0.3, rel=0.1), pytest.approx(0.3, abs=0.02))
    until(lambda: len(told) > 3)
    assert abs(told[-1].error.positions[0]) < 0.02
    robot.send("arm/command", JointTrajectory())  # none: stop
    robot.step(1000)
    assert robot.rate_and_position("b_joint")[1] < 0.45
    listener.unregister()
