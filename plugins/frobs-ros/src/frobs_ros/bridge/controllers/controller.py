"""Base class of ros_control controllers, which publish states or command joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from frobs_core.contracts import CommandMode, RobotHandle
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import check_name
from frobs_ros.bridge.component import Component
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.world import World
from frobs_ros.errors import ControllerError

INTERFACES = {
    CommandMode.POSITION: "hardware_interface::PositionJointInterface",
    CommandMode.VELOCITY: "hardware_interface::VelocityJointInterface",
    CommandMode.EFFORT: "hardware_interface::EffortJointInterface",
}


class Controller(Component):
    """Base class of controllers.

    Except for the constructor and topic callbacks, all methods run in the simulation thread.

    Args:
        topic: Namespace of the controller's topics: the robot's namespace followed by the controller's name.
        parameters: The controller's parameters from the ROS parameter server.
        interface: Joint interface that the controller claims, or None if the controller only reads states.
        rate: Publishing rate [Hz], or 0 to disable publishing.

    Attributes:
        joints: Names of the joints that the controller commands.
        columns: (k,) indices of the commanded joints in the robot's joint arrays.
        kind: Type of the controller in ros_control.
        state: ``"initialized"``, ``"running"`` or ``"stopped"``.
    """

    kind = ""
    state = "initialized"

    def __init__(
        self, model: Model, topic: str, parameters: Mapping[str, Any], interface: CommandMode | None, rate: float = 0.0
    ) -> None:
        super().__init__(rate)
        self.model, self.topic, self.parameters, self.interface = model, topic, parameters, interface
        self.joints: tuple[str, ...] = ()
        self.columns = np.zeros(0, np.intp)

    @property
    def robot(self) -> RobotHandle:
        """Handle of the robot."""
        return self.model.handle

    def claim(self, joints: Sequence[str]) -> None:
        """Set the joints that the controller commands.

        Raises:
            UnknownNameError: One of the names is not an actuated joint of the robot.
            ConfigurationError: The list is empty, or a joint does not provide the controller's interface.
        """
        if not joints:
            raise ControllerError(self.topic, "the list of joints is empty; set at least one joint.")
        for name in joints:
            check_name(f"actuated joint of '{self.model.name}'", name, self.model.joints)
            offered = self.model.description.modes.get(name)
            if self.model.description.has_transmissions and offered is not self.interface:
                driven = "has no transmission" if offered is None else f"has only {INTERFACES[offered]}"
                raise ControllerError(
                    self.topic,
                    f"the joint interface {INTERFACES[self.interface or CommandMode.EFFORT]} is required, but joint "
                    f"'{name}' {driven}; check the joint's <transmission>.",
                )
        self.joints = tuple(joints)
        self.columns = np.array([self.model.joints[name] for name in joints], np.intp)

    def positions(self) -> Floats:
        """Return the (k,) positions of the commanded joints [rad or m]."""
        found: Floats = self.robot.joint_positions[0, self.columns]
        return found

    def velocities(self) -> Floats:
        """Return the (k,) velocities of the commanded joints [rad/s or m/s]."""
        found: Floats = self.robot.joint_velocities[0, self.columns]
        return found

    def command(self, values: Floats) -> None:
        """Set the (k,) targets of the joints: positions, velocities or efforts, depending on the interface."""
        self.model.joint_targets.targets[self.columns] = values

    def start(self, world: World) -> None:
        """Take control of the joints and hold their current state until a command arrives."""
        if self.interface is not None:
            for column in self.columns.tolist():
                self.model.joint_targets.set_mode(column, self.interface, self.robot)
        self._next_ns = world.time_ns

    def stop(self, world: World) -> None:
        """Release the joints, and set their targets to the current position, zero velocity or zero effort."""
        if self.interface is not None:
            for column in self.columns.tolist():
                self.model.joint_targets.set_mode(column, self.model.joint_targets.modes[column], self.robot)

    def reset(self, world: World) -> None:
        """Restart the controller after the robot was reset to its spawn pose."""
        self.start(world)
        self._last_stamp_ns = -1


def listed(parameters: Mapping[str, Any], *names: str) -> list[str]:
    """Return the first parameter in ``names`` that is set, as a list. A single string becomes a list with one name."""
    given: Any = next((parameters[name] for name in names if name in parameters), [])
    return [given] if isinstance(given, str) else [str(name) for name in given]
