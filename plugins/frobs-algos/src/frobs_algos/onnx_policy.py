"""Feed-forward and recurrent policies as traceable modules: preprocessing, network and conversion to actions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch as th
from gymnasium import spaces
from torch import nn

from frobs_algos.onnx import TraceablePolicy

__all__ = ["Joined", "Normalization", "ObservationInput", "PolicyGraph", "Scale"]


class Normalization(nn.Module):
    """Normalization by a running mean and standard deviation.

    Args:
        mean: Mean, in the shape of an observation.
        variance: Variance, in the same shape.
        epsilon: Constant that is added to the variance.
        clip: Maximum absolute value of normalized observations.
    """

    def __init__(self, mean: Any, variance: Any, epsilon: float, clip: float) -> None:
        super().__init__()
        self.register_buffer("mean", th.as_tensor(np.asarray(mean, np.float64)))
        self.register_buffer("deviation", th.as_tensor(np.sqrt(variance + epsilon)))
        self.clip = float(clip)

    def forward(self, observation: th.Tensor) -> th.Tensor:
        """Return normalized floats. The mean may be large relative to the deviation, so compute in double precision."""
        assert isinstance(self.mean, th.Tensor)
        assert isinstance(self.deviation, th.Tensor)
        scaled = (observation.double() - self.mean) / self.deviation
        return th.clamp(scaled, -self.clip, self.clip).float()


class Scale(nn.Module):
    """Multiplies flat observations (batch, k) by k constants, which are saved with the networks."""

    def __init__(self, scale: Sequence[float] | np.ndarray[Any, Any]) -> None:
        super().__init__()
        self.register_buffer("scale", th.as_tensor(scale, dtype=th.float32))

    def forward(self, observation: th.Tensor) -> th.Tensor:
        """Return the scaled observations."""
        assert isinstance(self.scale, th.Tensor)
        return observation * self.scale


class ObservationInput(nn.Module):
    """Module that converts one part of an observation to the floats that a network accepts.

    Args:
        space: Space of this part in the environment.
        normalization: Normalization of this part, if any.
        image: Whether to divide pixels by 255.
        transposed: Whether the network expects the channels of an image in front.
    """

    def __init__(
        self,
        space: spaces.Space[Any],
        normalization: Normalization | None = None,
        image: bool = False,
        transposed: bool = False,
    ) -> None:
        super().__init__()
        self.space, self.normalization, self.image, self.transposed = space, normalization, image, transposed

    def forward(self, observation: th.Tensor) -> th.Tensor:
        """Return floats, (batch, …)."""
        if self.normalization is not None:
            observation = self.normalization(observation)
        if self.transposed:
            observation = observation.movedim(-1, -3)
        if isinstance(self.space, spaces.Discrete):
            return _one_hot(observation, int(self.space.n))
        if isinstance(self.space, spaces.MultiDiscrete):
            columns = enumerate(self.space.nvec.flatten().tolist())
            return th.cat([_one_hot(observation[:, column], n) for column, n in columns], dim=-1)
        return observation.float() / 255.0 if self.image else observation.float()


def _one_hot(index: th.Tensor, n: int) -> th.Tensor:
    """Return a one-hot encoding of the indices, (batch, n) floats."""
    return (index.long().unsqueeze(-1) == th.arange(n)).float()


class Joined(nn.Module):
    """Module that concatenates the flattened parts of an observation and passes the result through layers."""

    def __init__(self, *layers: nn.Module) -> None:
        super().__init__()
        self.layers = nn.Sequential(*layers)

    def forward(self, observation: Any) -> tuple[th.Tensor, ...]:
        """Return the most probable actions, or the scores of discrete actions."""
        parts = list(observation.values()) if isinstance(observation, dict) else [observation]
        return (self.layers(th.cat([part.flatten(1) for part in parts], dim=1)),)


class PolicyGraph(TraceablePolicy):
    """A policy that maps an observation to an action.

    Args:
        network: Network that maps the preprocessed observation and the state of a recurrent policy to the mode of the
            action distribution or to the scores of discrete choices, followed by the next state.
        observation_space: Observation space of the environment.
        action_space: Action space of the environment.
        squashed: Whether the network's output is in [−1, 1] and must be scaled to the bounds of the action space.
        inputs: Preprocessing for each part of the observation, by key. By default, the parts are converted to floats.
        state_shapes: Shapes of the state of a recurrent policy, without the batch axis.
    """

    def __init__(
        self,
        network: nn.Module,
        observation_space: spaces.Space[Any],
        action_space: spaces.Space[Any],
        squashed: bool,
        inputs: Mapping[str, ObservationInput] | None = None,
        state_shapes: Sequence[tuple[int, ...]] = (),
    ) -> None:
        super().__init__(observation_space, action_space)
        self.network, self.squashed, self.state_shapes = network, squashed, state_shapes
        inputs = inputs or {key: ObservationInput(space) for key, space in self.spaces.items()}
        self.inputs = nn.ModuleList(inputs[key] for key in self.spaces)
        if isinstance(action_space, spaces.Box):
            self.register_buffer("low", th.as_tensor(action_space.low, dtype=th.float32))
            self.register_buffer("high", th.as_tensor(action_space.high, dtype=th.float32))

    def forward(self, *arguments: th.Tensor) -> tuple[th.Tensor, ...]:
        """Return the action, the scores of discrete choices, and the next state of a recurrent policy."""
        parts = [part(value) for part, value in zip(self.inputs, arguments, strict=False)]
        observation = parts[0] if "" in self.spaces else dict(zip(self.spaces, parts, strict=True))
        raw, *state = self.network(observation, *arguments[len(parts) :])
        return (*self._act(raw), *state)

    def _act(self, raw: th.Tensor) -> tuple[th.Tensor, ...]:
        space = self.action_space
        if isinstance(space, spaces.Discrete):
            return raw.argmax(dim=-1), raw
        if isinstance(space, spaces.MultiDiscrete):
            choices = th.split(raw, space.nvec.tolist(), dim=-1)
            return th.stack([choice.argmax(dim=-1) for choice in choices], dim=-1), raw
        if isinstance(space, spaces.MultiBinary):
            return (raw > 0.0).to(th.int8), raw  # logits: positive for probabilities above one half
        assert isinstance(self.low, th.Tensor)
        assert isinstance(self.high, th.Tensor)
        action = raw.reshape(-1, *self.low.shape)
        if self.squashed:
            action = self.low + 0.5 * (action + 1.0) * (self.high - self.low)
        return (th.minimum(th.maximum(action, self.low), self.high),)
