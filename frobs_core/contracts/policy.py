"""Contract of everything that acts: trained networks, scripted experts, random actions and people at a keyboard."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Mapping
from importlib import import_module
from typing import Any, TypeAlias, cast

import gymnasium as gym
import numpy as np

from frobs_core.contracts.task import Task
from frobs_core.deprecation import deprecated, warn_deprecated
from frobs_core.description.observation_term import Observation
from frobs_core.util.arrays import Action, Mask

Environment: TypeAlias = gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]
"""A single or vector environment."""


class Policy(ABC):
    """Base class of policies. :func:`frobs_core.load_policy` opens a policy by name or path.

    A policy acts in all environments of a vector environment at once. A single environment is treated as a batch of
    size 1. Whatever a policy remembers about an episode lives in the policy, one row per environment.
    """

    def bind(self, env: Environment) -> None:
        """Prepare to act in an environment. Called once, before the environment's first reset.

        Args:
            env: Environment in which the policy will act, possibly wrapped. The policy must not change it.

        Raises:
            FrobsError: The policy cannot act in this environment.
        """

    @abstractmethod
    def act(self, observation: Observation, episode_start: Mask) -> Action:
        """Return actions for the current state, (num_envs, …).

        Args:
            observation: Batch of observations, in the format of the observation space. Each array has the shape
                (num_envs, …).
            episode_start: (num_envs,) bool, True for environments whose episode has just begun. The policy forgets
                previous episodes of these environments.
        """

    def info(self) -> Mapping[str, np.ndarray[Any, Any]]:
        """Return facts about the latest actions, such as the phase of an expert, (num_envs, …) each."""
        return {}

    def close(self) -> None:
        """Release devices, windows and files. May be called more than once."""


class Expert(Policy):
    """Base class of scripted policies, which show that a task is solvable and generate demonstrations.

    A task names its expert in :attr:`Task.expert <frobs_core.contracts.Task.expert>`. An expert may read the whole state
    of ``env.unwrapped`` in :meth:`bind`, including the task, the simulation and the controllers, but must not change
    anything.
    """


class _ExpertOfVersion02(Policy):
    """Adapter for experts whose constructor takes the environment and whose ``act`` takes only ``episode_start``."""

    def __init__(self, cls: type[Any]) -> None:
        self._class = cls

    def bind(self, env: Environment) -> None:
        name = f"{self._class.__module__}.{self._class.__qualname__}"
        warn_deprecated(
            f"the expert {name} with __init__(env) and act(episode_start)",
            instead="bind(env) and act(observation, episode_start)",
            since="0.3",
            removed_in="0.4",
        )
        self.expert = self._class(env.unwrapped)

    def act(self, observation: Observation, episode_start: Mask) -> Action:
        return cast("Action", self.expert.act(episode_start))


def bound_expert(env: Environment) -> Policy | None:
    """Return the expert of an environment's task, ready to act, or None if there is none.

    Raises:
        ConfigurationError: The expert cannot use the environment's controllers.
    """
    task = getattr(env.unwrapped, "task", None)
    if not isinstance(task, Task) or not task.expert:
        return None
    module, _, name = task.expert.partition(":")
    cls = getattr(import_module(module), name)
    expert: Policy = cls() if len(inspect.signature(cls.act).parameters) > 2 else _ExpertOfVersion02(cls)
    expert.bind(env)
    return expert


@deprecated(instead="frobs_core.load_policy('expert', env)", since="0.3", removed_in="0.4")
def load_expert(env: Environment) -> Any:
    """Return the expert of an environment's task, whose ``act`` takes only ``episode_start``, or None.

    Raises:
        ConfigurationError: The expert cannot use the environment's controllers.
    """
    expert: Any = bound_expert(env)
    if expert is None or isinstance(expert, _ExpertOfVersion02):
        return expert and expert.expert
    act = expert.act
    expert.act = lambda episode_start: act(None, episode_start)
    return expert
