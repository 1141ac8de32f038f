"""Check whether a resumed training run is identical to an uninterrupted one."""

from __future__ import annotations

from typing import Any

import gymnasium as gym

from frobs_core import plugins
from frobs_core.plugins import registry
from frobs_core.plugins.records import Level
from frobs_train.configuration.config import RunConfig, algorithm_record
from frobs_train.logs.recorder import saving_wrappers, wrappers_of

_STATELESS = ("RescaleAction", "ClipAction", "TransformAction", "FlattenObservation", "FilterObservation",
              "RescaleObservation", "ReshapeObservation", "ResizeObservation", "GrayscaleObservation",
              "DtypeObservation", "TransformObservation", "ClipReward", "TransformReward")  # fmt: skip
"""Stateless wrappers of Gymnasium."""


def has_snapshot(config: RunConfig, env: gym.vector.VectorEnv[Any, Any, Any]) -> bool:
    """Return whether a checkpoint can contain the environment's state, exactly or approximately."""
    base = env.unwrapped
    return hasattr(base, "snapshot") and hasattr(base, "restore") and _level(config) is not Level.UNSUPPORTED


def why_not_exact(config: RunConfig, env: gym.vector.VectorEnv[Any, Any, Any]) -> str | None:
    """Return why a resumed run may differ from an uninterrupted run, or None if both runs are identical."""
    record = algorithm_record(config.algorithm)
    if not record.exact_resume:
        return f"the algorithm {config.algorithm} does not save its episodes or its random number state"
    if not has_snapshot(config, env):
        how = ", stepped one by one," if hasattr(env.unwrapped, "envs") else ""
        return f"{config.environment}{how} does not support snapshots, so the resumed run begins new episodes"
    if _level(config) is not Level.EXACT:
        return f"a simulator of {config.environment} restores its state only approximately"
    saving = saving_wrappers(env)
    silent = [
        type(wrapper).__name__
        for wrapper in wrappers_of(env)
        if wrapper not in saving
        and not (type(wrapper).__module__.startswith("gymnasium.") and type(wrapper).__name__ in _STATELESS)
    ]
    if silent:
        return f"the state of {', '.join(silent)} is not saved, because snapshot() and restore() are not defined"
    return None


def _level(config: RunConfig) -> Level:
    """Return how exactly the simulators restore their state. Environments of other packages are assumed to be exact."""
    known = registry.environments().get(config.environment.removeprefix("frobs_core:"))
    if known is None:
        return Level.EXACT
    chosen = config.environment_kwargs.get("simulator", known[1].simulator)
    records: list[Any] = [plugins.get_record("simulator", name or chosen) for name in config.simulators]
    levels: list[Level] = [record.capabilities.get("snapshot", Level.UNSUPPORTED) for record in records]
    return min(levels)
