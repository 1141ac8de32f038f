"""Conversion of an algorithm's learned state to plain arrays, so that checkpoints contain no Python objects."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import torch as th
from ray.rllib.core import DEFAULT_MODULE_ID
from torch import nn

from frobs_core.util.errors import CheckpointError

Arrays = dict[str, np.ndarray[Any, Any]]


def weights(module: nn.Module) -> Arrays:
    """Return copies of a network's parameters and constants."""
    return {name: tensor.detach().cpu().numpy().copy() for name, tensor in module.state_dict().items()}


def restore_weights(module: nn.Module, arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Set a network's parameters and constants, skipping arrays of networks that do not exist yet.

    Raises:
        CheckpointError: The arrays do not match the network.
    """
    own = module.state_dict()
    fitting = {name: th.from_numpy(np.array(array)) for name, array in arrays.items() if name in own}
    try:
        module.load_state_dict(fitting)
    except RuntimeError as error:
        raise CheckpointError(
            f"the saved networks do not match the settings that were saved with them: {error}."
        ) from error


def learning(learner: Any) -> Arrays:
    """Return a learner's optimizer states, and its learned or adapted coefficients."""
    arrays: Arrays = {}
    for name, optimizer in learner.get_optimizers_for_module(DEFAULT_MODULE_ID):
        for index, values in optimizer.state_dict()["state"].items():
            for key, value in values.items():
                arrays[f"optimizer/{name}/{index}/{key}"] = np.array(value)
    for name, value in _coefficients(learner).items():
        arrays[f"coefficient/{name}"] = value.detach().cpu().numpy().copy()
    return arrays


def restore_learning(learner: Any, arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Restore the state that :func:`learning` returned.

    Raises:
        CheckpointError: The arrays do not match the learner.
    """
    with th.no_grad():
        for name, value in _coefficients(learner).items():
            saved = arrays.get(f"coefficient/{name}")
            if saved is not None:
                value.copy_(th.from_numpy(np.array(saved)).reshape(value.shape))
    for name, optimizer in learner.get_optimizers_for_module(DEFAULT_MODULE_ID):
        prefix = f"optimizer/{name}/"
        state: dict[int, dict[str, Any]] = {}
        for key in arrays:
            if key.startswith(prefix):
                index, _, entry = key.removeprefix(prefix).partition("/")
                state.setdefault(int(index), {})[entry] = th.from_numpy(np.array(arrays[key]))
        _check_shapes(name, optimizer, state)
        optimizer.load_state_dict({"state": state, "param_groups": optimizer.state_dict()["param_groups"]})


def _check_shapes(name: str, optimizer: th.optim.Optimizer, state: Mapping[int, Mapping[str, Any]]) -> None:
    parameters = [parameter for group in optimizer.param_groups for parameter in group["params"]]
    for index, entries in state.items():
        fits = index < len(parameters) and all(
            not value.shape or value.shape == parameters[index].shape for value in entries.values()
        )
        if not fits:
            raise CheckpointError(
                f"the saved state of the optimizer {name} does not match the settings that were saved with it."
            )


def _coefficients(learner: Any) -> dict[str, Any]:
    """Return SAC's temperature or the weight of PPO's KL divergence penalty, if the learner has such a coefficient."""
    readers: dict[str, Callable[[], Any]] = {
        "log_alpha": lambda: learner.curr_log_alpha[DEFAULT_MODULE_ID],
        "kl_coeff": lambda: learner.curr_kl_coeffs_per_module[DEFAULT_MODULE_ID],
    }
    attributes = {"log_alpha": "curr_log_alpha", "kl_coeff": "curr_kl_coeffs_per_module"}
    return {name: read() for name, read in readers.items() if hasattr(learner, attributes[name])}
