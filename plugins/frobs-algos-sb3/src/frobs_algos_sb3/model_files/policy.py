"""Policies from model files, for ``frobs evaluate`` and ``frobs play``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm

from frobs_algos.storage import check_networks
from frobs_algos_sb3.model_files.load import load_model
from frobs_core.description import Observation
from frobs_core.util.arrays import Action, Mask
from frobs_core.util.errors import ModelMismatchError, RunError


class ModelPolicy:
    """A model that has the spaces and the ``predict`` method of an algorithm."""

    def __init__(self, model: BaseAlgorithm, observation_space: gym.Space[Any], action_space: gym.Space[Any]) -> None:
        self.model = model
        self.observation_space = observation_space
        self.action_space = action_space

    def predict(
        self,
        observation: Observation,
        state: tuple[np.ndarray[Any, Any], ...] | None = None,
        episode_start: Mask | None = None,
        deterministic: bool = True,
    ) -> tuple[Action, tuple[np.ndarray[Any, Any], ...] | None]:
        """Return actions for a batch of observations, and the next state of a recurrent policy."""
        return self.model.predict(observation, state, episode_start, deterministic)


def open_policy(
    path: Path,
    observation_space: gym.Space[Any],
    action_space: gym.Space[Any],
    algorithm: str | None = None,
    trust: bool = False,
) -> tuple[ModelPolicy, int]:
    """Open a model file for an environment. See :func:`load_model` for ``algorithm`` and ``trust``.

    Returns:
        The policy, and the number of environment steps for which it was trained.

    Raises:
        CheckpointError: The file is missing or damaged, or it contains a model of another algorithm.
        UntrustedFileError: The file can only be opened by executing code in it.
        RunError: The environment's spaces differ from the model's spaces.
    """
    spaces = observation_space, action_space
    try:
        model = load_model(path, spaces=spaces, algorithm=algorithm, trust=trust, device="cpu")
    except ModelMismatchError as error:
        raise RunError(
            f"{error} Pass the keywords and wrappers that were used in training: --set "
            "environment_kwargs.controller=…, --set 'wrappers=[{name: …}]'."
        ) from error
    check_networks(path, model.policy.state_dict())
    model.action_space = model.policy.action_space = action_space  # the environment's bounds are exact
    return ModelPolicy(model, observation_space, action_space), model.num_timesteps
