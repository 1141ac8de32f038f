"""Exports stable-baselines3's policies as ONNX graphs."""

from __future__ import annotations

from typing import Any

from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize

from frobs_algos.onnx import export_graph
from frobs_algos_sb3.onnx_observation import ObservationInput
from frobs_algos_sb3.onnx_policy import PolicyGraph, network_of


def export_policy(model: BaseAlgorithm, normalizer: VecNormalize | None, space: spaces.Space[Any]) -> bytes:
    """Return the graph of a model's deterministic policy. The same model always yields the same bytes.

    Inputs and outputs are named as in :meth:`frobs_core.contracts.Algorithm.export_onnx`. The export sets the model to
    evaluation mode, but does not change it otherwise.

    Args:
        model: The model.
        normalizer: Normalizer of the observations, if any.
        space: Observation space of the environment.
    """
    return export_graph(lambda: policy_graph(model, normalizer, space), model.device)


def policy_graph(model: BaseAlgorithm, normalizer: VecNormalize | None, space: spaces.Space[Any]) -> PolicyGraph:
    """Return a model's deterministic policy as a module, in evaluation mode."""
    inputs = observation_inputs(model, normalizer, space)
    model.policy.set_training_mode(False)
    return PolicyGraph(network_of(model), inputs, model.action_space, bool(model.policy.squash_output))


def observation_inputs(
    model: BaseAlgorithm, normalizer: VecNormalize | None, space: spaces.Space[Any]
) -> dict[str, ObservationInput]:
    """Return the preprocessing for each part of the observation by key. A single array has the key ``""``."""
    seen = model.policy.observation_space
    if isinstance(space, spaces.Dict):
        assert isinstance(seen, spaces.Dict)
        return {key: ObservationInput(inner, seen[key], normalizer, key) for key, inner in space.spaces.items()}
    return {"": ObservationInput(space, seen, normalizer, "")}
