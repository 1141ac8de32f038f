"""Making environments by Gymnasium ID, ours and others'."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import gymnasium as gym
from gymnasium.vector import AutoresetMode

from frobs_core.errors import ConfigurationError, FrobsError, UnknownNameError, nearest


def find_spec(environment: str) -> gym.envs.registration.EnvSpec:
    """Return Gymnasium's record of an ID.

    Args:
        environment: The ID; ``"module:ID"`` imports the module first.

    Raises:
        UnknownNameError: No such ID.
        ConfigurationError: The module cannot be imported.
    """
    module, _, name = environment.rpartition(":")
    if module:
        try:
            import_module(module)
        except ImportError as error:
            raise ConfigurationError(f"environment '{environment}': module '{module}' is missing: {error}.") from error
    spec = gym.registry.get(name)
    if spec is None:
        similar = nearest(name, gym.registry)
        ours = [known for known in gym.registry if known.startswith("frobs/")]
        raise UnknownNameError("environment ID", name, {*ours, *([similar] if similar else [])})
    return spec


def make_vector_env(environment: str, num_envs: int, kwargs: Mapping[str, Any]) -> gym.vector.VectorEnv[Any, Any, Any]:
    """Make a vector environment with same-step autoreset: the ID's own where there is one, else one by one.

    Args:
        environment: Gymnasium ID.
        num_envs: Environments.
        kwargs: Keywords of the environment.

    Raises:
        UnknownNameError: No such ID.
        ConfigurationError: The environment cannot be built with these keywords.
    """
    spec = find_spec(environment)
    try:
        if spec.vector_entry_point is not None and not spec.additional_wrappers:
            env = gym.make_vec(spec, num_envs, vectorization_mode="vector_entry_point", **kwargs)
            if env.metadata.get("autoreset_mode") == AutoresetMode.SAME_STEP:
                return env
            env.close()  # Gymnasium's own reset in the next step
        return gym.make_vec(
            spec,
            num_envs,
            vectorization_mode="sync",
            vector_kwargs={"autoreset_mode": AutoresetMode.SAME_STEP},
            **kwargs,
        )
    except FrobsError:
        raise
    except Exception as error:
        raise _unbuildable(environment, kwargs, error) from error


def make_env(environment: str, kwargs: Mapping[str, Any], render_mode: str | None = None) -> gym.Env[Any, Any]:
    """Make one environment.

    Args:
        environment: Gymnasium ID.
        kwargs: Keywords of the environment.
        render_mode: ``"rgb_array"``, ``"human"`` or None.

    Raises:
        UnknownNameError: No such ID.
        ConfigurationError: The environment cannot be built with these keywords.
    """
    spec = find_spec(environment)
    try:
        return gym.make(spec, render_mode=render_mode, **kwargs)
    except FrobsError:
        raise
    except Exception as error:
        raise _unbuildable(environment, kwargs, error) from error


def _unbuildable(environment: str, kwargs: Mapping[str, Any], error: Exception) -> ConfigurationError:
    given = ", ".join(f"{key}={value!r}" for key, value in kwargs.items())
    return ConfigurationError(
        f"environment '{environment}' cannot be built{f' with {given}' if given else ''}: "
        f"{type(error).__name__}: {error}"
    )
