"""Publishes the robot's path and the task's markers, such as the goal, for display in RViz."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

import numpy as np

from frobs_core.description import Marker
from frobs_core.kernel.env import RobotEnv
from frobs_ros.bridge.poses import WORLD, Place, pose_message

if TYPE_CHECKING:
    from frobs_ros.policy_node.running import Report

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
        env: Environment in which the policy acts. Its robot is a :class:`frobs_ros.robot.handle.RosRobot`.
        namespace: Namespace of the topics.
    """

    def __init__(self, env: RobotEnv, namespace: str = "/") -> None:
        import rospy
        from nav_msgs.msg import Path
        from visualization_msgs.msg import MarkerArray

        self._env, self._robot, self._time = env, env.robot, rospy.Time
        self._moves = env.robot.robot.base != "fixed"
        space = namespace.rstrip("/")
        self._path = rospy.Publisher(f"{space}/{PATH}", Path, queue_size=1)
        self._markers = rospy.Publisher(f"{space}/{MARKERS}", MarkerArray, queue_size=1)
        self._poses: deque[Any] = deque(maxlen=_LENGTH)
        self._last_pos = np.full(3, np.inf)
        self._published = -np.inf
        self._restarts = 0

    def update(self, report: Report) -> None:
        """Append the robot's measured pose to its path, and publish messages that are due.

        Args:
            report: Report of the run after the latest step of the policy. If the number of restarts has changed, a new
                path begins.
        """
        from geometry_msgs.msg import PoseStamped

        if report.restarts != self._restarts:
            self._restarts = report.restarts
            self._poses.clear()
            self._last_pos = np.full(3, np.inf)
        stamp = self._time.now()
        header, frame = self._frame(stamp)
        pos, quat = (part[0] for part in (self._robot.base_pose if self._moves else self._robot.frame_pose("tcp")))
        if np.linalg.norm(pos - self._last_pos) >= (_BASE_SPACING if self._moves else _SPACING):
            self._last_pos = pos.copy()
            self._poses.append(PoseStamped(header, pose_message(Place(pos, quat).seen_from(frame))))
        if abs(stamp.to_sec() - self._published) < _INTERVAL:
            return
        self._published = stamp.to_sec()
        if self._path.get_num_connections():
            self._path.publish(self._path.data_class(header=header, poses=list(self._poses)))
        if self._markers.get_num_connections():
            shapes = [_sphere(header, frame, *each) for each in enumerate(self._env.task.markers())]
            self._markers.publish(self._markers.data_class(markers=shapes))

    def _frame(self, stamp: Any) -> tuple[Any, Place]:
        """Return the ``std_msgs/Header`` of messages, and the pose of their frame in the world."""
        from std_msgs.msg import Header

        if self._moves:
            return Header(stamp=stamp, frame_id=self._robot.odom_frame), WORLD  # type: ignore[attr-defined]
        root = self._robot.model.root
        return Header(stamp=stamp, frame_id=root), Place(*(part[0] for part in self._robot.frame_pose(root)))


def _sphere(header: Any, frame: Place, number: int, marker: Marker) -> Any:
    """Return a ``visualization_msgs/Marker``."""
    from geometry_msgs.msg import Vector3
    from std_msgs.msg import ColorRGBA
    from visualization_msgs.msg import Marker as Message

    return Message(
        header=header,
        ns=marker.name,
        id=number,
        type=Message.SPHERE,
        action=Message.ADD,
        pose=pose_message(Place(marker.pos[0], WORLD.quat_wxyz).seen_from(frame)),
        scale=Vector3(*[2.0 * marker.radius] * 3),
        color=ColorRGBA(*marker.rgba),
    )
