"""Controller whose discrete actions select moves of another controller."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import gymnasium as gym
import numpy as np

from frobs_core import plugins
from frobs_core.contracts import Controller, JointGroup, Snapshot
from frobs_core.kernel.compose import build
from frobs_core.plugins.records import ControllerRecord
from frobs_core.util.arrays import Action, Floats, Mask
from frobs_core.util.errors import IncompatibleSpaceError, InvalidActionError, ParameterValueError
from frobs_core.util.validation import positive


class ControllerWrapper(Controller):
    """A controller that modifies actions before passing them to another controller.

    A subclass sets :attr:`action_space` in ``bind`` and modifies the action in ``apply``. All other methods are
    delegated to the wrapped controller.

    Args:
        inner: The wrapped controller.

    Attributes:
        inner: The wrapped controller.
    """

    def __init__(self, inner: Controller) -> None:
        self.inner = inner
        self.command_mode, self.rate = inner.command_mode, inner.rate  # type: ignore[misc] # ClassVars, set per instance

        # The environment calls optional methods only if a controller overrides them, so delegate by assignment.
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
        """Return the wrapped controller's value."""
        return self.inner.max_action_change

    def snapshot(self) -> Snapshot:
        """Return the state of the wrapped controller."""
        return self.inner.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot."""
        self.inner.restore(snapshot)


class Discrete(ControllerWrapper):
    """Wrapper that provides 2·k + 1 discrete moves of a controller with k action components.

    Move 0 sets all action components to 0. Move 1 + 2·i sets component i to a negative value, and move 2 + 2·i sets
    component i to a positive value. The other components are 0.

    Args:
        controller: Name or record of the wrapped controller, which moves the robot.
        magnitude: Size of each move as a fraction, in (0, 1], of the action component's limit in the direction of the
            move.
        controller_kwargs: Parameters of the wrapped controller.

    Raises:
        UnknownNameError: The controller does not exist.
        UnknownParameterError: ``controller_kwargs`` contains a parameter that the controller does not have.
    """

    def __init__(
        self,
        *,
        controller: str | ControllerRecord = "joint_delta_position",
        magnitude: float = 1.0,
        controller_kwargs: Mapping[str, Any] | None = None,
    ) -> None:
        self.magnitude = positive("discrete: magnitude", magnitude, "1")
        if self.magnitude > 1.0:
            raise ParameterValueError("magnitude", magnitude, "in (0, 1]", "discrete")
        if not isinstance(controller, str | ControllerRecord):
            raise ParameterValueError("controller", controller, "the name or record of a controller", "discrete")
        if controller_kwargs is not None and not isinstance(controller_kwargs, Mapping):
            raise ParameterValueError(
                "controller_kwargs", controller_kwargs, "a mapping of parameters to values", "discrete"
            )
        record = cast(
            ControllerRecord,
            plugins.get_record("controller", controller) if isinstance(controller, str) else controller,
        )
        self._name = record.name
        super().__init__(build(f"controller '{record.name}'", record.load(), controller_kwargs or {}))

    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare to control the given joints.

        Raises:
            ConfigurationError: The wrapped controller cannot control the robot, or its action space is not a bounded
                Box that contains 0.
        """
        self.inner.bind(joints, control_timestep, decimation)
        box = self.inner.action_space
        if not (isinstance(box, gym.spaces.Box) and len(box.shape) == 1 and box.is_bounded()):
            raise IncompatibleSpaceError(
                "discrete:",
                box,
                f"the controller '{self._name}' has the action space {box}; only controllers with a bounded, "
                "one-dimensional Box are supported.",
            )
        if (box.low > 0.0).any() or (box.high < 0.0).any():
            raise IncompatibleSpaceError(
                "discrete:",
                box,
                f"the action space of the controller '{self._name}' does not contain 0, so the robot could not stay in "
                "place.",
            )
        count = box.shape[0]
        self._moves = np.zeros((2 * count + 1, count))  # each row is an action of the wrapped controller
        for i in range(count):
            self._moves[1 + 2 * i, i] = self.magnitude * box.low[i]
            self._moves[2 + 2 * i, i] = self.magnitude * box.high[i]
        self.action_space = gym.spaces.Discrete(2 * count + 1)

    def apply(self, action: Action) -> Floats:
        """Return the wrapped controller's command for move numbers (num_envs,) int64.

        Raises:
            InvalidActionError: A move number is out of range.
        """
        count = len(self._moves)
        if np.count_nonzero((action < 0) | (action >= count)):  # NumPy would count a negative index from the end
            raise InvalidActionError(
                f"discrete: actions must be in the range [0, {count - 1}], but they are {action.tolist()}."
            )
        return self.inner.apply(self._moves.take(action, axis=0))

    @property
    def max_action_change(self) -> None:
        """This property is always None, because actions are move numbers instead of joint positions."""
        return None
