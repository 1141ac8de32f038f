"""Conversion of a learner's state to plain arrays, so that checkpoints contain no Python objects."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch as th
from ray.rllib.core import DEFAULT_MODULE_ID

Arrays = dict[str, np.ndarray[Any, Any]]


def learning(learner: Any) -> Arrays:
    """Return a learner's optimizer states, and its learned or adapted coefficients."""
    arrays = {f"coefficient/{name}": value.detach().numpy().copy() for name, value in _coefficients(learner).items()}
    for name, optimizer in learner.get_optimizers_for_module(DEFAULT_MODULE_ID):
        for index, values in optimizer.state_dict()["state"].items():
            arrays |= {f"optimizer/{name}/{index}/{key}": np.array(value) for key, value in values.items()}
    return arrays


def restore_learning(learner: Any, arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Restore the state that :func:`learning` returned."""
    tensors = {name: th.from_numpy(array.copy()) for name, array in arrays.items()}
    with th.no_grad():
        for name, value in _coefficients(learner).items():
            if f"coefficient/{name}" in tensors:
                value.copy_(tensors[f"coefficient/{name}"].reshape(value.shape))
    for name, optimizer in learner.get_optimizers_for_module(DEFAULT_MODULE_ID):
        prefix = f"optimizer/{name}/"
        state: dict[int, dict[str, th.Tensor]] = {}
        for key, tensor in tensors.items():
            if key.startswith(prefix):
                index, _, entry = key.removeprefix(prefix).partition("/")
                state.setdefault(int(index), {})[entry] = tensor
        optimizer.load_state_dict({"state": state, "param_groups": optimizer.state_dict()["param_groups"]})


def _coefficients(learner: Any) -> dict[str, th.Tensor]:
    """Return SAC's temperature or the weight of PPO's KL divergence penalty, if the learner has such a coefficient."""
    attributes = {"log_alpha": "curr_log_alpha", "kl_coeff": "curr_kl_coeffs_per_module"}
    return {
        name: getattr(learner, attribute)[DEFAULT_MODULE_ID]
        for name, attribute in attributes.items()
        if hasattr(learner, attribute)
    }
