"""Topics ``/tf`` and ``/tf_static`` for the initial robot. Robots spawned later require a separate state publisher."""

from __future__ import annotations

import numpy as np

from frobs_ros.bridge.component import Component, stamp
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.world import World
from frobs_ros.ros.state_publisher import FREQUENCY, read_joints, split, to_message


class Transforms(Component):
    """Publisher of each joint's transform from the parent link to the child link.

    Args:
        model: The robot.
        urdf: URDF of the robot, which clients read as ``robot_description``.
    """

    def __init__(self, model: Model, urdf: str) -> None:
        import rospy

        super().__init__(FREQUENCY)
        self._model = model
        self._moving, fixed = split(read_joints(urdf, model.name))
        self._tf = self.publisher("/tf", "tf2_msgs/TFMessage", queue_size=100)
        static = self.publisher("/tf_static", "tf2_msgs/TFMessage", queue_size=100, latch=True)
        static.publish(to_message(fixed, np.zeros(len(fixed.joints)), rospy.Time()))

    def tell(self, world: World) -> None:
        """Publish the transforms of moving joints if there are subscribers."""
        robot = self._model.robot
        if robot is None or not self._moving.joints or not self._tf.get_num_connections():
            return
        joint_positions = dict(zip(robot.joint_names, robot.joint_positions[0].tolist(), strict=True))
        positions = self._moving.positions(joint_positions)
        self._tf.publish(to_message(self._moving, positions, stamp(world.time_ns)))
