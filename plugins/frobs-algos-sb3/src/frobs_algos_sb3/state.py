"""The state of a stable-baselines3 model, except for its networks, as arrays and numbers."""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch as th
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.distributions import StateDependentNoiseDistribution
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

from frobs_algos_sb3.noise import noise_state, restore_noise

Arrays = dict[str, np.ndarray[Any, Any]]

_COUNTERS = (
    "num_timesteps",
    "_n_updates",
    "_n_calls",
    "_episode_num",
    "_current_progress_remaining",
    "exploration_rate",
)
"""Counters that a model may have."""

_LAST = ("_last_obs", "_last_original_obs", "_last_episode_starts")


def optimizers(model: BaseAlgorithm) -> dict[str, th.optim.Optimizer]:
    """Return a model's optimizers by name."""
    owners = {"policy": model.policy, "actor": getattr(model, "actor", None), "critic": getattr(model, "critic", None)}
    optimizers = {name: getattr(owner, "optimizer", None) for name, owner in owners.items()}
    optimizers["ent_coef"] = getattr(model, "ent_coef_optimizer", None)
    return {name: optimizer for name, optimizer in optimizers.items() if optimizer is not None}


def counters(model: BaseAlgorithm) -> dict[str, float]:
    """Return a model's counters."""
    return {name: getattr(model, name) for name in _COUNTERS if hasattr(model, name)}


def restore_counters(model: BaseAlgorithm, saved: Mapping[str, float]) -> None:
    """Restore a model's counters."""
    for name in counters(model):
        setattr(model, name, saved[name])


def learning(model: BaseAlgorithm) -> dict[str, Any]:
    """Return the states of a model's optimizers, and learned values that are not part of its policy."""
    states: dict[str, Any] = {name: optimizer.state_dict() for name, optimizer in optimizers(model).items()}
    coefficient = getattr(model, "log_ent_coef", None)
    return states if coefficient is None else {**states, "log_ent_coef": coefficient.detach()}


def restore_learning(model: BaseAlgorithm, saved: Mapping[str, Any]) -> None:
    """Restore the states of a model's optimizers, and learned values that are not part of its policy."""
    for name, optimizer in optimizers(model).items():
        optimizer.load_state_dict(saved[name])
    coefficient = getattr(model, "log_ent_coef", None)
    if coefficient is not None:
        with th.no_grad():
            coefficient.copy_(saved["log_ent_coef"])


@dataclass(frozen=True)
class Pause:
    """State of all random number generators at the point where training continues."""

    arrays: Arrays  # generators, action noise, and noise matrices of state-dependent exploration
    at_start: bool  # whether this state was recorded at the start of a rollout, after the noise matrices were drawn


def draws(model: BaseAlgorithm) -> Arrays:
    """Return the state of all random number generators."""
    arrays = generators() | {"action_space": _generator_words(model.action_space.np_random)}
    arrays |= {name: getattr(owner, name).detach().cpu().numpy() for owner, name in _exploration(model)}
    noise = noise_state(model.action_noise)
    return arrays if noise is None else {**arrays, "action_noise": noise}


def restore_draws(model: BaseAlgorithm, arrays: Arrays) -> None:
    """Restore the random number generators. The caller must not draw random numbers before training continues."""
    for owner, name in _exploration(model):
        setattr(owner, name, th.from_numpy(arrays[name].copy()).to(model.device))
    if "action_noise" in arrays:
        restore_noise(model.action_noise, arrays["action_noise"])
    _restore_generator(model.action_space.np_random, arrays["action_space"])
    restore_generators(arrays)


def _exploration(model: BaseAlgorithm) -> list[tuple[Any, str]]:
    """Return the owner and the attribute name of each noise matrix of state-dependent exploration."""
    policy: Any = model.policy
    distribution = getattr(getattr(policy, "actor", None) or policy, "action_dist", None)
    if not isinstance(distribution, StateDependentNoiseDistribution):
        return []
    return [(distribution, "exploration_mat"), (distribution, "exploration_matrices")]


def _generator_words(generator: np.random.Generator) -> np.ndarray[Any, Any]:
    """Return the state of a PCG64 generator as six 64-bit words."""
    saved: Any = generator.bit_generator.state
    assert saved["bit_generator"] == "PCG64"  # Gymnasium's generator
    halves = [half for value in saved["state"].values() for half in (value >> 64, value & (2**64 - 1))]
    return np.array([*halves, saved["has_uint32"], saved["uinteger"]], np.uint64)


def _restore_generator(generator: np.random.Generator, words: np.ndarray[Any, Any]) -> None:
    state_high, state_low, inc_high, inc_low, has_uint32, uinteger = (int(word) for word in words)
    generator.bit_generator.state = {
        "bit_generator": "PCG64",
        "state": {"state": state_high << 64 | state_low, "inc": inc_high << 64 | inc_low},
        "has_uint32": has_uint32,
        "uinteger": uinteger,
    }


def generators() -> Arrays:
    """Return the states of Python's, NumPy's and PyTorch's global generators."""
    version, words, gauss = random.getstate()
    name, keys, position, has_gauss, cached = np.random.get_state(legacy=True)  # noqa: NPY002  # SB3 uses it
    assert name == "MT19937"
    return {
        "python": np.array([version, *words], np.int64),
        "python_gauss": np.array([] if gauss is None else [gauss], np.float64),
        "numpy_keys": np.asarray(keys),
        "numpy_rest": np.array([position, has_gauss, cached], np.float64),
        "torch": th.get_rng_state().numpy(),
    }


def restore_generators(arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Restore the global generators. The caller must not draw random numbers before training continues."""
    version, *words = arrays["python"].tolist()
    gauss = arrays["python_gauss"].tolist()
    random.setstate((version, tuple(words), gauss[0] if gauss else None))
    position, has_gauss, cached = arrays["numpy_rest"].tolist()
    np.random.set_state(  # noqa: NPY002
        ("MT19937", arrays["numpy_keys"], int(position), int(has_gauss), cached)
    )
    th.set_rng_state(th.from_numpy(arrays["torch"].copy()))


def last_step(model: BaseAlgorithm) -> Arrays:
    """Return the data that a model stores about its last steps: observations, recurrent states and episodes."""
    arrays: Arrays = {}
    for name in _LAST:
        value = getattr(model, name)
        if isinstance(value, dict):
            arrays |= {f"{name}/{key}": np.asarray(item) for key, item in value.items()}
        elif value is not None:
            arrays[name] = np.asarray(value)
    recurrent = getattr(model, "_last_lstm_states", None)
    if recurrent is not None:
        flat = [tensor for pair in recurrent for tensor in pair]
        arrays |= {f"_last_lstm_states/{index}": tensor.cpu().numpy() for index, tensor in enumerate(flat)}
    if model.ep_info_buffer is not None and model.ep_success_buffer is not None:
        arrays["episodes/r"] = np.array([episode["r"] for episode in model.ep_info_buffer], np.float64)
        arrays["episodes/l"] = np.array([episode["l"] for episode in model.ep_info_buffer], np.int64)
        arrays["episodes/success"] = np.array(model.ep_success_buffer, np.float64)
    return arrays


def restore_last_step(model: BaseAlgorithm, arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Restore the data that a model stored about its last steps."""
    for name in _LAST:
        items = {key.partition("/")[2]: value for key, value in arrays.items() if key.startswith(f"{name}/")}
        setattr(model, name, items or arrays.get(name))
    recurrent: Any = getattr(model, "_last_lstm_states", None)
    if recurrent is not None:
        for index, tensor in enumerate(tensor for pair in recurrent for tensor in pair):
            tensor.copy_(th.from_numpy(arrays[f"_last_lstm_states/{index}"]))
    if "episodes/r" in arrays:
        window: int = model._stats_window_size
        pairs = zip(arrays["episodes/r"].tolist(), arrays["episodes/l"].tolist(), strict=True)
        model.ep_info_buffer = deque(({"r": reward, "l": length} for reward, length in pairs), maxlen=window)
        model.ep_success_buffer = deque(arrays["episodes/success"].tolist(), maxlen=window)


def normalizer_arrays(normalizer: VecNormalize) -> Arrays:
    """Return the statistics of a normalizer."""
    arrays: Arrays = {"returns": np.asarray(normalizer.returns)}
    for name, statistics in running_statistics(normalizer).items():
        arrays |= {
            f"{name}/mean": np.asarray(statistics.mean),
            f"{name}/var": np.asarray(statistics.var),
            f"{name}/count": np.asarray(statistics.count),
        }
    return arrays


def restore_normalizer(normalizer: VecNormalize, arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Restore the statistics of a normalizer."""
    if arrays["returns"].shape == np.shape(normalizer.returns):
        normalizer.returns = arrays["returns"].copy()
    for name, statistics in running_statistics(normalizer).items():
        statistics.mean = arrays[f"{name}/mean"].copy()
        statistics.var = arrays[f"{name}/var"].copy()
        statistics.count = float(arrays[f"{name}/count"])


def running_statistics(normalizer: VecNormalize) -> dict[str, RunningMeanStd]:
    """Return the statistics of a normalizer: ``reward`` and, if observations are normalized, ``observation/KEY``."""
    all_statistics = {"reward": normalizer.ret_rms}
    if normalizer.norm_obs:
        observation = normalizer.obs_rms
        by_key = observation if isinstance(observation, dict) else {"": observation}
        all_statistics |= {f"observation/{key}": statistics for key, statistics in by_key.items()}
    return all_statistics
