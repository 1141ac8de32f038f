"""Publishes the robot's path and the task's markers, such as the goal, for display in RViz."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

import numpy as np

from frobs_core.description import Marker
from frobs_core.util.arrays import Floats
from frobs_ros.bridge.poses import WORLD, Place, pose_message

if TYPE_CHECKING:
    from frobs_ros.policy_node.mirror import Mirror
    from frobs_ros.policy_node.policy_loop import Report
    from frobs_ros.policy_node.robot import RosRobot

PATH, MARKERS = "path", "visualization_marker_array"
"""Topic names, relative to the robot's namespace."""

_INTERVAL = 0.1  # [s] between two messages of a topic
_SPACING = 0.01  # minimum distance between two poses in the path of a tool [m]
_BASE_SPACING = 0.05  # minimum distance between two poses in the path of a base [m]
_LENGTH = 1000  # maximum number of poses in a path; serializing them takes about 5 ms of a control step


class Visualization:
    """Publishes a robot's path and a task's markers if the topics have subscribers.

    The process must already be a ROS node. The path (``nav_msgs/Path``) shows the motion of a moving base, or of a
    fixed arm's tool, since the start of the episode. The markers (``visualization_msgs/MarkerArray``) are the task's
    markers, and each marker uses its name as its namespace. The path and the markers are expressed in the odometry
    frame if the base moves, and otherwise in the frame of the robot's root link.

    Args:
        robot: Robot that the policy controls.
        mirror: Mirror that follows the robot.
        namespace: Namespace of the topics.
    """

    def __init__(self, robot: RosRobot, mirror: Mirror, namespace: str = "/") -> None:
        import rospy
        from nav_msgs.msg import Path
        from visualization_msgs.msg import MarkerArray

        self._robot, self._mirror = robot, mirror
        space = namespace.rstrip("/")
        self._path = rospy.Publisher(f"{space}/{PATH}", Path, queue_size=1)
        self._markers = rospy.Publisher(f"{space}/{MARKERS}", MarkerArray, queue_size=1)
        self._poses: deque[Any] = deque(maxlen=_LENGTH)
        self._spacing = _BASE_SPACING if mirror.moves else _SPACING
        self._last_pos = np.full(3, np.inf)
        self._published = -np.inf
        self._restarts = 0

    def update(self, report: Report) -> None:
        """Append the robot's measured pose to its path, and publish messages that are due.

        Args:
            report: Report of the run after the latest step of the policy. If the number of restarts has changed, a new
                path begins.
        """
        if report.restarts != self._restarts:
            self._restarts = report.restarts
            self._poses.clear()
            self._last_pos = np.full(3, np.inf)
        now = self._robot.now()
        frame = _Frame(self._robot, self._mirror)
        self._extend(frame)
        if abs(now - self._published) < _INTERVAL:
            return
        self._published = now
        if self._path.get_num_connections():
            self._path.publish(self._path.data_class(header=frame.header(), poses=list(self._poses)))
        if self._markers.get_num_connections():
            self._markers.publish(self._markers.data_class(markers=self._shapes(frame)))

    def _extend(self, frame: _Frame) -> None:
        from geometry_msgs.msg import PoseStamped

        pos, quat = self._mirror.measured_pose
        if np.linalg.norm(pos - self._last_pos) >= self._spacing:
            self._last_pos = pos
            self._poses.append(PoseStamped(frame.header(), frame.pose(pos, quat)))

    def _shapes(self, frame: _Frame) -> list[Any]:
        """Return the task's markers as a list of ``visualization_msgs/Marker``."""
        return [_sphere(frame, number, marker) for number, marker in enumerate(self._mirror.env.task.markers())]


class _Frame:
    """The frame in which messages are expressed, and the transformation from the mirror's world to this frame."""

    def __init__(self, robot: RosRobot, mirror: Mirror) -> None:
        if mirror.moves:
            self.name = robot.odom_frame
            self._place = WORLD
        else:
            handle = mirror.env.robot
            self.name = handle.model.root
            pos, quat = handle.frame_pose(self.name)
            self._place = Place(pos[0], quat[0])

    def header(self) -> Any:
        """Return a ``std_msgs/Header`` for the current time."""
        import rospy
        from std_msgs.msg import Header

        return Header(stamp=rospy.Time.now(), frame_id=self.name)

    def pose(self, pos: Floats, quat_wxyz: Floats) -> Any:
        """Convert a world pose, pos (3,) [m] and quat_wxyz (4,), to a ``geometry_msgs/Pose`` in this frame."""
        return pose_message(Place(pos, quat_wxyz).seen_from(self._place))


def _sphere(frame: _Frame, number: int, marker: Marker) -> Any:
    from geometry_msgs.msg import Vector3
    from std_msgs.msg import ColorRGBA
    from visualization_msgs.msg import Marker as Message

    return Message(
        header=frame.header(),
        ns=marker.name,
        id=number,
        type=Message.SPHERE,
        action=Message.ADD,
        pose=frame.pose(marker.pos[0], WORLD.quat_wxyz),
        scale=Vector3(*[2.0 * marker.radius] * 3),
        color=ColorRGBA(*marker.rgba),
    )
