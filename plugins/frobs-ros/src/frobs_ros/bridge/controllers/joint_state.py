"""The controller joint_state_controller/JointStateController, which publishes joint states."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from frobs_ros.bridge.controllers.controller import Controller
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.world import World


class JointStateController(Controller):
    """Controller that publishes joint positions, velocities and efforts on the robot's ``joint_states`` topic.

    The joints are sorted by name, as in ros_control. If the robot's file contains transmissions, only joints with a
    transmission are published. Otherwise, all actuated joints are published.
    """

    def __init__(self, model: Model, topic: str, parameters: Mapping[str, Any]) -> None:
        import rospy
        from sensor_msgs.msg import JointState

        super().__init__(model, topic, parameters, None, float(parameters.get("publish_rate", 50.0)))
        driven = model.description.modes if model.description.has_transmissions else model.joints
        driven = parameters.get("joints", driven)
        self._names = sorted(name for name in model.joints if name in driven)
        self._columns = [model.joints[name] for name in self._names]
        space = topic.rpartition("/")[0]
        self._publisher = self.own(
            rospy.Publisher(f"{space}/joint_states", JointState, queue_size=10, tcp_nodelay=True)
        )
        self._message = JointState

    def tell(self, world: World) -> None:
        """Publish."""
        if self._publisher.get_num_connections() == 0:
            return
        message, robot = self._message(), self.robot
        message.header.stamp = self.next_stamp(world)
        message.name = self._names
        message.position = robot.joint_positions[0, self._columns].tolist()
        message.velocity = robot.joint_velocities[0, self._columns].tolist()
        message.effort = robot.joint_efforts[0, self._columns].tolist()
        self._publisher.publish(message)
