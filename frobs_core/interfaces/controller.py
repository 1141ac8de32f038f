"""The interface of controllers, which convert an action into a joint command once per control step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import gymnasium as gym
import numpy as np

from frobs_core.arrays import Action, Floats, Mask
from frobs_core.errors import PluginError
from frobs_core.interfaces.command import CommandMode
from frobs_core.interfaces.joint_group import JointGroup
from frobs_core.interfaces.scene import Scene
from frobs_core.interfaces.simulation import Simulation, Snapshot


class Controller(ABC):
    """Base class of controllers.

    The constructor takes keyword-only parameters, which users set as keywords; it validates and stores them. ``bind``
    is called once, after the simulation is built.

    Attributes:
        command_mode: Meaning of its commands.
        rate: ``"control"``: one command per control step, which may have one row for each physics step. ``"physics"``:
            the environment also calls :meth:`update` before each subsequent physics step, which is much slower.
        action_space: Action space of a single environment; set by ``bind``. Usually a Box in [−1, 1].
    """

    command_mode: ClassVar[CommandMode]
    rate: ClassVar[Literal["control", "physics"]] = "control"
    action_space: gym.Space  # type: ignore[type-arg]

    def bind_scene(self, scene: Scene, simulation: Simulation) -> None:
        """Store the robot's surroundings. Called once, just before :meth:`bind`; most controllers do not need it.

        Args:
            scene: The scene that the task describes.
            simulation: Provides the current poses of the scene's bodies and the other robots. Treat it as
                read-only: never write to it or step it.
        """

    @abstractmethod
    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare to control joints: read their limits, set :attr:`action_space`, allocate buffers.

        Args:
            joints: A group of a robot's joints, or all of them. Arrays contain the group's joints in its order.
            control_timestep: [s]
            decimation: Physics steps per control step.

        Raises:
            ConfigurationError: The controller cannot control these joints.
        """

    @abstractmethod
    def reset(self, mask: Mask | None) -> None:
        """Reset the internal state at the start of an episode. Called after the task has placed the robot."""

    @abstractmethod
    def apply(self, action: Action) -> Floats:
        """Convert actions into a joint command.

        Args:
            action: (num_envs, …) in the batched action space: float64 for a Box, int64 for Discrete. Box actions are
                finite but not clipped to the space, so clip them.

        Returns:
            (num_envs, dof), or (num_envs, decimation, dof) with one row for each physics step, where dof is the number
            of joints in the group. The controller may reuse the array in the next call.
        """

    def update(self) -> Floats:
        """Return the joint command for the next physics step, (num_envs, dof).

        If the rate is ``"physics"``, this is called before each physics step of a control step except the first, whose
        command is returned by :meth:`apply`. The joint group has the state after the latest physics step.

        Raises:
            PluginError: The controller has the rate ``"physics"`` and does not define this method.
        """
        raise PluginError(f"{type(self).__name__} has rate 'physics', so it must implement update().")

    def info(self) -> Mapping[str, np.ndarray[Any, Any]]:
        """Return metrics of the last :meth:`apply` by name, (num_envs,) each. The names must never change.

        The step's ``info`` contains ``"plan_success"`` as ``"frobs/plan_success"``. Names that end in ``_time`` denote
        measured wall-clock time, so they need not be reproducible. Unless you override this method, it costs no time
        per step.
        """
        return {}

    @property
    def max_action_change(self) -> Floats | None:
        """Return the largest action change per control step that the joints can follow, in the action space's shape.

        It follows from the joints' velocity limits and is inf for joints without one. Return None if actions are not
        joint positions.
        """
        return None

    def snapshot(self) -> Snapshot:
        """Return the internal state on which ``apply`` depends, apart from its argument and the simulation."""
        return {}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""


class ControllerWrapper(Controller):
    """A controller that modifies the actions of any other controller.

    A subclass sets :attr:`action_space` in ``bind`` and changes the action in ``apply``. Everything else is delegated
    to the wrapped controller.

    Args:
        inner: The wrapped controller.

    Attributes:
        inner: The wrapped controller.
    """

    def __init__(self, inner: Controller) -> None:
        self.inner = inner
        self.command_mode, self.rate = inner.command_mode, inner.rate  # type: ignore[misc] # of the wrapped controller
        # # The environment calls optional methods only if a controller overrides them; so does a wrapper.
        self.bind_scene, self.update, self.info = inner.bind_scene, inner.update, inner.info  # type: ignore[method-assign]

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Bind the wrapped controller and use its action space."""
        self.inner.bind(joints, control_timestep, decimation)
        self.action_space = self.inner.action_space

    def reset(self, mask: Mask | None) -> None:
        """Reset the wrapped controller."""
        self.inner.reset(mask)

    def apply(self, action: Action) -> Floats:
        """Return the command of the wrapped controller."""
        return self.inner.apply(action)

    @property
    def max_action_change(self) -> Floats | None:
        """Return the value of the wrapped controller."""
        return self.inner.max_action_change

    def snapshot(self) -> Snapshot:
        """Return the state of the wrapped controller."""
        return self.inner.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""
        self.inner.restore(snapshot)
