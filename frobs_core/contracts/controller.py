"""The interface for controllers, which convert an action into a joint command once per control step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import gymnasium as gym
import numpy as np

from frobs_core.contracts.joint_group import JointGroup
from frobs_core.contracts.simulation import Simulation
from frobs_core.contracts.stateful import Stateful
from frobs_core.description.robot import CommandMode
from frobs_core.description.scene import Scene
from frobs_core.util.arrays import Action, Floats, Mask
from frobs_core.util.errors import PluginError


class Controller(Stateful, ABC):
    """Base class of controllers.

    The constructor validates and stores keyword-only parameters, which users set through ``controller_kwargs``.
    ``bind`` is called once, after the simulation is built.

    Attributes:
        command_mode: Meaning of the controller's commands.
        rate: How often the controller computes commands. With ``"control"``, the controller computes one command per
            control step, which may have one row for each physics step. With ``"physics"``, the environment also calls
            :meth:`update` before each subsequent physics step, which is much slower.
        action_space: Action space of a single environment, set by ``bind``. Usually a Box in [−1, 1].
    """

    command_mode: ClassVar[CommandMode]
    rate: ClassVar[Literal["control", "physics"]] = "control"
    action_space: gym.Space  # type: ignore[type-arg]

    def bind_scene(self, scene: Scene, simulation: Simulation) -> None:
        """Store references to the robot's surroundings.

        Called once, just before :meth:`bind`. Most controllers do not need to override this method.

        Args:
            scene: The scene that the task describes.
            simulation: Simulation that provides the current poses of the scene's bodies and the other robots. Treat the
                simulation as read-only: never write to it or step it.
        """

    @abstractmethod
    def bind(self, joints: JointGroup, control_timestep: float, decimation: int) -> None:
        """Prepare to control joints: read their limits, set :attr:`action_space`, and allocate buffers.

        Args:
            joints: Group of joints to control, which contains some or all of a robot's joints. Joint arrays are in the
                order of the group.
            control_timestep: [s]
            decimation: Physics steps per control step.

        Raises:
            ConfigurationError: The controller cannot control these joints.
        """

    @abstractmethod
    def reset(self, mask: Mask | None) -> None:
        """Reset the internal state of the environments selected by ``mask``, whose episode begins.

        Called after the task has placed the robot.
        """

    @abstractmethod
    def apply(self, action: Action) -> Floats:
        """Convert actions into a joint command.

        Args:
            action: Actions in the batched action space, (num_envs, …): float64 for a Box, int64 for Discrete. Box
                actions are finite but may lie outside the space, so the controller must clip them.

        Returns:
            The command, (num_envs, dof), or (num_envs, decimation, dof) with one row for each physics step, where dof
            is the number of joints in the group. The controller may reuse the array in the next call.
        """

    def update(self) -> Floats:
        """Return the joint command for the next physics step, (num_envs, dof).

        If the rate is ``"physics"``, the environment calls this method before each physics step of a control step
        except the first, whose command is returned by :meth:`apply`. The joint group then contains the state after the
        latest physics step.

        Raises:
            PluginError: The controller has the rate ``"physics"`` but does not override this method.
        """
        raise PluginError(f"{type(self).__name__} has rate 'physics', so it must implement update().")

    def info(self) -> Mapping[str, np.ndarray[Any, Any]]:
        """Return metrics of the last :meth:`apply` by name, (num_envs,) each. The names must never change.

        The environment adds the prefix ``"frobs/"``: the metric ``"plan_success"`` becomes ``"frobs/plan_success"`` in
        the step's ``info``. Metrics whose names end in ``_time`` are measured wall-clock times, which need not be
        reproducible. The environment calls this method only if a subclass overrides it.
        """
        return {}

    def law(self) -> Mapping[str, Any]:
        """Return the law of the controller and its numbers, with which another program can compute the same commands.

        Returns:
            Plain Python types that can be written as JSON: ``law`` (name of the law), ``joints`` (names of the
            controlled joints), and the numbers of the law for the first environment, which may be infinite. Empty if
            the controller does not describe its law.
        """
        return {}

    @property
    def max_action_change(self) -> Floats | None:
        """Return the largest action change per control step that the joints can follow, with the action space's shape.

        The values are derived from the joints' velocity limits and are inf for joints without a limit. Return None if
        actions are not joint positions.
        """
        return None
