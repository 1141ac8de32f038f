"""A controller of ros_control: it publishes states, or sets what joints follow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.errors import UnknownNameError
from frobs_core.interfaces import CommandMode, RobotHandle
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
    """Base class. All but the constructor and what listens to topics runs in the loop's thread.

    Args:
        topic: Namespace of its topics: the robot's, and its own name.
        parameters: What the parameter server holds there.
        interface: What it claims of its joints; None: nothing.
        rate: At which it publishes [Hz]; 0: never.

    Attributes:
        joints: Names of those that it commands.
        columns: (k,) their places in the robot's joint arrays.
    """

    def __init__(
        self, model: Model, topic: str, parameters: Mapping[str, Any], interface: CommandMode | None, rate: float = 0.0
    ) -> None:
        super().__init__(rate)
        self.model, self.topic, self.parameters, self.interface = model, topic, parameters, interface
        self.joints: tuple[str, ...] = ()
        self.columns = np.zeros(0, np.intp)

    @property
    def robot(self) -> RobotHandle:
        """The robot's handle, which is another after the world has changed."""
        assert self.model.robot is not None
        return self.model.robot

    def claim(self, joints: Sequence[str]) -> None:
        """Say which joints it commands.

        Raises:
            UnknownNameError: The robot has no such joint.
            ConfigurationError: A joint is not driven so, or there is none.
        """
        if not joints:
            raise ControllerError(self.topic, "names no joint.")
        for name in joints:
            if name not in self.model.joints:
                raise UnknownNameError(f"actuated joint of '{self.model.name}'", name, self.model.joints)
            offered = self.model.description.modes.get(name)
            if self.model.description.has_transmissions and offered is not self.interface:
                driven = "is driven by nothing" if offered is None else f"offers {INTERFACES[offered]} alone"
                raise ControllerError(
                    self.topic,
                    f"needs {INTERFACES[self.interface or CommandMode.EFFORT]} of joint "
                    f"'{name}', which {driven}: see its <transmission>.",
                )
        self.joints = tuple(joints)
        self.columns = np.array([self.model.joints[name] for name in joints], np.intp)

    def positions(self) -> Floats:
        """(k,) of its joints [rad or m]."""
        found: Floats = self.robot.joint_positions[0, self.columns]
        return found

    def velocities(self) -> Floats:
        """(k,) of its joints [rad/s or m/s]."""
        found: Floats = self.robot.joint_velocities[0, self.columns]
        return found

    def command(self, values: Floats) -> None:
        """Let its joints follow (k,) values in its own interface."""
        self.model.drive.targets[self.columns] = values

    def start(self, world: World) -> None:
        """Take over the joints, which hold until something is commanded."""
        if self.interface is not None:
            for column in self.columns.tolist():
                self.model.drive.set_mode(column, self.interface, self.robot)
        self._next_ns = world.time_ns

    def stop(self, world: World) -> None:
        """Give the joints back; they hold."""
        if self.interface is not None:
            for column in self.columns.tolist():
                self.model.drive.set_mode(column, self.model.drive.modes[column], self.robot)

    def reset(self, world: World) -> None:
        """Begin anew: the robot is back where it was spawned."""
        self.start(world)
        self._last_stamp_ns = -1


def listed(parameters: Mapping[str, Any], *names: str) -> list[str]:
    """Return the names that the first of several parameters holds, which may be one or a list."""
    given: Any = next((parameters[name] for name in names if name in parameters), [])
    return [given] if isinstance(given, str) else [str(name) for name in given]
