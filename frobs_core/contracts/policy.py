"""Contract of everything that acts: trained networks, scripted experts, random actions and people at a keyboard."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
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
    A policy stores its memory of an episode itself, with one row per environment. Only a policy whose
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

    def remember(self, action: Action) -> None:
        """Replace the latest actions in the policy's memory by those that the environment received.

        Called after :meth:`act` if a person has taken over. Only a policy that remembers its own actions needs to
        override this method.

        Args:
            action: Actions that the environment received, (num_envs, …).
        """

    def close(self) -> None:
        """Release devices, windows and files. May be called more than once."""


class Operator(Policy):
    """Base class of policies through which a person acts, in one environment.

    :meth:`Policy.info` contains ``"intervention"``, True, which a recording stores as a column.
    """

    @property
    @abstractmethod
    def is_moving(self) -> bool:
        """Whether the person moves the robot right now, by a drag, a key or a stick."""

    @abstractmethod
    def offer(self, commands: Sequence[str]) -> None:
        """Let the person choose from these commands, such as ``"start"`` or ``"take over"``, and from no others."""

    @abstractmethod
    def command(self) -> str:
        """Return the next command that the person has chosen, or an empty string. Call this method while waiting."""

    @abstractmethod
    def show(self, text: str) -> None:
        """Show a line of text to the person."""


class Expert(Policy):
    """Base class of the scripted policy that a task names in :attr:`Task.expert <frobs_core.contracts.Task.expert>`.

    An expert may read the whole state of ``env.unwrapped``, including the task, the simulation and the controllers, but
    must not change anything. It is created without arguments.
    """
