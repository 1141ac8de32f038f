"""What a model of stable-baselines3 is made of beside its networks, as arrays and numbers."""

from __future__ import annotations

import random
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch as th
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

Arrays = dict[str, np.ndarray[Any, Any]]

COUNTERS = ("num_timesteps", "_n_updates", "_episode_num", "_current_progress_remaining")
"""Attributes of a model that count."""

_LAST = ("_last_obs", "_last_original_obs", "_last_episode_starts")


def optimizers(model: BaseAlgorithm) -> dict[str, th.optim.Optimizer]:
    """Return a model's optimisers by name."""
    owners = {"policy": model.policy, "actor": getattr(model, "actor", None), "critic": getattr(model, "critic", None)}
    found = {name: getattr(owner, "optimizer", None) for name, owner in owners.items()}
    found["ent_coef"] = getattr(model, "ent_coef_optimizer", None)
    return {name: optimizer for name, optimizer in found.items() if optimizer is not None}


def generators() -> Arrays:
    """Return the states of Python's, NumPy's and PyTorch's global generators."""
    version, words, gauss = random.getstate()
    name, keys, position, has_gauss, cached = np.random.get_state(legacy=True)  # noqa: NPY002  # SB3 draws from it
    assert name == "MT19937"
    return {
        "python": np.array([version, *words], np.int64),
        "python_gauss": np.array([] if gauss is None else [gauss], np.float64),
        "numpy_keys": np.asarray(keys),
        "numpy_rest": np.array([position, has_gauss, cached], np.float64),
        "torch": th.get_rng_state().numpy(),
    }


def restore_generators(arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Set the global generators; nothing may be drawn between this and the continuation."""
    version, *words = arrays["python"].tolist()
    gauss = arrays["python_gauss"].tolist()
    random.setstate((version, tuple(words), gauss[0] if gauss else None))
    position, has_gauss, cached = arrays["numpy_rest"].tolist()
    np.random.set_state(  # noqa: NPY002
        ("MT19937", arrays["numpy_keys"], int(position), int(has_gauss), cached)
    )
    th.set_rng_state(th.from_numpy(arrays["torch"].copy()))


def last_step(model: BaseAlgorithm) -> Arrays:
    """Return what a model keeps from its last step."""
    arrays: Arrays = {}
    for name in _LAST:
        value = getattr(model, name)
        if isinstance(value, dict):
            arrays |= {f"{name}/{key}": np.asarray(item) for key, item in value.items()}
        elif value is not None:
            arrays[name] = np.asarray(value)
    return arrays


def restore_last_step(model: BaseAlgorithm, arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Give a model back what it kept from its last step."""
    for name in _LAST:
        items = {key.partition("/")[2]: value for key, value in arrays.items() if key.startswith(f"{name}/")}
        setattr(model, name, items or arrays.get(name))


def normalizer_arrays(normalizer: VecNormalize) -> Arrays:
    """Return the statistics of a normaliser."""
    arrays: Arrays = {"returns": np.asarray(normalizer.returns)}
    for name, statistics in _statistics(normalizer).items():
        arrays |= {
            f"{name}/mean": np.asarray(statistics.mean),
            f"{name}/var": np.asarray(statistics.var),
            f"{name}/count": np.asarray(statistics.count),
        }
    return arrays


def restore_normalizer(normalizer: VecNormalize, arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Give a normaliser its statistics back."""
    if arrays["returns"].shape == np.shape(normalizer.returns):
        normalizer.returns = arrays["returns"].copy()
    for name, statistics in _statistics(normalizer).items():
        statistics.mean = arrays[f"{name}/mean"].copy()
        statistics.var = arrays[f"{name}/var"].copy()
        statistics.count = float(arrays[f"{name}/count"])


def _statistics(normalizer: VecNormalize) -> dict[str, RunningMeanStd]:
    found = {"reward": normalizer.ret_rms}
    if normalizer.norm_obs:
        observation = normalizer.obs_rms
        by_key = observation if isinstance(observation, dict) else {"": observation}
        found |= {f"observation/{key}": statistics for key, statistics in by_key.items()}
    return found
