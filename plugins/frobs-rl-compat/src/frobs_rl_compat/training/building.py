"""Builds stable-baselines3 models from the settings in a YAML file."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import gymnasium as gym
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from frobs_algos_sb3.model_files import load_model, read_replay_buffer
from frobs_algos_sb3.model_files.known import algorithm_class
from frobs_core.util.errors import ConfigurationError, IncompatibleSpaceError, UntrustedFileError
from frobs_rl_compat.training.saving import existing_model
from frobs_rl_compat.training.settings import WITH_NOISE, WITH_SDE, FileSettings

Env = gym.Env[Any, Any] | VecEnv

_log = logging.getLogger("frobs")

_ONLY_NEW = ("policy_kwargs", "use_rms_prop", "rms_prop_eps", "use_sde")
"""Settings that determine the networks. A saved model's values take precedence over the YAML file."""

_REAPPLIED = (
    *("batch_size", "learning_rate", "n_steps", "n_epochs"),
    *("gamma", "gae_lambda", "ent_coef", "vf_coef", "max_grad_norm"),
)
"""Settings that are read from the YAML file if a model is initialized with a policy from imitation learning. All other
settings keep the values from the policy's file.
"""


def new_model(settings: FileSettings, env: Env) -> BaseAlgorithm:
    """Return a new model."""
    kwargs = _attributes(settings, env)
    policy = "MultiInputPolicy" if isinstance(env.observation_space, spaces.Dict) else "MlpPolicy"
    try:
        return algorithm_class(settings.algorithm)(policy, env, verbose=1, **kwargs)
    except (AssertionError, ValueError, TypeError) as error:
        raise ConfigurationError(
            f"algorithm '{settings.algorithm}' cannot be built with these settings: {error}"
        ) from error


def saved_model(settings: FileSettings, env: Env, folder: Path, trust: bool) -> BaseAlgorithm:
    """Return the saved model ``model_name``, with training settings from the YAML file instead of the model file."""
    path = existing_model(folder, settings.params.model_name)
    overrides = {key: value for key, value in _attributes(settings, env).items() if key not in _ONLY_NEW}
    model = load_model(path, env, algorithm=settings.algorithm, trust=trust, verbose=1, **overrides)
    if settings.algorithm in WITH_SDE and model.use_sde != settings.params.use_sde:
        _log.warning("%s was trained with use_sde=%s; the value in the YAML file is ignored.", path, model.use_sde)
    if isinstance(model, OffPolicyAlgorithm):
        _load_buffer(model, path, trust)
    return model


def imitated_model(settings: FileSettings, env: Env, path: Path, trust: bool) -> BaseAlgorithm:
    """Return a model that is initialized with a policy from imitation learning."""
    defaults = {key: value for key, value in settings.model_kwargs().items() if key not in _ONLY_NEW}
    given = {key: value for key, value in defaults.items() if key in _REAPPLIED}
    return load_model(path, env, algorithm=settings.algorithm, trust=trust, defaults=defaults, verbose=1, **given)


def _attributes(settings: FileSettings, env: Env) -> dict[str, Any]:
    """Return the keyword arguments of the algorithm's class, with action noise if the algorithm supports it."""
    kwargs = settings.model_kwargs()
    if settings.algorithm not in WITH_NOISE:
        return kwargs
    space, noise = env.action_space, settings.config.action_noise  # type: ignore[attr-defined]
    if noise is None:
        return {**kwargs, "action_noise": None}
    if not isinstance(space, spaces.Box):
        raise IncompatibleSpaceError(
            f"algorithm '{settings.algorithm}'",
            space,
            f"requires a Box action space, but the action space is {space}; choose PPO, A2C or DQN.",
        )
    return {**kwargs, "action_noise": noise.build(1, space.shape[-1])}


def _load_buffer(model: OffPolicyAlgorithm, path: Path, trust: bool) -> None:
    """Load the replay buffer that is stored next to the model, if it exists."""
    arrays, pickled = (path.with_name(f"{path.stem}_replay_buffer{suffix}") for suffix in (".npz", ".pkl"))
    if arrays.is_file():
        assert model.replay_buffer is not None
        read_replay_buffer(model.replay_buffer, arrays)
    elif not pickled.is_file():
        _log.info("no replay buffer was saved with %s; training starts with an empty replay buffer.", path)
    elif trust:
        model.load_replay_buffer(pickled)
    else:
        raise UntrustedFileError(pickled, "the file is a pickle, and opening a pickle can execute code in it")
