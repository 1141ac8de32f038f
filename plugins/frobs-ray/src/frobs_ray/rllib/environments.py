"""Recipes for recreating an environment of this process in other processes."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
from gymnasium.wrappers import OrderEnforcing, PassiveEnvChecker, TimeLimit

from frobs_ray.errors import EnvironmentCopyError
from frobs_train import EnvironmentRecipe, EpisodeRecorder

_OF_GYMNASIUM = (OrderEnforcing, PassiveEnvChecker, TimeLimit)
_OF_THE_VECTOR = ("num_envs", "vectorization_mode", "vector_kwargs")
"""Arguments that ``gymnasium.make_vec`` adds to the keyword arguments in the specification."""

_ADAPTING = ("NormalizeObservation", "NormalizeReward")
"""Wrappers whose statistics would differ between environment runners, and between training and evaluation."""


def recipe_of(env: gym.vector.VectorEnv[Any, Any, Any]) -> EnvironmentRecipe:
    """Return the recipe for the environments of a training run.

    Environments that a run creates provide their recipe. All other environments must have a Gymnasium specification
    with an ID and keyword arguments, and must not have additional wrappers.

    Raises:
        EnvironmentCopyError: A wrapper or a callback cannot be recreated, or the environment has no Gymnasium ID.
    """
    recipe = getattr(env, "recipe", None)
    if isinstance(recipe, EnvironmentRecipe):
        for component in recipe.wrappers:
            if component.name.rpartition(":")[2] in _ADAPTING:
                raise EnvironmentCopyError(
                    f"the wrapper {component.name} uses statistics that are collected in a single process",
                    "replace this wrapper with a wrapper that uses fixed constants",
                )
        if recipe.obstacle:
            raise EnvironmentCopyError(recipe.obstacle, "remove this setting")
        return recipe
    inner: Any = env
    while isinstance(inner, gym.vector.VectorWrapper):
        if not isinstance(inner, EpisodeRecorder):
            raise EnvironmentCopyError(f"the wrapper {type(inner).__name__} was added in Python", _USE_A_RUN)
        inner = inner.env
    for single in getattr(inner, "envs", [])[:1]:
        while isinstance(single, gym.Wrapper):
            if not isinstance(single, _OF_GYMNASIUM):
                raise EnvironmentCopyError(f"the wrapper {type(single).__name__} was added in Python", _USE_A_RUN)
            single = single.env
    if inner.spec is None:
        raise EnvironmentCopyError(
            "the environment was made without a Gymnasium ID", "register the environment, and create it by its ID"
        )
    return EnvironmentRecipe(inner.spec.id, _keywords(inner.spec))


_USE_A_RUN = "list the wrapper under 'wrappers' in the run's configuration"


def _keywords(spec: gym.envs.registration.EnvSpec) -> dict[str, Any]:
    registered = gym.spec(spec.id).kwargs
    return {
        key: value
        for key, value in spec.kwargs.items()
        if key not in _OF_THE_VECTOR and (key not in registered or registered[key] != value)
    }
