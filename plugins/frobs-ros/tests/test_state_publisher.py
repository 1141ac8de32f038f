"""Our state publisher beside ROS's own, which is in C++: the same robots and joint states, the same frames."""

from __future__ import annotations

import math
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from itertools import count, pairwise
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import numpy as np
import pytest

from frobs_core.models import load_model
from frobs_core.models.kinematics import MOVING
from frobs_core.plugins import get_record
from frobs_core.util.errors import ModelFileError
from frobs_ros.ros.packages import find_node
from frobs_ros.ros.state_publisher import Frames, Pace, prefixed, read_joints

MODULE = "frobs_ros.ros.state_publisher"
ZOO = """<robot name="zoo">
<link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/><link name="e"/><link name="/f"/>
<link name="g"/><link name="h"/>
<joint name="a" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0.1 -0.2 0.3" rpy="0.4 -1.2 2.9"/>
 <axis xyz="1 2 -3"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="b" type="continuous"><parent link="a"/><child link="b"/><origin rpy="3.1 0.2 -3"/></joint>
<joint name="c" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="1 2 3" rpy="0.5 0.6 0.7"/>
 <axis xyz="0 -0.6 0.8"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="d" type="fixed"><parent link="c"/><child link="d"/><origin xyz="0 0 1" rpy="1.5707963 0 3.1415926"/></joint>
<joint name="e" type="revolute"><parent link="d"/><child link="e"/><axis xyz="0 0 1"/>
 <limit lower="-2" upper="2" effort="1" velocity="1"/><mimic joint="a" multiplier="-1.5" offset="0.25"/></joint>
<joint name="f" type="prismatic"><parent link="d"/><child link="/f"/><axis xyz="0 1 0"/>
 <limit lower="-2" upper="2" effort="1" velocity="1"/><mimic joint="c"/></joint>
<joint name="g" type="planar"><parent link="d"/><child link="g"/><origin xyz="0.5 0 0"/><axis xyz="0 0 1"/></joint>
<joint name="h" type="floating"><parent link="d"/><child link="h"/><origin xyz="0.5 0 0"/></joint>
</robot>"""
ARM = """<robot name="arm"><link name="base"/><link name="l"/><joint name="j" type="continuous"><parent link="base"/>
<child link="l"/><axis xyz="0 0 1"/></joint></robot>"""
Transform = tuple[str, list[float], list[float]]
"""Parent, position [m], quaternion scalar first with its largest component above 0."""

_names = count()


def text_of(robot: str) -> str:
    return ZOO if robot == "zoo" else load_model(get_record("robot", robot).load().model).xml


def real_publisher() -> Path:
    """Return ROS's own."""
    return find_node("robot_state_publisher", "robot_state_publisher")


def wait_for(what: Callable[[], Any], timeout: float = 60.0) -> None:
    end = time.monotonic() + timeout
    while not what():
        assert time.monotonic() < end, "it did not come about"
        time.sleep(0.01)


def transform_of(message: Any) -> Transform:
    pos, turn = message.transform.translation, message.transform.rotation
    quat = np.array([turn.w, turn.x, turn.y, turn.z])
    quat *= np.sign(quat[np.abs(quat).argmax()])
    return message.header.frame_id, [pos.x, pos.y, pos.z], quat.tolist()


class Publisher:
    """A state publisher that runs as a process, and what it says.

    Attributes:
        static: What it has said on /tf_static, by child.
        moving: What it has said on /tf, by child, for each stamp [ns]: that of a message's first.
    """

    def __init__(self, command: list[str], text: str, prefix: str | None, words: tuple[str, ...]) -> None:
        import rospy
        from sensor_msgs.msg import JointState
        from tf2_msgs.msg import TFMessage

        self.namespace = f"/robot_{next(_names)}"
        rospy.set_param(f"{self.namespace}/robot_description", text)
        if prefix is not None:
            rospy.set_param(f"{self.namespace}/tf_prefix", prefix)
        self.static: dict[str, Transform] = {}
        self.moving: dict[int, dict[str, Transform]] = {}
        self._name = f"{self.namespace}/robot_state_publisher"
        self._listeners = [
            rospy.Subscriber("/tf", TFMessage, lambda m: self._hear(m, self._take_moving)),
            rospy.Subscriber("/tf_static", TFMessage, lambda m: self._hear(m, self._take_static)),
        ]
        self._joints = rospy.Publisher(f"{self.namespace}/joint_states", JointState, queue_size=10, tcp_nodelay=True)
        self.process = subprocess.Popen([*command, f"__ns:={self.namespace}", *words])

    def wait_until_ready(self) -> None:
        """Wait until it hears and is heard. A stuck process is aborted, and ours then prints the stack of each thread."""
        try:
            wait_for(lambda: self._joints.get_num_connections() > 0 and self._is_heard())
        except AssertionError:
            self.process.send_signal(signal.SIGABRT)
            self.process.wait(20.0)
            raise

    def _is_heard(self) -> bool:
        """Ask the node itself: a connection is open on this side before the node sends messages through it."""
        import rosgraph

        try:
            uri = rosgraph.Master("/client").lookupNode(self._name)
        except rosgraph.MasterError:
            return False
        with ServerProxy(uri) as node:
            _, _, connections = node.getBusInfo("/client")
        return "/tf" in [topic for _, _, direction, _, topic, *_ in connections if direction == "o"]

    def _hear(self, message: Any, take: Callable[[int, dict[str, Transform]], None]) -> None:
        if message.transforms and message._connection_header["callerid"] == self._name:
            frames = {each.child_frame_id: transform_of(each) for each in message.transforms}
            take(message.transforms[0].header.stamp.to_nsec(), frames)

    def _take_static(self, _: int, frames: dict[str, Transform]) -> None:
        self.static = frames

    def _take_moving(self, stamp: int, frames: dict[str, Transform]) -> None:
        self.moving[stamp] = frames

    def tell(self, stamp: Any, positions: dict[str, float]) -> None:
        from sensor_msgs.msg import JointState
        from std_msgs.msg import Header

        self._joints.publish(JointState(Header(stamp=stamp), list(positions), list(positions.values()), [], []))

    def close(self) -> None:
        import rospy

        self.process.terminate()
        self.process.wait(20.0)
        for listener in self._listeners:
            listener.unregister()
        self._joints.unregister()
        rospy.delete_param(self.namespace)


@pytest.fixture
def start(rosmaster: str) -> Iterator[Callable[..., Publisher]]:
    """Starts state publishers, ours or the real one, in the computer's own time."""
    import rospy

    running: list[Publisher] = []

    def begin(text: str, *words: str, real: bool = False, prefix: str | None = None) -> Publisher:
        command = [str(real_publisher())] if real else [sys.executable, "-X", "faulthandler", "-m", MODULE]
        running.append(Publisher(command, text, prefix, words))
        running[-1].wait_until_ready()
        return running[-1]

    before = rospy.get_param("/use_sim_time", False)
    rospy.set_param("/use_sim_time", False)
    yield begin
    for each in running:
        each.close()
    rospy.set_param("/use_sim_time", before)


def assert_equal(ours: dict[str, Transform], real: dict[str, Transform]) -> None:
    assert ours.keys() == real.keys()
    for child, (parent, pos, quat) in real.items():
        assert ours[child][0] == parent
        assert ours[child][1] == pytest.approx(pos, abs=1e-9)
        assert ours[child][2] == pytest.approx(quat, abs=1e-9)


@pytest.mark.parametrize(
    "robot", ["zoo", *(pytest.param(name, marks=pytest.mark.slow) for name in ("irb120", "ur5", "kobuki"))]
)
@pytest.mark.ros_feature("tf and robot_state_publisher", "ros", "replacement")
def test_frames_equal_those_of_ros(start: Callable[..., Publisher], robot: str) -> None:
    import rospy

    text = text_of(robot)
    ours, real = start(text), start(text, real=True)
    joints = [joint.name for joint in read_joints(text, robot) if joint.type in MOVING and not joint.mimic]
    rng = np.random.default_rng(0)
    began = rospy.Time.now()
    for i in range(30):
        stamp = began + rospy.Duration(0.1 * i)
        at = stamp.to_nsec()
        told = [name for name in joints if rng.random() < 0.8] or joints
        positions = dict(zip(told, rng.uniform(-4.0, 4.0, len(told)).tolist(), strict=True))
        for publisher in (ours, real):
            publisher.tell(stamp, positions)
        wait_for(lambda at=at: at in ours.moving and at in real.moving)
    wait_for(lambda: ours.static and real.static)
    assert_equal(ours.static, real.static)
    assert len(real.moving) == 30
    for stamp_ns, frames in real.moving.items():
        assert_equal(ours.moving[stamp_ns], frames)


@pytest.mark.parametrize(
    "prefix", ["/left", *(pytest.param(prefix, marks=pytest.mark.slow) for prefix in ("left", "left/inner"))]
)
@pytest.mark.ros_feature("tf and robot_state_publisher", "ros", "replacement")
def test_prefix_stands_before_frames_as_with_ros(start: Callable[..., Publisher], prefix: str) -> None:
    import rospy

    both = [start(ZOO, prefix=prefix), start(ZOO, prefix=prefix, real=True)]
    stamp = rospy.Time.now()
    for publisher in both:
        publisher.tell(stamp, {"a": 1.0, "b": -2.0, "c": 0.5})
    wait_for(lambda: all(publisher.moving and publisher.static for publisher in both))
    ours, real = both
    assert {frame.partition("/")[0] for frame in ours.static} == {"left"}
    assert_equal(ours.static, real.static)
    assert_equal(ours.moving[stamp.to_nsec()], real.moving[stamp.to_nsec()])


@pytest.mark.ros_feature("tf and robot_state_publisher", "replacement")
def test_two_robots_are_told_apart_by_their_prefixes(start: Callable[..., Publisher]) -> None:
    import rospy

    left, right = start(ARM, prefix="left"), start(ARM, prefix="right")
    stamp = rospy.Time.now()
    left.tell(stamp, {"j": 1.0})
    right.tell(stamp, {"j": -1.0})
    wait_for(lambda: left.moving and right.moving)
    [(parent, _, quat)] = left.moving[stamp.to_nsec()].values()
    assert (parent, list(left.moving[stamp.to_nsec()])) == ("left/base", ["left/l"])
    assert quat == pytest.approx([math.cos(0.5), 0.0, 0.0, math.sin(0.5)])
    [(parent, _, quat)] = right.moving[stamp.to_nsec()].values()
    assert (parent, list(right.moving[stamp.to_nsec()])) == ("right/base", ["right/l"])
    assert quat == pytest.approx([math.cos(0.5), 0.0, 0.0, -math.sin(0.5)])


def test_fixed_joints_come_again_and_again_without_static_frames(start: Callable[..., Publisher]) -> None:
    import rospy

    both = [start(ZOO, "_use_tf_static:=false"), start(ZOO, "_use_tf_static:=false", real=True)]
    wait_for(lambda: all(len(publisher.moving) > 5 for publisher in both))
    ours, real = both
    assert not ours.static
    assert_equal(list(ours.moving.values())[3], list(real.moving.values())[3])
    assert 0.0 < max(ours.moving) * 1e-9 - rospy.Time.now().to_sec() <= 0.5


def test_every_message_counts_where_time_stamps_are_ignored(start: Callable[..., Publisher]) -> None:
    import rospy

    ours = start(ARM, "_ignore_timestamp:=true")
    for nanoseconds in (0, 1, 2, 3):
        ours.tell(rospy.Time(100, nanoseconds), {"j": 1.0})
        wait_for(lambda n=nanoseconds: 100_000_000_000 + n in ours.moving)


@pytest.mark.ros_feature("tf and robot_state_publisher", "replacement")
def test_frames_go_on_when_simulated_time_has_gone_back(start: Callable[..., Publisher]) -> None:
    import rospy
    from rosgraph_msgs.msg import Clock

    rospy.set_param("/use_sim_time", True)
    clock = rospy.Publisher("/clock", Clock, queue_size=1, latch=True)
    try:
        clock.publish(rospy.Time(100))
        ours = start(ARM)
        for second in (100, 101, 1, 2):
            clock.publish(rospy.Time(second))
            ours.tell(rospy.Time(second), {"j": 1.0})
            wait_for(lambda at=second: at * 10**9 in ours.moving)
    finally:
        clock.unregister()


@pytest.mark.slow
def test_it_keeps_to_its_rate(start: Callable[..., Publisher]) -> None:
    import rospy

    ours = start(text_of("irb120"), "_publish_frequency:=25")
    joints = {f"joint_{i}": 0.1 * i for i in range(1, 7)}
    stamps = [rospy.Time.from_sec(100.0 + 0.01 * i) for i in range(300)]
    for stamp in stamps:
        ours.tell(stamp, joints)
        time.sleep(0.005)
    wait_for(lambda: ours.moving)
    told = sorted(ours.moving)
    assert all(after - before >= 4e7 for before, after in pairwise(told))


@pytest.mark.parametrize(
    ("positions", "said"),
    [({"j": math.nan}, ""), ({"k": 1.0}, "are not in robot_description: k")],
    ids=["not a number", "strange joint"],
)
def test_what_cannot_be_told_is_left_out(
    start: Callable[..., Publisher], positions: dict[str, float], said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    import rospy
    from sensor_msgs.msg import JointState

    ours = start(ARM)
    ours._joints.publish(JointState(name=["j"]))
    time.sleep(0.3)  # of messages that wait, the newest alone is read
    stamp = rospy.Time.now()
    ours.tell(stamp, positions)
    time.sleep(0.3)
    ours.tell(stamp + rospy.Duration(1), {"j": 0.0})
    wait_for(lambda: ours.moving)
    assert list(ours.moving) == [(stamp + rospy.Duration(1)).to_nsec()]
    heard = "".join(capfd.readouterr())
    assert "1 names and 0 positions" in heard
    assert said in heard


@pytest.mark.parametrize(
    ("text", "words", "reason"),
    [
        (None, [], "the parameter /broken/robot_description does not exist"),
        ("<robot><link name='a'/>", [], "not well-formed XML"),
        ("<sdf/>", [], "must be a URDF, whose root element is <robot>"),
        (ARM, ["_publish_frequency:=-1"], "it must be above 0"),
    ],
    ids=["missing", "torn", "sdf", "rate"],
)
def test_a_robot_that_cannot_be_told_of_is_one_clear_line(
    rosmaster: str, text: str | None, words: list[str], reason: str
) -> None:
    import rospy

    if text is not None:
        rospy.set_param("/broken/robot_description", text)
    command = [sys.executable, "-m", MODULE, "__ns:=/broken", *words]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    finally:
        if text is not None:
            rospy.delete_param("/broken")
    assert done.returncode == 1
    assert reason in done.stderr
    assert "Traceback" not in done.stderr


def test_no_master_is_one_clear_line(lonely: str) -> None:
    command = [sys.executable, "-m", MODULE]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 1
    assert done.stderr.startswith(f"no ROS master responds at {lonely}")


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        (ARM.replace('child link="l"', 'child link="m"'), "child link 'm' does not exist"),
        (ARM.replace("0 0 1", "0 0 0"), "is zero"),
        (ARM.replace("</robot>", "<link name='alone'/></robot>"), "have no parent"),
    ],
)
def test_joints_that_make_no_tree_are_refused(wrong: str, reason: str) -> None:
    with pytest.raises(ModelFileError, match=reason):
        read_joints(wrong, "robot_description")


def test_missing_meshes_and_limits_do_not_matter() -> None:
    mesh = '<link name="l"><visual><geometry><mesh filename="package://nowhere/none.stl"/></geometry></visual></link>'
    [joint] = read_joints(ARM.replace('<link name="l"/>', mesh).replace("continuous", "revolute"), "robot_description")
    assert joint.child == "l"


def test_a_robot_without_joints_has_no_frames() -> None:
    pos, quat = Frames([]).poses(Frames([]).positions({"j": 1.0}))
    assert (pos.shape, quat.shape) == ((0, 3), (0, 4))


def test_pace_follows_the_joint_that_waited_longest() -> None:
    pace = Pace(10.0)
    assert pace.is_due(["a", "b"], 0)
    assert not pace.is_due(["a", "b"], 99_999_999)
    assert pace.is_due(["a", "b"], 100_000_000)
    assert not pace.is_due(["a"], 150_000_000)
    assert pace.is_due(["a", "c"], 160_000_000)  # a new one
    assert pace.is_due(["a", "b"], 200_000_000)
    assert pace.is_due(["a", "b"], 5)  # time has gone back
    assert not pace.is_due(["a", "b"], 5)
    assert not pace.is_due([], 7)


@pytest.mark.parametrize(
    ("prefix", "frame", "name"),
    [("", "l", "l"), ("/", "l", "l"), ("p", "l", "p/l"), ("/p", "l", "p/l"), ("p", "/l", "l"), ("", "/l", "l")],
)
def test_prefix_and_frame_make_a_name(prefix: str, frame: str, name: str) -> None:
    assert prefixed(prefix, frame) == name
