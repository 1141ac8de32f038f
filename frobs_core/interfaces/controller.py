"""A controller: behaviour. It turns an action into a joint command, once per control step."""

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

    A constructor takes keyword-only parameters, which are the keywords that users may give; it validates and
    stores. ``bind`` is called once, when the simulation stands.

    Attributes:
        command_mode: What its commands mean.
        rate: ``"control"``: one command, or one row for each physics step, per control step. ``"physics"``: the
            environment also calls :meth:`update` before every further physics step; much slower.
        action_space: Of one environment; set by ``bind``. A Box in [−1, 1] as a rule.
    """

    command_mode: ClassVar[CommandMode]
    rate: ClassVar[Literal["control", "physics"]] = "control"
    action_space: gym.Space  # type: ignore[type-arg]

    def bind_scene(self, scene: Scene, simulation: Simulation) -> None:
        """Keep what stands around the robot; called once, just before :meth:`bind`. Most controllers need none of it.

        Args:
            scene: As the task describes it.
            simulation: Tells where its bodies and further robots are now. It is read, never written or stepped.
        """

    @abstractmethod
    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare for the joints to control: read their limits, set :attr:`action_space`, make buffers.

        Args:
            joints: A group of a robot's joints, or all of them. Arrays have the group's joints in its order.
            control_timestep: [s]
            decimation: Physics steps per control step.

        Raises:
            ConfigurationError: It cannot control these joints.
        """

    @abstractmethod
    def reset(self, mask: Mask | None) -> None:
        """Forget: an episode starts. Called after the task has placed the robot."""

    @abstractmethod
    def apply(self, action: Action) -> Floats:
        """Turn actions into a joint command.

        Args:
            action: (num_envs, …) in the batched action space: float64 for a Box (finite, but not yet clipped to
                the space: clip), int64 for Discrete.

        Returns:
            (num_envs, dof), or (num_envs, decimation, dof) with a row for each physics step, where dof counts the
            joints of the group. The array may be one that the controller uses again.
        """

    def update(self) -> Floats:
        """Return the joint command of the next physics step, (num_envs, dof); for controllers at the physics rate.

        Called before each physics step of a control step but the first, whose command :meth:`apply` has returned. The
        state that the group reports is that of the last physics step.

        Raises:
            PluginError: The controller has the rate ``"physics"`` and does not define this method.
        """
        raise PluginError(f"{type(self).__name__} has rate 'physics', so it must define update().")

    def info(self) -> Mapping[str, np.ndarray[Any, Any]]:
        """Return what the last :meth:`apply` has to say, as numbers (num_envs,) by name, with the same names each time.

        ``"plan_success"`` is ``"frobs/plan_success"`` in the step's info. A name that ends in ``_time`` is what a clock
        measured: it alone need not repeat with the seed. A controller that does not override this costs a step nothing.
        """
        return {}

    @property
    def max_action_change(self) -> Floats | None:
        """How far an action may change in a control step for the joints to follow, in the action space's shape.

        By the joints' velocity limits, inf where there is none; None where actions are no joint positions.
        """
        return None

    def snapshot(self) -> Snapshot:
        """Return what ``apply`` depends on beside its argument and the simulation."""
        return {}

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""


class ControllerWrapper(Controller):
    """A controller that changes the actions of another one, which it need not know.

    A subclass sets :attr:`action_space` in ``bind`` and changes the action in ``apply``; everything else is that of the
    wrapped controller.

    Args:
        inner: The wrapped controller.

    Attributes:
        inner: The wrapped controller.
    """

    def __init__(self, inner: Controller) -> None:
        self.inner = inner
        self.command_mode, self.rate = inner.command_mode, inner.rate  # type: ignore[misc] # of the wrapped controller
        # An environment asks only for what a controller overrides; so does a wrapper.
        self.bind_scene, self.update, self.info = inner.bind_scene, inner.update, inner.info  # type: ignore[method-assign]

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Bind the wrapped controller and take its action space."""
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
        """That of the wrapped controller."""
        return self.inner.max_action_change

    def snapshot(self) -> Snapshot:
        """Return the state of the wrapped controller."""
        return self.inner.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""
        self.inner.restore(snapshot)
