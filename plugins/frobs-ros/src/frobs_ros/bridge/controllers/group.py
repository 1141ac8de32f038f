"""Controllers that follow the latest command for a single joint or a group of joints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from frobs_core.contracts import CommandMode
from frobs_core.models import JointType
from frobs_core.util.arrays import Floats
from frobs_ros.bridge import LOG
from frobs_ros.bridge.controllers.controller import Controller, listed
from frobs_ros.bridge.controllers.pid import Pid
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.world import World


class Commanded(Controller):
    """Controller that follows the ``command`` topic: Float64 for one joint, or Float64MultiArray for a group.

    Args:
        parameters: ``joint``, or ``joints`` for a group.
        interface: Joint interface that the controller claims: position, velocity or effort.
    """

    def __init__(
        self,
        model: Model,
        topic: str,
        parameters: Mapping[str, Any],
        interface: CommandMode,
        group: bool,
        rate: float = 0.0,
    ) -> None:
        super().__init__(model, topic, parameters, interface, rate)
        self.claim(listed(parameters, "joints" if group else "joint", "joint_name"))
        self._wanted: Floats | None = None
        self._runs = False
        kind = "std_msgs/Float64MultiArray" if group else "std_msgs/Float64"
        self.subscribe(f"{topic}/command", kind, self._take)

    def _take(self, message: Any) -> None:
        """Store a received command. Called in a rospy thread."""
        values = np.atleast_1d(np.asarray(message.data, np.float64))
        if values.shape != (len(self.joints),) or not np.isfinite(values).all():
            LOG.error(
                "%s/command: ignored %s; expected %d finite numbers", self.topic, values.tolist(), len(self.joints)
            )
        elif self._runs:  # commands that arrive before the controller starts are ignored
            self._wanted = values

    def start(self, world: World) -> None:
        """Take control of the joints."""
        super().start(world)
        self._wanted, self._runs = None, True

    def stop(self, world: World) -> None:
        """Release the joints."""
        self._runs = False
        super().stop(world)

    def before(self, world: World, steps: int) -> None:
        """Set the joints' targets to the latest command."""
        requested, self._wanted = self._wanted, None
        if requested is None:
            return
        if self.interface is CommandMode.POSITION:
            robot = self.robot
            requested = np.clip(requested, robot.position_lower[0, self.columns], robot.position_upper[0, self.columns])
        self.command(requested)


class Regulated(Commanded):
    """Controller that follows position or velocity commands with a PID loop at every physics step.

    For a single joint, the ``pid`` parameter contains the gains, and the controller publishes its state on the
    ``state`` topic. For a group, the ``<joint>/pid`` parameter contains the gains of each joint.

    Args:
        parameters: ``joint`` or ``joints``, and gains.
        follows: Whether the commands are positions or velocities.
    """

    def __init__(
        self,
        model: Model,
        topic: str,
        parameters: Mapping[str, Any],
        interface: CommandMode,
        group: bool,
        follows: CommandMode,
    ) -> None:
        super().__init__(model, topic, parameters, interface, group, rate=0.0 if group else 50.0)
        self._follows = follows
        gains = [parameters.get(joint, {}) for joint in self.joints] if group else [parameters]
        self._pid = Pid([given.get("pid", {}) for given in gains], f"the controller {topic}")
        joints = {joint.name: joint for joint in model.description.placement.model.joints}  # type: ignore[union-attr]
        self._turns = np.array([joints[name].type is JointType.CONTINUOUS for name in self.joints])
        self._target = np.zeros(len(self.joints))
        self._effort = np.zeros(len(self.joints))
        self._state = None if group else self.publisher(f"{topic}/state", "control_msgs/JointControllerState")

    def most_steps(self, world: World) -> int | None:
        """Return 1, because the controller requires the state at each physics step."""
        return 1

    def start(self, world: World) -> None:
        """Take control of the joints, with their current positions or zero velocity as the target."""
        super().start(world)
        self._pid.reset()
        self._last_stamp_ns = -1
        self._target = self.positions().copy() if self._follows is CommandMode.POSITION else np.zeros(len(self.joints))

    def before(self, world: World, steps: int) -> None:
        requested, self._wanted = self._wanted, None
        if requested is not None:
            self._target = requested
        if self._follows is CommandMode.POSITION:
            error, rate = self._error(), -self.velocities()
        else:
            error, rate = self._target - self.velocities(), np.zeros(len(self.joints))
        self._effort = self._pid(error, rate, world.timestep * steps)
        self.command(self._effort)

    def _error(self) -> Floats:
        """Return target minus position, wrapped to [-π, π) for continuous joints."""
        error = self._target - self.positions()
        turned: Floats = np.where(self._turns, (error + np.pi) % (2.0 * np.pi) - np.pi, error)
        return turned

    def tell(self, world: World) -> None:
        """Publish the state."""
        if self._state is None or self._state.get_num_connections() == 0:
            return
        value = self.positions()[0] if self._follows is CommandMode.POSITION else self.velocities()[0]
        self._state.publish(
            header=self.header(world),
            set_point=self._target[0],
            process_value=value,
            process_value_dot=self.velocities()[0],
            error=self._target[0] - value,
            time_step=world.timestep,
            command=self._effort[0],
            p=self._pid.p[0],
            i=self._pid.i[0],
            d=self._pid.d[0],
            i_clamp=self._pid.clamp[0],
        )
