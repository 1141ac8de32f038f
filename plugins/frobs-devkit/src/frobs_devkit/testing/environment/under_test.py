"""The environment to check: an ID and keyword arguments, from which each check creates a new environment."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec, load_env_creator
from gymnasium.vector import AutoresetMode

from frobs_core import plugins
from frobs_core.plugins import registry
from frobs_core.plugins.records import SimulatorRecord
from frobs_devkit.testing.checks import NotApplicable


@dataclass(frozen=True, eq=False)
class EnvUnderTest:
    """An environment ID with keyword arguments."""

    id: str
    kwargs: Mapping[str, Any] = field(default_factory=dict)

    @property
    def bare_id(self) -> str:
        """The ID without a module prefix."""
        return self.id.rpartition(":")[2]

    @property
    def self_importing_id(self) -> str:
        """The ID, prefixed with the module that registers it if the module is known."""
        ours = self.bare_id in registry.environments() or self.bare_id.startswith("frobs/")
        return f"frobs_core:{self.bare_id}" if ours and ":" not in self.id else self.id

    @property
    def spec(self) -> EnvSpec:
        """The registered spec. Accessing the spec imports the module that registers the ID if the module is known."""
        module = self.self_importing_id.rpartition(":")[0]
        if module:
            importlib.import_module(module)
        return gym.spec(self.bare_id)

    @property
    def simulator(self) -> SimulatorRecord | None:
        """The simulator's record, or None if the environment is from another package or the simulator is unknown."""
        chosen = {**self.spec.kwargs, **self.kwargs}.get("simulator")
        record = plugins.records("simulator").get(chosen) if isinstance(chosen, str) else chosen
        return record if isinstance(record, SimulatorRecord) else None

    def require_pause(self) -> None:
        """Raise NotApplicable if the simulator is paced and thus cannot repeat a motion exactly."""
        if self.simulator is not None and self.simulator.is_paced:
            raise NotApplicable(f"simulator '{self.simulator.name}' is paced, so motions are not exactly repeatable")

    def make(self, **kwargs: Any) -> gym.Env[Any, Any]:
        """Create a single environment as users do, including the time limit.

        Gymnasium's passive checker is disabled, because the checks here are more precise than its warnings.
        """
        return gym.make(self.self_importing_id, disable_env_checker=True, **{**self.kwargs, **kwargs})

    @contextmanager
    def ours(self) -> Iterator[Any]:
        """Create a single environment of FRobs, and close it at the end of the ``with`` block.

        Raises:
            NotApplicable: The environment is from another package.
        """
        with closing(self.make()) as env:
            require_ours(env)
            yield env

    def make_vec(self, num_envs: int, mode: AutoresetMode, **kwargs: Any) -> gym.vector.VectorEnv[Any, Any, Any]:
        """Create the native batch, or Gymnasium's ``SyncVectorEnv`` if the environment has no native batch.

        Raises:
            NotApplicable: The simulator is paced and thus does not support batches.
        """
        if self.simulator is not None and self.simulator.is_paced:
            raise NotApplicable(f"simulator '{self.simulator.name}' is paced, so it does not support batches")
        keywords: dict[str, Any] = {"vectorization_mode": "sync", "vector_kwargs": {"autoreset_mode": mode}}
        if self._has_batch():
            keywords = {"vectorization_mode": "vector_entry_point", "autoreset_mode": mode}
        return gym.make_vec(self.self_importing_id, num_envs, **keywords, **{**self.kwargs, **kwargs})

    def _has_batch(self) -> bool:
        entry_point = self.spec.vector_entry_point
        if entry_point is None:
            return False
        creator = entry_point if callable(entry_point) else load_env_creator(entry_point)
        parameters = inspect.signature(creator).parameters.values()
        return any(p.name == "autoreset_mode" or p.kind is inspect.Parameter.VAR_KEYWORD for p in parameters)


def inside(env: Any) -> Any:
    """Return the unwrapped environment, for access to attributes that only FRobs environments have."""
    return env.unwrapped


def observes_truly(env: Any, *keys: str) -> bool:
    """Return whether the given keys of a dictionary observation are observed without noise or delay."""
    randomization = getattr(env.unwrapped, "randomization", None)
    return randomization is None or not randomization.observed_keys & set(keys)


def achieved_goal(env: Any, observation: Any) -> Any:
    """Return the achieved goal or, if the observation has no goals, the tool position [m], (k,) or (num_envs, k)."""
    if isinstance(observation, dict) and "achieved_goal" in observation:
        return np.array(observation["achieved_goal"], np.float64)
    tools = inside(env).robot.frame_pose("tcp")[0].copy()
    return tools if isinstance(inside(env), gym.vector.VectorEnv) else tools[0]


def is_ours(env: Any) -> bool:
    """Return whether a single or vector environment is a FRobs environment, which contains a simulation."""
    return hasattr(env.unwrapped, "simulation")


def require_ours(env: Any) -> None:
    """Raise NotApplicable unless the environment is a FRobs environment."""
    if not is_ours(env):
        raise NotApplicable("only for environments of FRobs")
