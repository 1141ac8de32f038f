"""Adapter from Gymnasium's to stable-baselines3's vector environments, without copying batched arrays."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from frobs_algos.spaces import NoEnvironment
from frobs_core.util.errors import ConfigurationError

_NOTHING: dict[str, Any] = {}
"""Info of every environment whose episode continues. This dictionary is shared, so do not write to it."""


class VectorEnvAdapter(VecEnv):
    """Adapter that turns a Gymnasium vector environment into a stable-baselines3 vector environment.

    The wrapped ``gymnasium.vector.VectorEnv`` must use same-step autoreset. Batched arrays are passed on without being
    copied. Only environments whose episode has just ended have their own info, which contains ``terminal_observation``,
    ``TimeLimit.truncated``, and the other keys of the last info, including ``is_success`` and ``episode`` if the
    environment provides them.

    If no new seed is set, :meth:`reset` continues the current random sequence. To set a seed, call :meth:`seed` before
    :meth:`reset`.
    """

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any]) -> None:
        mode = env.metadata.get("autoreset_mode")
        if mode != AutoresetMode.SAME_STEP:
            raise ConfigurationError(
                f"the vector environment has the autoreset mode {mode}; create it with AutoresetMode.SAME_STEP."
            )
        self.env = env
        self._base = env.unwrapped
        self._actions: Any = None
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)
        self._infos = [_NOTHING] * env.num_envs

    @property
    def can_step(self) -> bool:
        """Whether the adapter contains an environment and not only its spaces."""
        return not isinstance(self.env, NoEnvironment)

    @property
    def computes_reward(self) -> bool:
        """Whether the environment can compute rewards for other goals, as hindsight replay requires."""
        single = self._single()
        owner = self._base if single is None else single[0].unwrapped
        return hasattr(owner, "compute_reward") or hasattr(getattr(owner, "task", None), "compute_reward")

    @property
    def max_episode_steps(self) -> int | None:
        """Maximum number of steps per episode, or None if unknown."""
        longest = getattr(self._base, "max_episode_steps", None)
        if longest is None and self._base.spec is not None:
            longest = self._base.spec.max_episode_steps
        return None if longest is None or longest == math.inf else int(longest)

    def reset(self) -> VecEnvObs:
        """Reset all environments."""
        seeds: Any = None if self._seeds[0] is None else list(self._seeds)
        options = self._options[0] or None
        observation, info = self.env.reset(seed=seeds, options=options)
        self.reset_infos = [_row(info, index) for index in range(self.num_envs)]
        self._reset_seeds()
        self._reset_options()
        first: VecEnvObs = observation
        return first

    def step_async(self, actions: np.ndarray[Any, Any]) -> None:
        """Store the actions for :meth:`step_wait`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Step all environments with the stored actions."""
        observation, rewards, terminated, truncated, info = self.env.step(self._actions)
        done = terminated | truncated
        infos = self._infos
        if done.any():
            infos = infos.copy()
            for index in np.flatnonzero(done).tolist():
                infos[index] = self._final_info(info, index, bool(truncated[index] and not terminated[index]))
        # Copy the rewards, because stable-baselines3 adds the bootstrapped value to them in place.
        return observation, rewards.astype(np.float32), done, infos

    def close(self) -> None:
        """Close all environments."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of each environment. In a native batch, all environments share one value."""
        single = self._single()
        if single is None:
            return [getattr(self._base, attr_name)] * len(self._ids(indices))
        return [single[index].get_wrapper_attr(attr_name) for index in self._ids(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of each environment, or of a native batch as a whole."""
        single = self._single()
        if single is None:
            setattr(self._base, attr_name, value)
            return
        for index in self._ids(indices):
            single[index].set_wrapper_attr(attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of each environment. In a native batch, the method is called only once, for all environments.

        ``compute_reward``, which hindsight replay calls with a batch of goals, is a method of the task.
        """
        single = self._single()
        if single is not None:
            return [
                single[index].get_wrapper_attr(method_name)(*method_args, **method_kwargs)
                for index in self._ids(indices)
            ]
        owner = self._base
        if not hasattr(owner, method_name) and hasattr(getattr(owner, "task", None), method_name):
            owner = owner.task  # type: ignore[attr-defined]
        return [getattr(owner, method_name)(*method_args, **method_kwargs)] * len(self._ids(indices))

    def env_is_wrapped(
        self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Return whether each environment has a wrapper of this class."""
        from stable_baselines3.common.env_util import is_wrapped

        single = self._single()
        return [single is not None and is_wrapped(single[index], wrapper_class) for index in self._ids(indices)]

    def get_images(self) -> Sequence[np.ndarray[Any, Any] | None]:
        """Return one image per environment."""
        images: Any = self.env.render()
        return images or []

    def _single(self) -> Sequence[gym.Env[Any, Any]] | None:
        """Return the individual environments of a vector environment, or None for a native batch."""
        return getattr(self._base, "envs", None)

    def _ids(self, indices: VecEnvIndices) -> Sequence[int]:
        return list(self._get_indices(indices))

    def _final_info(self, info: Mapping[str, Any], index: int, timed_out: bool) -> dict[str, Any]:
        result = _row(info.get("final_info", _NOTHING), index)
        if "episode" in info:
            episode = info["episode"]
            result["episode"] = {"r": float(episode["r"][index]), "l": int(episode["l"][index])}
        result["TimeLimit.truncated"] = timed_out
        batched = getattr(self._base, "final_observation", None)
        if batched is None:
            result["terminal_observation"] = info["final_obs"][index]
        elif isinstance(batched, dict):
            result["terminal_observation"] = {key: value[index] for key, value in batched.items()}
        else:
            result["terminal_observation"] = batched[index]
        if "frobs/diverged" in result:  # the physics diverged: do not bootstrap the final value
            result["TimeLimit.truncated"] = False
        return result


def _row(info: Mapping[str, Any], index: int) -> dict[str, Any]:
    """Return one environment's part of a batched info."""
    row = {}
    for key, value in info.items():
        mask = info.get(f"_{key}")
        if not key.startswith("_") and (mask is None or mask[index]):
            row[key] = _row(value, index) if isinstance(value, dict) else value[index]
    return row
