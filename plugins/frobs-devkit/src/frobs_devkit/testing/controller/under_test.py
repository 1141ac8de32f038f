"""The controller to check, bound to a robot in a small simulation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.contracts import CommandMode, Controller, RobotHandle, Simulation
from frobs_core.description import Placement, Robot, Scene
from frobs_core.kernel.compose import build, count_physics_steps
from frobs_core.models import Pose, RobotModel
from frobs_core.plugins.records import ControllerRecord, SimulatorRecord
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import ConfigurationError
from frobs_devkit.simulations import TIMESTEP, simulate
from frobs_devkit.testing.checks import Inconclusive, NotApplicable
from frobs_devkit.testing.environment.rollout import draw_actions
from frobs_devkit.testing.simulator.robots import ARM, ROVER, model_of
from frobs_devkit.testing.simulator.under_test import WEIGHTLESS

NUM_ENVS = 3

_CONTROL_TIMESTEP = 0.04  # [s], used if the record does not define a control timestep
EARTH = (0.0, 0.0, -9.81)  # [m/s²]


@dataclass
class Bound:
    """A controller that is bound to a robot in a simulation."""

    simulation: Simulation
    robot: RobotHandle
    controller: Controller
    decimation: int

    def step(self, action: Any) -> Floats:
        """Apply the actions, advance by one control step, and return the command."""
        command = np.array(self.controller.apply(action))
        self.robot.command(command)
        self.advance()
        return command

    def advance(self) -> None:
        """Advance by one control step."""
        if self.controller.rate == "physics":
            self.simulation.step_with(self.decimation, lambda: self.robot.command(self.controller.update()))
        else:
            self.simulation.step(self.decimation)

    def begin(self, mask: Mask | None = None) -> None:
        """Begin an episode by resetting the simulation and the controller, as an environment does."""
        self.simulation.reset(mask)
        self.controller.reset(mask)

    def actions(self, steps: int, seed: int) -> list[Any]:
        """Draw random actions for all environments. Row i does not depend on the number of environments."""
        space = self.controller.action_space
        drawn = [draw_actions(space, steps, seed=1000 * seed + i) for i in range(self.simulation.num_envs)]
        dtype = np.float64 if isinstance(space, gym.spaces.Box) else np.int64
        return [np.stack(rows).astype(dtype) for rows in zip(*drawn, strict=True)]

    def constant(self, value: Any) -> Floats:
        """Return the same float64 action for all environments."""
        shape = (self.simulation.num_envs, *(self.controller.action_space.shape or ()))
        return np.broadcast_to(np.asarray(value, np.float64), shape).copy()

    def middle(self) -> Any:
        """Return the action in the middle of a Box space, or a random action of another space."""
        space = self.controller.action_space
        if not isinstance(space, gym.spaces.Box):
            return self.actions(1, seed=0)[0]
        return self.constant((space.low.astype(np.float64) + space.high) / 2.0)

    def require_zero(self) -> None:
        """Raise NotApplicable unless the action space contains an action whose elements are all zero."""
        if not has_zero(self.controller.action_space):
            raise NotApplicable("the action space does not contain zero")

    def require_zero_position(self) -> gym.spaces.Box:
        """Return the action space, or raise NotApplicable unless it contains zero and the controller commands positions."""
        space = self.controller.action_space
        if not has_zero(space) or self.controller.command_mode != CommandMode.POSITION:
            raise NotApplicable("the controller does not command positions, or its action space does not contain zero")
        assert isinstance(space, gym.spaces.Box)
        return space

    def rest(self, steps: int) -> Floats:
        """Apply zero actions for several control steps, and return the last command."""
        for _ in range(steps):
            command = self.step(self.constant(0.0))
        return command

    def last(self, command: Floats) -> Floats:
        """Return the last row of a command, (num_envs, dof)."""
        return np.array(command).reshape(self.simulation.num_envs, -1, self.robot.dof)[:, -1]

    def displace(self, offset: float, velocity: float = 0.0) -> None:
        """Move all joints by an offset [rad or m] within their limits, without the controller's knowledge."""
        robot = self.robot
        positions = np.clip(robot.joint_positions + offset, robot.position_lower, robot.position_upper)
        robot.write_joint_state(positions, np.full_like(positions, velocity))

    def extremes(self, number: int) -> Iterator[Floats]:
        """Begin two episodes, and yield an action for each, with one element at its minimum and then at its maximum."""
        space = self.controller.action_space
        assert isinstance(space, gym.spaces.Box)
        for bounds in (space.low, space.high):
            action = (space.low.astype(np.float64) + space.high) / 2.0
            action.flat[number] = bounds.flat[number]
            self.begin()
            yield self.constant(action)

    def opposites(self) -> tuple[Floats, Floats]:
        """Return two different actions: the minimum and the maximum of a Box space, or two random actions."""
        space = self.controller.action_space
        if isinstance(space, gym.spaces.Box):
            return self.constant(space.low), self.constant(space.high)
        drawn = np.array(draw_actions(space, 30, seed=0))
        different = [action for action in drawn if not np.array_equal(action, drawn[0])]
        if not different:
            raise Inconclusive("the action space contains only one action")
        first, second = (np.stack([action] * self.simulation.num_envs) for action in (drawn[0], different[0]))
        return first, second


@dataclass(frozen=True)
class ControllerUnderTest:
    """The record of a controller, with the simulator, the robot and the keyword arguments for its checks.

    Attributes:
        timestep: Time between two actions, or None for the record's [s].
        physics_timestep: Duration of a physics step [s].
    """

    record: ControllerRecord
    simulator: SimulatorRecord
    robot: Robot | None = None
    kwargs: Mapping[str, Any] = field(default_factory=dict)
    timestep: float | None = None
    physics_timestep: float = TIMESTEP

    @property
    def control_timestep(self) -> float:
        """Time between two actions [s]."""
        return self.timestep or self.record.control_timestep or _CONTROL_TIMESTEP

    @property
    def decimation(self) -> int:
        """Physics steps per control step."""
        return count_physics_steps(self.control_timestep, self.physics_timestep)

    def count(self, steps: int) -> int:
        """Return ``steps``, or a smaller number of at least 3 if the control timestep is longer than the default."""
        return min(steps, max(3, round(steps * _CONTROL_TIMESTEP / self.control_timestep)))

    @contextmanager
    def bind(
        self,
        num_envs: int = NUM_ENVS,
        gravity: tuple[float, float, float] = WEIGHTLESS,
        *,
        reverse: bool = False,
        joints: tuple[str, ...] = (),
    ) -> Iterator[Bound]:
        """Bind a new controller to a new simulation, which is closed at the end of the ``with`` block.

        If ``reverse`` is True, the controller is bound to a group of all joints in reverse order. If ``joints`` are
        given, it is bound to a group of these joints.

        Raises:
            ConfigurationError: The controller cannot control the robot.
        """
        with ExitStack() as stack:
            try:
                bound = stack.enter_context(self._bind(self.robot or ARM, num_envs, gravity, reverse, joints))
            except ConfigurationError:
                if self.robot is not None:
                    raise
                bound = stack.enter_context(self._bind(ROVER, num_envs, gravity, reverse, joints))
            yield bound

    @contextmanager
    def _bind(
        self, robot: Robot, num_envs: int, gravity: tuple[float, float, float], reverse: bool, joints: tuple[str, ...]
    ) -> Iterator[Bound]:
        controller = self.new_controller()
        pose = Pose(pos=(0.0, 0.0, 0.05)) if robot is ROVER else Pose()
        placement = Placement(robot=robot, model=self.model(robot), pose=pose, command_mode=controller.command_mode)
        scene = Scene(gravity=EARTH if robot.base == "wheeled" else gravity)  # wheels need the floor
        with simulate(self.simulator, placement, scene, num_envs=num_envs, physics_timestep=self.physics_timestep) as (
            simulation,
            handle,
        ):
            controller.bind_scene(scene, simulation)
            group = handle.group(joints or handle.joint_names[::-1]) if reverse or joints else handle
            controller.bind(group, self.control_timestep, self.decimation)
            bound = Bound(simulation, handle, controller, self.decimation)
            bound.begin()
            yield bound

    def new_controller(self) -> Controller:
        """Create the controller."""
        controller: Controller = build(f"controller '{self.record.name}'", self.record.load(), self.kwargs)
        return controller

    @staticmethod
    def model(robot: Robot) -> RobotModel:
        """Return the model of a robot."""
        if robot in (ARM, ROVER):
            return model_of(robot.model)
        return robot.read_model()


def has_zero(space: gym.Space[Any]) -> bool:
    """Return whether an action space contains an action whose elements are all zero."""
    return isinstance(space, gym.spaces.Box) and bool(((space.low <= 0) & (space.high >= 0)).all())
