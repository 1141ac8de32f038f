"""Converts sbx's policies to PyTorch modules that ``frobs-algos`` can export as ONNX graphs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch as th
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

from frobs_algos.onnx_policy import Joined, ObservationInput, PolicyGraph, Scale
from frobs_algos.settings import ACTIVATIONS
from frobs_algos.spaces import subspaces
from frobs_algos_sb3.onnx import normalization
from frobs_algos_sbx.observations import FlatObservations

_EPSILON = 0.001  # constant in sbx's batch normalization


def policy_graph(
    model: BaseAlgorithm,
    normalizer: VecNormalize | None,
    flat: FlatObservations | None,
    space: spaces.Space[Any],
    activation: str,
) -> PolicyGraph:
    """Return a model's deterministic policy as a PyTorch module.

    Args:
        model: The model.
        normalizer: Normalizer of the observations, or None.
        flat: Wrapper that joins the parts of an observation, or None if the policy itself joins the parts.
        space: Observation space of the environment.
        activation: Name of the activation function.
    """
    inputs, preprocessing = None, []
    if flat is None:
        inputs = {key: ObservationInput(part, normalization(normalizer, key)) for key, part in subspaces(space).items()}
    else:
        scale = None if flat.scale is None else Scale(flat.scale)
        preprocessing = [module for module in (scale, normalization(normalizer, "")) if module is not None]
    network = Joined(*preprocessing, *_layers(model, activation))
    return PolicyGraph(network, space, model.action_space, bool(model.policy.squash_output), inputs)


def _layers(model: BaseAlgorithm, activation: str) -> list[nn.Module]:
    """Return the policy layers that map observations to the most probable actions, or to scores of discrete actions."""
    policy: Any = model.policy
    state = getattr(policy, "actor_state", None) or policy.qf_state
    statistics: Mapping[str, Any] = getattr(state, "batch_stats", {})
    params: Mapping[str, Any] = state.params if statistics else state.params["params"]
    dense = [name for name in params if name.startswith("Dense_")]
    # The hidden layers are followed by a layer for the mean and, in SAC and related algorithms, a layer for the standard
    # deviation.
    hidden = len(dense) - (2 if _has_deviation(policy) else 1)
    layers: list[nn.Module] = []
    normalizes = bool(statistics) and policy.batch_norm_actor
    for number in range(hidden + 1):
        if normalizes:
            layers.append(_normalization(params[f"BatchRenorm_{number}"], statistics[f"BatchRenorm_{number}"]))
        layers.append(_linear(params[f"Dense_{number}"]))
        if number < hidden:
            layers.append(getattr(nn, ACTIVATIONS[activation])())
    if policy.squash_output:
        layers.append(nn.Tanh())
    return layers


def _has_deviation(policy: Any) -> bool:
    from sbx.td3.policies import TD3Policy

    return bool(policy.squash_output) and not isinstance(policy, TD3Policy)


def _linear(params: Mapping[str, Any]) -> nn.Linear:
    kernel = np.asarray(params["kernel"])
    layer = nn.Linear(*kernel.shape)
    with th.no_grad():
        layer.weight.copy_(th.from_numpy(kernel.T.copy()))
        layer.bias.copy_(th.from_numpy(np.asarray(params["bias"]).copy()))
    return layer


def _normalization(params: Mapping[str, Any], statistics: Mapping[str, Any]) -> nn.BatchNorm1d:
    layer = nn.BatchNorm1d(len(statistics["mean"]), eps=_EPSILON)
    assert layer.running_mean is not None
    assert layer.running_var is not None
    with th.no_grad():
        for target, source in (
            (layer.weight, params["scale"]),
            (layer.bias, params["bias"]),
            (layer.running_mean, statistics["mean"]),
            (layer.running_var, statistics["var"]),
        ):
            target.copy_(th.from_numpy(np.asarray(source).copy()))
    return layer.eval()
