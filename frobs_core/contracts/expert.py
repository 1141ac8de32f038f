"""Experts: scripted policies that show that a task is solvable and generate demonstrations."""

from __future__ import annotations

from abc import ABC, abstractmethod
from importlib import import_module
from typing import TYPE_CHECKING, cast

from frobs_core.util.arrays import Action, Mask

if TYPE_CHECKING:
    from frobs_core.kernel.env import RobotEnv
    from frobs_core.kernel.vector_env import RobotVectorEnv


class Expert(ABC):
    """Base class of experts. A task names its expert in :attr:`Task.expert <frobs_core.contracts.Task.expert>`.

    An expert may read the whole state of the environment, including the task, the simulation and the controllers, but
    must not change anything. An expert is created before the first reset, when the environment does not yet have a
    state.

    Args:
        env: Unwrapped environment with the task. A single environment is treated as a batch of size 1.

    Raises:
        ConfigurationError: The expert cannot use the environment's controllers.
    """

    @abstractmethod
    def __init__(self, env: RobotEnv | RobotVectorEnv) -> None: ...

    @abstractmethod
    def act(self, episode_start: Mask) -> Action:
        """Return actions for the current state, (num_envs, …).

        Args:
            episode_start: (num_envs,) bool, True for environments whose episode has just begun.
        """


def load_expert(env: RobotEnv | RobotVectorEnv) -> Expert | None:
    """Return the expert of the environment's task, or None if the task has none.

    Raises:
        ConfigurationError: The expert cannot use the environment's controllers.
    """
    if not env.task.expert:
        return None
    module, _, name = env.task.expert.partition(":")
    return cast("Expert", getattr(import_module(module), name)(env))
