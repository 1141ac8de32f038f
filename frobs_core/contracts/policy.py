"""Contract of everything that acts: trained networks, scripted experts, random actions and people at a keyboard."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np

from frobs_core.description.observation_term import Observation
from frobs_core.util.arrays import Action, Mask

Environment: TypeAlias = gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]
"""A single or vector environment."""


class Policy(ABC):
    """Base class of policies. :func:`~frobs_core.kernel.policies.load_policy` opens a policy by name or path.

    A policy acts in all environments of a vector environment at once. A single environment is a batch of size 1.
    Whatever a policy remembers about an episode lives in the policy, one row per environment. Only a policy whose
    constructor has a ``seed`` may draw random numbers.
    """

    def bind(self, env: Environment) -> None:
        """Prepare to act in an environment, which may be wrapped. Called once, before the first reset.

        Raises:
            FrobsError: The policy cannot act in this environment.
        """

    @abstractmethod
    def act(self, observation: Observation, episode_start: Mask) -> Action:
        """Return actions for the current state, (num_envs, …).

        Args:
            observation: Batch of observations, with arrays of shape (num_envs, …).
            episode_start: (num_envs,) bool, True for environments whose episode has just begun. Their earlier episodes
                do not influence the action.
        """

    def info(self) -> Mapping[str, np.ndarray[Any, Any]]:
        """Return facts about the latest actions, such as the phase of an expert, (num_envs, …) each."""
        return {}

    def close(self) -> None:
        """Release devices, windows and files. May be called more than once."""


class Expert(Policy):
    """Base class of the scripted policy that a task names in :attr:`Task.expert <frobs_core.contracts.Task.expert>`.

    An expert may read the whole state of ``env.unwrapped``, including the task, the simulation and the controllers, but
    must not change anything. It is created without arguments.
    """
