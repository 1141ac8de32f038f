"""Converts RLlib's policies to PyTorch modules that ``frobs-algos-sb3`` can export as ONNX graphs."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import torch as th
from gymnasium import spaces
from torch import nn

from frobs_algos_sb3.onnx_observation import ObservationInput
from frobs_algos_sb3.onnx_policy import PolicyGraph


def policy_graph(module: Any, observation: gym.Space[Any], action: gym.Space[Any]) -> PolicyGraph:
    """Return a deterministic policy as a PyTorch module.

    Args:
        module: RLlib's module with the networks.
        observation: Observation space of one environment.
        action: Action space of one environment.
    """
    parts = observation.spaces if isinstance(observation, spaces.Dict) else {"": observation}
    inputs = {key: ObservationInput(part, part, None, key) for key, part in parts.items()}
    network = _Joined(module.mode, isinstance(observation, spaces.Dict))
    return PolicyGraph(network, inputs, action, squashed=isinstance(action, spaces.Box))


class _Joined(nn.Module):
    """Module that concatenates the parts of an observation and passes the result to a network."""

    def __init__(self, network: nn.Module, joins: bool) -> None:
        super().__init__()
        self.network, self.joins = network, joins

    def forward(self, observation: Any) -> tuple[th.Tensor, ...]:
        """Return the most probable actions, or the scores of discrete actions."""
        parts = list(observation.values()) if self.joins else [observation]
        return (self.network(th.cat([part.flatten(1) for part in parts], dim=1)),)
