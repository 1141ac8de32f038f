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
        super().__init__(model, topic, parameters, None, float(parameters.get("publish_rate", 50.0)))
        driven = model.description.modes if model.description.has_transmissions else model.joints
        driven = parameters.get("joints", driven)
        self._names = sorted(name for name in model.joints if name in driven)
        self._columns = [model.joints[name] for name in self._names]
        space = topic.rpartition("/")[0]
        self._publisher = self.publisher(f"{space}/joint_states", "sensor_msgs/JointState", queue_size=10)

    def tell(self, world: World) -> None:
        """Publish."""
        if self._publisher.get_num_connections() == 0:
            return
        robot = self.robot
        states = robot.joint_positions, robot.joint_velocities, robot.joint_efforts
        self._publisher.publish(
            self.header(world), self._names, *(values[0, self._columns].tolist() for values in states)
        )
