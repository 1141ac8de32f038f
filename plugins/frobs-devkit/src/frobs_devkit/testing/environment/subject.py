"""The environment to check, as an ID with keywords, from which each check creates its own."""

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
        """The ID without a module prefix."""
        return self.id.rpartition(":")[2]

    @property
    def self_importing_id(self) -> str:
        """The ID with the module that registers it, if known."""
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
        """Record of its simulator; None for environments of other packages, or an unknown simulator."""
        chosen = {**self.spec.kwargs, **self.kwargs}.get("simulator")
        record = plugins.records("simulator").get(chosen) if isinstance(chosen, str) else chosen
        return record if isinstance(record, SimulatorRecord) else None

    def require_pause(self) -> None:
        """Raise NotApplicable if the simulator is paced, in a check that repeats a motion exactly."""
        if self.simulator is not None and self.simulator.is_paced:
            raise NotApplicable(f"simulator '{self.simulator.name}' is paced, so motions are not exactly repeatable")

    def make(self, **kwargs: Any) -> gym.Env[Any, Any]:
        """Create a single environment as users do, including the time limit.

        Gymnasium's passive checker is disabled, because the checks here are more precise than its warnings.
        """
        return gym.make(self.self_importing_id, disable_env_checker=True, **{**self.kwargs, **kwargs})

    def make_vec(self, num_envs: int, mode: AutoresetMode, **kwargs: Any) -> gym.vector.VectorEnv[Any, Any, Any]:
        """Create the native batch, or Gymnasium's own vector environment if there is none.

        Raises:
            NotApplicable: The simulator is paced, so there are no batches.
        """
        if self.simulator is not None and self.simulator.is_paced:
            raise NotApplicable(f"simulator '{self.simulator.name}' is paced, so there are no batches")
        keywords: dict[str, Any] = {"vectorization_mode": "sync", "vector_kwargs": {"autoreset_mode": mode}}
        if self._has_batch():
            keywords = {"vectorization_mode": "vector_entry_point", "autoreset_mode": mode}
        return gym.make_vec(self.self_importing_id, num_envs, **keywords, **{**self.kwargs, **kwargs})

    def _has_batch(self) -> bool:
        """Whether the ID has a native batch with selectable autoreset, which other packages may lack."""
        entry_point = self.spec.vector_entry_point
        if entry_point is None:
            return False
        creator = entry_point if callable(entry_point) else load_env_creator(entry_point)
        parameters = inspect.signature(creator).parameters.values()
        return any(p.name == "autoreset_mode" or p.kind is inspect.Parameter.VAR_KEYWORD for p in parameters)


def inside(env: Any) -> Any:
    """Return the unwrapped environment, with the attributes of environments of FRobs."""
    return env.unwrapped


def observes_truly(env: Any, *keys: str) -> bool:
    """Whether the given keys of a dictionary observation have neither noise nor delay."""
    randomization = getattr(env.unwrapped, "randomization", None)
    return randomization is None or not randomization.observed_keys & set(keys)


def achieved_goal(env: Any, observation: Any) -> Any:
    """Return a goal that is currently reached, (k,) or (num_envs, k): the achieved goal, or the tool's position [m]."""
    if isinstance(observation, dict) and "achieved_goal" in observation:
        return np.array(observation["achieved_goal"], np.float64)
    tools = inside(env).robot.frame_pose("tcp")[0].copy()
    return tools if isinstance(inside(env), gym.vector.VectorEnv) else tools[0]


def is_ours(env: Any) -> bool:
    """Whether an environment, single or vector, consists of a simulator, a robot, a controller and a task of FRobs."""
    return hasattr(env.unwrapped, "simulation")


def require_ours(env: Any) -> None:
    """Raise NotApplicable for environments of other packages, in a check of guarantees that only FRobs gives."""
    if not is_ours(env):
        raise NotApplicable("only for environments of FRobs")
