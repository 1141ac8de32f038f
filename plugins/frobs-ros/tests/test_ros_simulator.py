"""The simulator ``ros`` and the environments of policies, with a robot that a thread plays on real topics."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.contracts import CommandMode
from frobs_core.description import Body, Placement, Scene
from frobs_core.kernel.env import RobotEnv
from frobs_core.models import Box
from frobs_core.plugins import get_record
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import CapabilityError, ConfigurationError
from frobs_deploy import Policy
from frobs_ros.errors import ClockResetError, RobotSilentError
from frobs_ros.policy_node.running import Report, act, make_env
from frobs_ros.robot.simulation import RosSimulation
from frobs_train.export.pretrained import read_pretrained

REACH, MAZE = "frobs/Irb120Reach-v0", "frobs/KobukiMaze-v0"
GOAL = {"goal": np.array([0.3, 0.2, 0.5])}
ARM = {"namespace": "/played", "controller": "arm", "timeout": 5.0}


class PlayedArm:
    """An arm that is where its last command was, and publishes its joint states 200 times a second.

    Attributes:
        positions: Where it is, (6,) [rad].
        commands: All commands, (6,) [rad] each.
    """

    def __init__(self) -> None:
        import rospy
        from sensor_msgs.msg import JointState
        from std_msgs.msg import Float64MultiArray

        self.names = [f"joint_{i}" for i in range(1, 7)]
        rospy.set_param(
            "/played/arm", {"type": "position_controllers/JointGroupPositionController", "joints": self.names[::-1]}
        )
        self.positions = np.zeros(6)
        self.commands: list[Floats] = []
        self._message = JointState
        self._states = rospy.Publisher("/played/joint_states", JointState, queue_size=1, tcp_nodelay=True)
        self._topic = rospy.Subscriber("/played/arm/command", Float64MultiArray, self._hear, tcp_nodelay=True)
        self.is_silent = self._is_over = False
        self._thread = threading.Thread(target=self._publish)
        self._thread.start()

    def _hear(self, message: Any) -> None:
        self.positions = np.array(message.data)[::-1]
        self.commands.append(self.positions)

    def wait_until_it_hears(self) -> None:
        wait_until(self._topic.get_num_connections)

    def _publish(self) -> None:
        while not self._is_over:
            if not self.is_silent:  # by two publishers, as of an arm and its gripper
                for half in (slice(0, 3), slice(3, 6)):
                    self._states.publish(self._message(name=self.names[half], position=self.positions[half].tolist()))
            time.sleep(0.005)

    def close(self) -> None:
        self._is_over = True
        self._thread.join()
        self._states.unregister()
        self._topic.unregister()


def wait_until(condition: Callable[[], Any]) -> None:
    until = time.monotonic() + 20.0
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.01)


@pytest.fixture
def arm(rosmaster: str) -> Iterator[PlayedArm]:
    with closing(PlayedArm()) as arm:
        yield arm


@pytest.fixture
def env(arm: PlayedArm) -> Iterator[RobotEnv]:
    with closing(make_env(read_pretrained(REACH), **ARM)) as env:
        yield env


def test_observations_are_those_of_the_training_environment(arm: PlayedArm, env: RobotEnv) -> None:
    arm.positions = np.array([0.2, -0.1, 0.3, 0.1, 0.5, -0.2])
    time.sleep(0.1)
    own = gym.make(f"frobs_core:{REACH}", disable_env_checker=True)
    expected, _ = own.reset(seed=0, options={**GOAL, "joint_positions": arm.positions})
    assert env.reset(seed=0, options=GOAL)[0] == pytest.approx(expected, abs=2e-5)
    own.close()


def test_a_policy_reaches_a_goal_on_topics_and_then_the_robot_holds(arm: PlayedArm, env: RobotEnv) -> None:
    goal = GOAL["goal"]
    reports: list[Report] = []  # time is counted in steps, because a busy machine misses deadlines
    report = act(
        env,
        Policy(read_pretrained(REACH)),
        clock=lambda: float(len(reports)),
        goal=goal,
        seconds=50.0,
        on_step=reports.append,
    )
    assert report.is_success
    assert report.steps == 50
    assert np.linalg.norm(env.robot.frame_pose("tcp")[0][0] - goal) < 0.05
    env.close()
    wait_until(lambda: arm.commands[-1] == pytest.approx(arm.commands[-2]))


def test_commands_stay_within_what_the_joints_may(arm: PlayedArm) -> None:
    with closing(make_env(read_pretrained(REACH), **ARM, speed=0.1)) as env:
        env.reset(seed=0, options=GOAL)
        before = env.robot.joint_positions[0].copy()
        arm.wait_until_it_hears()
        while not arm.commands:  # rospy loses messages while a connection is being made
            env.step(np.ones(6))
        assert arm.commands[0] - before == pytest.approx(0.1 * env.robot.velocity_limit[0] * env.control_timestep)


def test_a_robot_that_falls_silent_holds(arm: PlayedArm) -> None:
    with closing(make_env(read_pretrained(REACH), **{**ARM, "timeout": 0.3})) as env:
        env.reset(seed=0, options=GOAL)
        arm.wait_until_it_hears()
        env.step(np.ones(6))
        arm.is_silent = True
        time.sleep(0.4)
        with pytest.raises(RobotSilentError, match=r"no joint states received for 0\.\d+ s; the robot was commanded"):
            env.step(np.ones(6))
        wait_until(lambda: arm.commands[-1] == pytest.approx(env.robot.joint_positions[0]))
        assert env.simulation.measurement_age[0] > 0.3


def test_a_clock_that_goes_back_is_an_error_until_the_next_reset(
    env: RobotEnv, monkeypatch: pytest.MonkeyPatch
) -> None:
    env.reset(seed=0, options=GOAL)
    env.step(np.zeros(6))
    monkeypatch.setattr(env.simulation, "_now", lambda: 0.5 * time.monotonic())
    with pytest.raises(ClockResetError):
        env.step(np.zeros(6))
    env.reset(seed=0, options=GOAL)
    env.step(np.zeros(6))


def test_the_simulator_drives_home_slowly_and_counts_missed_deadlines(arm: PlayedArm) -> None:
    arm.positions = np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.0])
    kwargs = {**ARM, "homing_speed": 1.0}
    made = gym.make(f"frobs_core:{REACH}", disable_env_checker=True, simulator="ros", simulator_kwargs=kwargs)
    with closing(made) as env:
        start = time.monotonic()
        env.reset(seed=0)
        assert time.monotonic() - start > 0.25
        assert arm.positions == pytest.approx(env.unwrapped.robot.home[0], abs=0.05)  # type: ignore[attr-defined]
        env.step(np.zeros(6))
        time.sleep(0.2)
        assert env.step(np.zeros(6))[-1]["frobs/missed_deadlines"] >= 1.0
        with pytest.raises(CapabilityError, match="teleport"):
            env.reset(options={"joint_positions": np.zeros(6)})


def test_a_base_is_where_its_odometry_says_and_a_lidar_reads_its_scans(rosmaster: str) -> None:
    import rospy
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import JointState, LaserScan

    publishers = [
        rospy.Publisher(f"/wheels/{topic}", kind, queue_size=1, latch=True)
        for topic, kind in (("odom", Odometry), ("scan", LaserScan), ("joint_states", JointState))
    ]
    odometry = Odometry()
    odometry.pose.pose.position.x, odometry.pose.pose.orientation.w = 3.0, 1.0
    odometry.twist.twist.linear.x = 0.25
    ranges = [float("inf")] * 360
    ranges[0] = 0.5  # behind the robot, as the first ray of its lidar
    scan = LaserScan(angle_min=-np.pi, angle_increment=np.radians(1.0), ranges=ranges)
    joints = JointState(name=["wheel_left_joint", "wheel_right_joint"], position=[0.0, 0.0])
    for publisher, message in zip(publishers, (odometry, scan, joints), strict=True):
        publisher.publish(message)
    with closing(make_env(read_pretrained(MAZE), namespace="/wheels", timeout=30.0)) as env:
        [(name, lidar)] = env.robot.robot.lidars.items()
        assert lidar.noise == 0.0
        observation, _ = env.reset(seed=0, options={"goal": np.array([4.0, 3.0])})
        assert env.robot.base_pose[0][0] == pytest.approx([3.0, 0.0, 0.0])
        assert env.robot.base_twist[0][0] == pytest.approx([0.25, 0.0, 0.0])
        expected = np.full(lidar.rays, lidar.range_max)
        expected[0] = 0.5
        assert env.robot.lidar(name)[0] == pytest.approx(expected)
        _, nearness = env.observations.columns["nearness"]
        assert observation[nearness] == pytest.approx(1.0 / (1.0 + expected), abs=1e-6)
    for publisher in publishers:
        publisher.unregister()


def test_a_body_is_where_its_topic_says(arm: PlayedArm) -> None:
    import rospy
    from geometry_msgs.msg import PoseStamped

    message = PoseStamped()
    message.pose.position.x, message.pose.orientation.w = 0.4, 1.0
    publisher = rospy.Publisher("/played/box_pose", PoseStamped, queue_size=1, latch=True)
    publisher.publish(message)
    robot = get_record("robot", "irb120").load()
    placement = Placement(robot=robot, model=robot.read_model(), command_mode=CommandMode.POSITION)
    scene = Scene(bodies={"box": Body(geometry=Box((0.1, 0.1, 0.1)), mass=0.1)})
    kwargs: Any = {**ARM, "home": False, "timeout": 1.0, "bodies": {"box": "box_pose"}}
    simulation = RosSimulation({"robot": placement}, scene, num_envs=1, physics_timestep=0.01, **kwargs)
    with closing(simulation):
        simulation.reset()
        assert simulation.bodies["box"].pose[0][0] == pytest.approx([0.4, 0.0, 0.0])
        with pytest.raises(RobotSilentError, match="no pose of box received"):
            simulation.step(300)
    publisher.unregister()


@pytest.mark.parametrize(
    ("id", "kwargs", "message"),
    [
        (REACH, {"speed": 0.0}, "above 0 and at most 1"),
        (REACH, {"speed": 1.5}, "above 0 and at most 1"),
        ("frobs/PandaPickAndPlace-v0", {}, r"poses of the bodies .* are unknown; name their topics"),
    ],
)
def test_what_cannot_run_is_refused(id: str, kwargs: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        make_env(read_pretrained(id), **kwargs)


@pytest.mark.ros_feature("policies that see images", "mujoco", works=False)
def test_a_policy_that_sees_images_is_refused() -> None:
    bundle = read_pretrained(REACH)
    observation = {**bundle.manifest["observation"], "images": {"eye": {"camera": "wrist"}}}
    with pytest.raises(ConfigurationError, match=r"uses the images 'eye', but this command does not support images"):
        make_env(replace(bundle, manifest={**bundle.manifest, "observation": observation}))
