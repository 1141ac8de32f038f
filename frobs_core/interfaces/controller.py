"""A controller: behaviour. It turns an action into a joint command, once per control step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np

from frobs_core.arrays import Action, Floats, Mask
from frobs_core.interfaces.command import CommandMode
from frobs_core.interfaces.scene import Scene
from frobs_core.interfaces.simulation import RobotHandle, Simulation, Snapshot


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

    def bind_scene(self, scene: Scene, simulation: Simulation) -> None:
        """Keep what stands around the robot; called once, just before :meth:`bind`. Most controllers need none of it.

        Args:
            scene: As the task describes it.
            simulation: Tells where its bodies and further robots are now. It is read, never written or stepped.
        """

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
