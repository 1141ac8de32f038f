"""Environment checks, and functions that read policy and noise settings from ROS's parameter server."""

from __future__ import annotations

from typing import Any

import numpy as np
from stable_baselines3.common import env_checker
from stable_baselines3.common.noise import NormalActionNoise

from frobs_algos_sb3.networks import NetworkConfig
from frobs_rl_compat.gym_api import to_gymnasium
from frobs_rl_compat.training import PolicyParams

__all__ = ["check_env", "get_action_noise", "get_policy_kwargs", "test_env"]


def check_env(env: Any, warn: bool = True, skip_render_check: bool = True) -> None:
    """Check an environment with the old gym API or the Gymnasium API, using stable-baselines3's environment checker.

    Args:
        env: The environment.
        warn: Whether to warn about properties of the environment that are permitted but unusual.
        skip_render_check: Whether to skip the rendering check.

    Raises:
        AssertionError: The environment violates the API that it implements.
    """
    env_checker.check_env(to_gymnasium(env), warn, skip_render_check)


def test_env(env: Any) -> bool:
    """Check an environment with :func:`check_env` and return True if it passes.

    Raises:
        AssertionError: The environment violates the API that it implements.
    """
    check_env(env)
    return True


test_env.__test__ = False  # type: ignore[attr-defined] # prevents pytest from collecting this function


def get_policy_kwargs(ns: str = "/") -> dict[str, Any] | None:
    """Return ``policy_kwargs`` from the parameters in a namespace, or None if they select the default policy."""
    params = _params(ns)
    if not params["use_custom_policy"]:
        return None
    return NetworkConfig(**PolicyParams(**params["policy_params"]).network_settings()).to_kwargs()


def get_action_noise(action_space_shape: int, ns: str = "/") -> NormalActionNoise | None:
    """Return the action noise that the parameters in a namespace define, or None if action noise is disabled.

    Args:
        action_space_shape: Length of an action.
        ns: Namespace of the parameters.
    """
    params = _params(ns)
    if not params.get("use_action_noise"):
        return None
    ones, noise = np.ones(action_space_shape), params["action_noise"]
    return NormalActionNoise(noise["mean"] * ones, noise["sigma"] * ones)


def _params(ns: str) -> dict[str, Any]:
    import rospy

    params: dict[str, Any] = rospy.get_param(f"{ns.rstrip('/')}/model_params")
    return params
