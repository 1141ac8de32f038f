"""Building blocks for the networks in RLlib's modules."""

from __future__ import annotations

from collections.abc import Sequence

import torch as th
from torch import nn

from frobs_algos_sb3.networks import ACTIVATIONS


class Scale(nn.Module):
    """Multiplies flat observations (batch, k) by k constants, which are saved with the networks."""

    def __init__(self, scale: Sequence[float]) -> None:
        super().__init__()
        self.register_buffer("scale", th.tensor(scale, dtype=th.float32))

    def forward(self, observation: th.Tensor) -> th.Tensor:
        """Return the scaled observations."""
        assert isinstance(self.scale, th.Tensor)
        return observation * self.scale


class GaussianActor(nn.Module):
    """Network that maps observations to means, with one trainable log standard deviation per action component.

    Args:
        body: Network that maps observations to means (batch, n).
        size: n, the number of action components.
        log_std: Initial logarithm of the standard deviation.
    """

    def __init__(self, body: nn.Module, size: int, log_std: float) -> None:
        super().__init__()
        self.body = body
        self.log_std = nn.Parameter(th.full((size,), log_std))

    def forward(self, observation: th.Tensor) -> th.Tensor:
        """Return the means and the log standard deviations (batch, 2 n)."""
        mean = self.body(observation)
        return th.cat([mean, self.log_std.expand_as(mean)], dim=-1)


def hidden_layers(inputs: int, widths: Sequence[int], activation: str) -> tuple[list[nn.Module], int]:
    """Return linear layers with activations, and the width of the last layer."""
    layers: list[nn.Module] = []
    for width in widths:
        layers += [nn.Linear(inputs, width), getattr(nn, ACTIVATIONS[activation])()]
        inputs = width
    return layers, inputs


def orthogonal(network: nn.Module, last_gain: float) -> None:
    """Initialize linear layers with orthogonal weights and zero biases, scaling the last layer by ``last_gain``."""
    layers = [layer for layer in network.modules() if isinstance(layer, nn.Linear)]
    for layer in layers:
        nn.init.orthogonal_(layer.weight, last_gain if layer is layers[-1] else 2.0**0.5)
        nn.init.zeros_(layer.bias)
