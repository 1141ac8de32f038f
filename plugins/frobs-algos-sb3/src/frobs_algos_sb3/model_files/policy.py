"""Policies from model files, for ``frobs evaluate`` and ``frobs play``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.preprocessing import is_image_space
from stable_baselines3.common.vec_env import VecTransposeImage

from frobs_algos.storage import check_networks
from frobs_algos_sb3.model_files.load import load_model
from frobs_algos_sb3.model_files.space_text import same_space
from frobs_core.description import Observation
from frobs_core.util.arrays import Action, Mask
from frobs_core.util.errors import RunError


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
    model = load_model(path, algorithm=algorithm, trust=trust, device="cpu")
    check_networks(path, model.policy.state_dict())
    seen = _as_trained(observation_space, model.observation_space)
    for what, written, real in (
        ("observation", model.observation_space, seen),
        ("action", model.action_space, action_space),
    ):
        if written is None or not same_space(written, real):
            raise RunError(
                f"{path}: the model was trained with {what} space {written}, but the environment has {real}; "
                "pass the keywords and wrappers that were used in training: --set environment_kwargs.controller=…, "
                "--set 'wrappers=[{name: …}]'."
            )
    model.action_space = model.policy.action_space = action_space  # the environment's bounds are exact
    return ModelPolicy(model, observation_space, action_space), model.num_timesteps


def _as_trained(real: gym.Space[Any], written: gym.Space[Any] | None) -> gym.Space[Any]:
    """Return an observation space after stable-baselines3's conversion, which puts image channels first."""
    if isinstance(real, spaces.Dict) and isinstance(written, spaces.Dict):
        return spaces.Dict([(key, _as_trained(inner, written.spaces.get(key))) for key, inner in real.spaces.items()])
    if isinstance(real, spaces.Box) and written is not None and real.shape != written.shape and is_image_space(real):
        return VecTransposeImage.transpose_space(real)
    return real
