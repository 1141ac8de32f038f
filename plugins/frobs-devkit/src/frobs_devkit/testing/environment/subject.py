"""The environment that is checked, as an ID and keywords: every check makes its own."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec, load_env_creator
from gymnasium.vector import AutoresetMode

from frobs_core import plugins, registry
from frobs_core.specs import SimulatorRecord
from frobs_devkit.testing.checks import NotApplicable


@dataclass(frozen=True, eq=False)
class EnvUnderTest:
    """An environment ID with keywords."""

    id: str
    kwargs: Mapping[str, Any] = field(default_factory=dict)

    @property
    def bare_id(self) -> str:
        """The ID without a module to import."""
        return self.id.rpartition(":")[2]

    @property
    def self_importing_id(self) -> str:
        """The ID with the module that registers it, where that is known."""
        ours = self.bare_id in registry.environments() or self.bare_id.startswith("frobs/")
        return f"frobs_core:{self.bare_id}" if ours and ":" not in self.id else self.id

    @property
    def spec(self) -> EnvSpec:
        """The registered spec; imports the module of a self-importing ID."""
        module = self.self_importing_id.rpartition(":")[0]
        if module:
            importlib.import_module(module)
        return gym.spec(self.bare_id)

    @property
    def simulator(self) -> SimulatorRecord | None:
        """The record of its simulator; None for another's environment, or an unknown simulator."""
        chosen = {**self.spec.kwargs, **self.kwargs}.get("simulator")
        record = plugins.records("simulator").get(chosen) if isinstance(chosen, str) else chosen
        return record if isinstance(record, SimulatorRecord) else None

    def require_pause(self) -> None:
        """Raise NotApplicable in a check that repeats a motion bit for bit, if the simulator is paced."""
        if self.simulator is not None and self.simulator.is_paced:
            raise NotApplicable(f"simulator '{self.simulator.name}' is paced: its world does not move the same twice")

    def make(self, **kwargs: Any) -> gym.Env[Any, Any]:
        """Make the single environment as users do, time limit and all.

        Gymnasium's passive checker is left out: it warns of what the checks here name more precisely.
        """
        return gym.make(self.self_importing_id, disable_env_checker=True, **{**self.kwargs, **kwargs})

    def make_vec(self, num_envs: int, mode: AutoresetMode, **kwargs: Any) -> gym.vector.VectorEnv[Any, Any, Any]:
        """Make the native batch, or Gymnasium's own vector of environments where there is none.

        Raises:
            NotApplicable: The simulator is paced, so there is no batch.
        """
        if self.simulator is not None and self.simulator.is_paced:
            raise NotApplicable(f"simulator '{self.simulator.name}' is paced: there is no batch")
        keywords: dict[str, Any] = {"vectorization_mode": "sync", "vector_kwargs": {"autoreset_mode": mode}}
        if self._has_batch():
            keywords = {"vectorization_mode": "vector_entry_point", "autoreset_mode": mode}
        return gym.make_vec(self.self_importing_id, num_envs, **keywords, **{**self.kwargs, **kwargs})

    def _has_batch(self) -> bool:
        """Whether the ID has a batch of its own, which lets the autoreset be chosen: not every package's does."""
        entry_point = self.spec.vector_entry_point
        if entry_point is None:
            return False
        creator = entry_point if callable(entry_point) else load_env_creator(entry_point)
        parameters = inspect.signature(creator).parameters.values()
        return any(p.name == "autoreset_mode" or p.kind is inspect.Parameter.VAR_KEYWORD for p in parameters)


def inside(env: Any) -> Any:
    """Return the environment inside of its wrappers, with the attributes that only ours have."""
    return env.unwrapped


def observes_truly(env: Any, *keys: str) -> bool:
    """Whether neither noise nor delay changes some keys of a dictionary observation."""
    randomization = getattr(env.unwrapped, "randomization", None)
    return randomization is None or not randomization.observed_keys & set(keys)


def achieved_goal(env: Any, observation: Any) -> Any:
    """Return a goal that is reached now, (k,), or of a batch (num_envs, k): the achieved goal, or the tool's position [m]."""
    if isinstance(observation, dict) and "achieved_goal" in observation:
        return np.array(observation["achieved_goal"], np.float64)
    tools = inside(env).robot.frame_pose("tcp")[0].copy()
    return tools if isinstance(inside(env), gym.vector.VectorEnv) else tools[0]


def is_ours(env: Any) -> bool:
    """Whether an environment, single or vector, is composed of a simulator, a robot, a controller and a task."""
    return hasattr(env.unwrapped, "simulation")


def require_ours(env: Any) -> None:
    """Raise NotApplicable for another's environment, in a check of what only ours promise."""
    if not is_ours(env):
        raise NotApplicable("only for environments of FRobs")
