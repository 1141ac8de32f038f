"""Conversion of an sbx model's learned state to named arrays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from flax.training.train_state import TrainState
from jax.tree_util import keystr, tree_flatten_with_path, tree_unflatten
from stable_baselines3.common.base_class import BaseAlgorithm

Arrays = dict[str, np.ndarray[Any, Any]]

_PREDICTING = ("params", "target_params", "batch_stats")
"""Fields of a ``TrainState`` that belong to the networks. All other fields are used only for training."""

_KEYS = ("key", "noise_key")


def networks(model: BaseAlgorithm) -> Arrays:
    """Return the weights of a model's policy."""
    return {name: leaf for name, leaf in _leaves(model).items() if _predicts(name)}


def initial_networks(model: BaseAlgorithm, seed: int) -> Arrays:
    """Sample initial weights and biases as PyTorch does, uniformly in ±1/√n for a layer with n inputs.

    The standard deviation of flax's initial weights is 1.7 times as large as PyTorch's. With flax's initial weights,
    SAC succeeds less often and varies more between seeds.
    """
    generator, old = np.random.default_rng(seed), networks(model)
    new: Arrays = {}
    for name in old:
        layer, _, _ = name.rpartition("/")
        if name.split("/")[1] == "params" and f"{layer}/kernel" in old:  # batch normalization has no kernel
            bound = old[f"{layer}/kernel"].shape[-2] ** -0.5  # a kernel's last axes are its inputs and outputs
            new[name] = generator.uniform(-bound, bound, old[name].shape).astype(np.float32)
            target = name.replace("/params/", "/target_params/", 1)
            if target in old:
                new[target] = new[name]
    return new


def learning(model: BaseAlgorithm) -> Arrays:
    """Return the states of a model's optimizers, and learned values that are not part of the model's policy."""
    return {name: leaf for name, leaf in _leaves(model).items() if not _predicts(name)}


def restore(model: BaseAlgorithm, arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Restore arrays that :func:`networks` or :func:`learning` returned, without changing any other values.

    Raises:
        ValueError: The shape of an array does not match the model.
    """
    for owner, attribute, state in _states(model):
        paths, structure = tree_flatten_with_path(state)
        leaves = []
        for path, leaf in paths:
            name = _name(attribute, path)
            saved = arrays.get(name)
            if saved is not None and saved.shape != np.shape(leaf):
                raise ValueError(f"{name} has the shape {saved.shape}; expected {np.shape(leaf)}")
            leaves.append(leaf if saved is None else jnp.asarray(saved))
        setattr(owner, attribute, tree_unflatten(structure, leaves))


def keys(model: BaseAlgorithm) -> Arrays:
    """Return the keys of JAX's random number generators."""
    return {f"jax/{name}": np.asarray(value) for _, name, value in _random_keys(model)}


def restore_keys(model: BaseAlgorithm, arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Set the keys of JAX's random number generators."""
    for owner, name, _ in _random_keys(model):
        setattr(owner, name.rpartition("/")[2], jnp.asarray(arrays[f"jax/{name}"]))


def _random_keys(model: BaseAlgorithm) -> list[tuple[Any, str, jax.Array]]:
    owners = {"model": model, "policy": model.policy}
    return [
        (owner, f"{label}/{name}", getattr(owner, name))
        for label, owner in owners.items()
        for name in _KEYS
        if hasattr(owner, name)
    ]


def _states(model: BaseAlgorithm) -> list[tuple[Any, str, TrainState]]:
    return [
        (owner, name, value)
        for owner in (model.policy, model)
        for name, value in sorted(vars(owner).items())
        if isinstance(value, TrainState)
    ]


def _leaves(model: BaseAlgorithm) -> Arrays:
    return {
        _name(attribute, path): np.asarray(jnp.asarray(leaf))  # convert numbers to JAX types, as loading a model does
        for _, attribute, state in _states(model)
        for path, leaf in tree_flatten_with_path(state)[0]
    }


def _name(attribute: str, path: Any) -> str:
    return f"{attribute}/{keystr(path, simple=True, separator='/')}"


def _predicts(name: str) -> bool:
    state, field = name.split("/")[:2]
    return field in _PREDICTING and not state.startswith("ent_coef")
