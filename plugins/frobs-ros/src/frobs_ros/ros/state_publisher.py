"""Publishes the poses of a robot's links on tf, like ROS's robot_state_publisher 1.15.

ROS's publisher is written in C++, and roscpp listens on every network interface, regardless of ROS_IP and ROS_HOSTNAME.
The replacement ``python -m frobs_ros.ros.state_publisher`` respects both variables, and supports the parameters
``robot_description``, ``tf_prefix``, ``~publish_frequency``, ``~use_tf_static`` and ``~ignore_timestamp``, and the
topics ``joint_states``, ``/tf`` and ``/tf_static``.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.models import MOVING, Joint, JointType
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import FrobsError, ParameterValueError
from frobs_core.util.rotations import quat_from_axis_angle, quat_multiply, quat_rotate
from frobs_models import check_tree, check_unique, flatten_mimics, parse_xml, read_joint
from frobs_ros.errors import MasterError
from frobs_ros.ros.environment import use_ros
from frobs_ros.ros.master import master_uri, require
from frobs_ros.ros.names import join

NAME = "robot_state_publisher"
"""Default name of the node."""
DESCRIPTION = "robot_description"
FREQUENCY = 50.0
"""Default maximum publishing rate [Hz]."""

_AHEAD = 0.5  # offset that is added to the time stamps of fixed joints' frames on /tf [s]
_QUEUE = 100  # messages, as in tf2's broadcasters


def read_joints(text: str, source: str) -> tuple[Joint, ...]:
    """Read the joints of a URDF, ignoring shapes, masses and limits.

    Raises:
        ModelFileError: The text is not a URDF, or its joints do not form a tree.
    """
    root = parse_xml(text, Path(source))
    if root.tag != "robot":
        root.refuse("the robot description must be a URDF, whose root element is <robot>.")
    links, elements = check_unique(root.children("link")), check_unique(root.children("joint"))
    joints = [read_joint(element, links, elements) for element in elements.values()]
    check_tree(links, joints, elements, root)
    return flatten_mimics(joints, elements)


class Frames:
    """Computes the pose of each joint's child link relative to its parent link."""

    def __init__(self, joints: Iterable[Joint]) -> None:
        self.joints = tuple(joints)
        k = len(self.joints)
        self._pos = np.array([joint.origin.pos for joint in self.joints]).reshape(k, 3)
        self._quat = np.array([joint.origin.quat_wxyz for joint in self.joints]).reshape(k, 4)
        self._axes = np.array([joint.axis for joint in self.joints]).reshape(k, 3)
        self._turns = np.array([float(joint.type is not JointType.PRISMATIC) for joint in self.joints])
        self._ways = quat_rotate(self._quat, self._axes) * (1.0 - self._turns)[:, None]  # (k, 3), in the parent's frame

    def positions(self, joint_positions: Mapping[str, float]) -> Floats:
        """Return the joint positions, (k,) [rad or m], with NaN for joints whose position is unknown.

        Args:
            joint_positions: Known positions, by joint name. If the position of a mimic joint is unknown, the position
                is computed from the mimicked joint.
        """
        positions = np.full(len(self.joints), np.nan)
        for i, joint in enumerate(self.joints):
            if joint.name in joint_positions:
                positions[i] = joint_positions[joint.name]
            elif joint.mimic and joint.mimic.joint in joint_positions:
                positions[i] = joint.mimic.multiplier * joint_positions[joint.mimic.joint] + joint.mimic.offset
        return positions

    def poses(self, positions: Floats) -> tuple[Floats, Floats]:
        """Return the poses of the child links for joint positions, (k,) [rad or m].

        Returns:
            The positions pos, (k, 3) [m], and the orientations quat_wxyz, (k, 4).
        """
        turned = quat_from_axis_angle(self._axes, positions * self._turns)
        return self._pos + self._ways * positions[:, None], quat_multiply(self._quat, turned)


def split(joints: Iterable[Joint]) -> tuple[Frames, Frames]:
    """Return the frames of the moving joints and the frames of the fixed joints.

    As in ROS's publisher, planar joints are treated as fixed joints, and floating joints are ignored.
    """
    joints = tuple(joints)
    return (
        Frames(joint for joint in joints if joint.type in MOVING),
        Frames(joint for joint in joints if joint.type in (JointType.FIXED, JointType.PLANAR)),
    )


class Pace:
    """Limits the rate at which each joint's frame is published, by skipping joint state messages.

    Args:
        frequency: Maximum publishing rate [Hz].
        always: Whether every message is due.
    """

    def __init__(self, frequency: float, always: bool = False) -> None:
        self._interval = round(1e9 / frequency)
        self._always = always
        self._last: dict[str, int] = {}

    def is_due(self, names: Collection[str], stamp: int) -> bool:
        """Return whether a message with the given time stamp [ns] is due, and if so, record the time stamp.

        If the time stamp is earlier than a recorded one, for example after a simulation reset, the message is due.
        """
        last = [self._last[name] for name in names if name in self._last]
        due = (
            self._always
            or len(last) < len(names)  # a joint has no recorded stamp
            or stamp >= min(last, default=stamp) + self._interval
            or stamp < max(last, default=stamp)
        )
        if due:
            self._last.update(dict.fromkeys(names, stamp))
        return due


def prefixed(prefix: str, frame: str) -> str:
    """Return a frame's name on tf. The prefix is added unless ``frame`` begins with a slash."""
    if frame.startswith("/"):
        return frame[1:]
    prefix = prefix.removeprefix("/")
    return f"{prefix}/{frame}" if prefix else frame


class StatePublisher:
    """Publishes link poses on tf for each received joint state message. The process must already be a ROS node.

    Args:
        joints: Joints of the robot.
        frequency: Maximum publishing rate [Hz].
        static: Whether to publish fixed joints once on ``/tf_static``, instead of repeatedly on ``/tf``.
        always: Whether to use every message, regardless of its time stamp.
        prefix: Prefix of the frame names.

    Raises:
        ConfigurationError: The publishing rate is not positive.
    """

    def __init__(
        self,
        joints: Iterable[Joint],
        *,
        frequency: float = FREQUENCY,
        static: bool = True,
        always: bool = False,
        prefix: str = "",
    ) -> None:
        import rospy
        from sensor_msgs.msg import JointState
        from tf2_msgs.msg import TFMessage

        if not frequency > 0:
            raise ParameterValueError("publish_frequency", frequency, "above 0 [Hz]")
        joints = tuple(joints)
        self._moving, self._fixed = split(joints)
        self._pace, self._prefix = Pace(frequency, always), prefix
        self._names = {joint.name for joint in joints}
        self._lock = threading.Lock()  # rospy handles each publisher of joint states in a separate thread
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=_QUEUE, tcp_nodelay=True)
        if static:
            self._static = rospy.Publisher("/tf_static", TFMessage, queue_size=_QUEUE, latch=True)
            self._static.publish(self._fixed_frames(rospy.Time.now()))
        else:
            rospy.Timer(rospy.Duration(1.0 / frequency), self._repeat, reset=True)
        rospy.Subscriber("joint_states", JointState, self._hear, queue_size=1, tcp_nodelay=True)

    def _hear(self, message: Any) -> None:
        import rospy

        if len(message.name) != len(message.position):
            lengths = f"{len(message.name)} names and {len(message.position)} positions"
            rospy.logwarn_throttle(300.0, f"ignored a joint_states message with {lengths}")
            return
        stamp = message.header.stamp
        with self._lock:
            if not self._pace.is_due(message.name, stamp.to_nsec()):
                return
            strange = set(message.name) - self._names
            self._names |= strange  # to log each unknown joint only once
        if strange:
            rospy.logwarn(
                "joint_states contains joints that are not in %s: %s", DESCRIPTION, ", ".join(sorted(strange))
            )
        positions = self._moving.positions(dict(zip(message.name, message.position, strict=True)))
        if np.isfinite(positions).any():
            self._tf.publish(to_message(self._moving, positions, stamp, self._prefix))

    def _repeat(self, _: Any) -> None:
        import rospy

        self._tf.publish(self._fixed_frames(rospy.Time.now() + rospy.Duration(_AHEAD)))

    def _fixed_frames(self, stamp: Any) -> Any:
        return to_message(self._fixed, np.zeros(len(self._fixed.joints)), stamp, self._prefix)


def to_message(frames: Frames, positions: Floats, stamp: Any, prefix: str = "") -> Any:
    """Return a ``tf2_msgs/TFMessage`` with the frames of all joints whose positions, (k,) [rad or m], are finite."""
    from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
    from std_msgs.msg import Header
    from tf2_msgs.msg import TFMessage

    known = np.isfinite(positions)
    pos, quat = frames.poses(np.where(known, positions, 0.0))
    return TFMessage([
        TransformStamped(
            Header(stamp=stamp, frame_id=prefixed(prefix, joint.parent)),
            prefixed(prefix, joint.child),
            Transform(Vector3(x, y, z), Quaternion(i, j, k, w)),
        )
        for joint, (x, y, z), (w, i, j, k), is_known in zip(
            frames.joints, pos.tolist(), quat.tolist(), known.tolist(), strict=True
        )
        if is_known
    ])  # fmt: skip


def read_description() -> tuple[Joint, ...]:
    """Read the robot's joints from the parameter ``robot_description`` in the closest enclosing namespace.

    Raises:
        MasterError: No master responds, or the parameter does not exist.
        ModelFileError: The parameter does not contain a valid robot description.
    """
    import rosgraph
    import rospy

    namespace = rospy.get_namespace()
    master = rosgraph.Master(join(namespace, NAME), master_uri())
    try:
        parameter = master.searchParam(DESCRIPTION)
        text = master.getParam(parameter)
    except (rosgraph.MasterError, KeyError) as error:
        missing = (
            f"the parameter {join(namespace, DESCRIPTION)} does not exist; load the robot's URDF into this parameter "
            "first"
        )
        raise MasterError(master_uri(), missing) from error
    return read_joints(str(text), parameter)


def main() -> None:
    """Run the node until it is shut down, or exit the process with an error message if the node cannot start."""
    use_ros()
    import rospy

    try:
        require()
        joints = read_description()  # read before init_node, which replaces any node of the same name
        rospy.init_node(NAME)
        StatePublisher(
            joints,
            frequency=float(rospy.get_param("~publish_frequency", FREQUENCY)),
            static=bool(rospy.get_param("~use_tf_static", True)),
            always=bool(rospy.get_param("~ignore_timestamp", False)),
            prefix=str(rospy.get_param(rospy.search_param("tf_prefix") or "~tf_prefix", "")),
        )
    except FrobsError as error:
        sys.exit(str(error))
    rospy.spin()


if __name__ == "__main__":
    main()
