"""A controller: behaviour. It turns an action into a joint command, once per control step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import gymnasium as gym

from frobs_core.arrays import Action, Floats, Mask
from frobs_core.interfaces.command import CommandMode
from frobs_core.interfaces.simulation import RobotHandle, Snapshot


class Controller(ABC):
    """Base class of controllers.

    A constructor takes keyword-only parameters, which are the keywords that users may give; it validates and
    stores. ``bind`` is called once, when the simulation stands.

    Attributes:
        command_mode: What its commands mean.
        action_space: Of one environment; set by ``bind``. A Box in [−1, 1] as a rule.
    """

    command_mode: ClassVar[CommandMode]
    action_space: gym.Space  # type: ignore[type-arg]

    @abstractmethod
    def bind(self, robot: RobotHandle, control_timestep: float, decimation: int) -> None:
        """Prepare for a robot: read its limits, set :attr:`action_space`, make buffers.

        Args:
            robot: Its handle.
            control_timestep: [s]
            decimation: Physics steps per control step.

        Raises:
            ConfigurationError: It cannot control this robot.
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
            (num_envs, dof), or (num_envs, decimation, dof) with a row for each physics step. The array may be
            one that the controller uses again.
        """

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
