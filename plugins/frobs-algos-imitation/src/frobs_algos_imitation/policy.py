"""The policy of an imitation algorithm: normalization, memory, network and averaging of chunks in one module.

Training, prediction and the export to ONNX use the same module, so they cannot differ.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch as th
from gymnasium import spaces
from torch import nn

from frobs_algos.onnx import TraceablePolicy
from frobs_algos.spaces import is_picture
from frobs_algos_imitation.pictures import Eyes, as_input
from frobs_core.description import Observation

Frames = np.ndarray[Any, np.dtype[np.float32]]
Pictures = np.ndarray[Any, np.dtype[np.uint8]]

STEADY = 1e-3
"""Constant that is added to standard deviations, so that values that hardly change are not amplified."""


class ImitationPolicy(TraceablePolicy):
    """Policy that sees the last ``history`` frames and predicts the next ``chunk`` actions.

    A frame is a flat observation without its pictures. With a history, the previous action follows, which is zero at the
    start of an episode. The policy sees only the latest pictures.
    The state of a policy with a history is the window of the last frames, (batch, history, frame size), and the last
    action, (batch, action size). The state of a policy with chunks is, for each future action, the weighted sum of its
    predictions, the sum of the weights, and the number of predictions, (batch, chunk, action size + 2).

    Args:
        observation_space: Observation space of a single environment.
        action_space: Bounded action space of a single environment.
        make_network: Function that returns a network for a frame size, an action size and a number of points. The
            network maps normalized windows, (batch, history, frame size), and the points of the pictures, (batch,
            points), to normalized actions, (batch, chunk, action size).
        history: Number of frames.
        chunk: Number of actions.
        ensemble: Decay rate of the weights with which predictions are averaged.
    """

    mean: th.Tensor
    deviation: th.Tensor
    low: th.Tensor
    high: th.Tensor

    def __init__(
        self,
        observation_space: spaces.Space[Any],
        action_space: spaces.Box,
        make_network: Callable[[int, int, int], nn.Module],
        history: int,
        chunk: int = 1,
        ensemble: float = 0.0,
    ) -> None:
        super().__init__(observation_space, action_space)
        self.history, self.chunk, self.ensemble = history, chunk, ensemble
        self.shape = action_space.shape
        self.cameras = [name for name, space in self.spaces.items() if is_picture(space)]
        vectors = [space for name, space in self.spaces.items() if name not in self.cameras]
        self.size = sum(int(np.prod(space.shape or ())) for space in vectors)
        self.acted = int(np.prod(self.shape))
        self.frame = self.size + (self.acted if history > 1 else 0)
        window = [(history, self.frame), (self.acted,)] if history > 1 else []
        self.state_shapes = [*window, (chunk, self.acted + 2)] if chunk > 1 else window
        eyes = Eyes(self.spaces[name] for name in self.cameras)
        self.network = make_network(self.frame, self.acted, eyes.size)
        self.eyes = eyes if self.cameras else None
        self.register_buffer("mean", th.zeros(self.frame))
        self.register_buffer("deviation", th.ones(self.frame))
        self.register_buffer("low", th.as_tensor(action_space.low.ravel(), dtype=th.float32))
        self.register_buffer("high", th.as_tensor(action_space.high.ravel(), dtype=th.float32))

    def normalize(self, frames: th.Tensor) -> None:
        """Store the mean and the standard deviation of the frames, (n, frame size)."""
        self.mean.copy_(frames.mean(0))
        self.deviation.copy_(frames.std(0, unbiased=False) + STEADY)

    def split(self, observation: Observation) -> tuple[Frames, dict[str, Pictures]]:
        """Return a batch of observations as frames without the previous action, (n, k) float32, and pictures by camera."""
        parts = observation if isinstance(observation, dict) else {"": observation}
        vectors = [np.reshape(parts[name], (len(parts[name]), -1)) for name in self.spaces if name not in self.cameras]
        pictures = {name: np.asarray(parts[name]) for name in self.cameras}
        if not vectors:
            return np.empty((len(next(iter(pictures.values()))), 0), np.float32), pictures
        return np.concatenate(vectors, axis=1, dtype=np.float32), pictures

    def predictions(self, window: th.Tensor, pictures: Sequence[th.Tensor] = ()) -> th.Tensor:
        """Return the network's actions, (batch, chunk, action size) in [−1, 1].

        Args:
            window: Windows of raw frames, (batch, history, frame size).
            pictures: Inputs of :attr:`eyes`, one for each camera.
        """
        seen = () if self.eyes is None else (self.eyes(pictures),)
        predicted: th.Tensor = self.network((window - self.mean) / self.deviation, *seen)
        return predicted

    def scaled(self, actions: th.Tensor) -> th.Tensor:
        """Return actions of the environment, (…, action size), scaled to [−1, 1]."""
        return 2.0 * (actions - self.low) / (self.high - self.low) - 1.0

    def forward(self, *inputs: th.Tensor) -> tuple[th.Tensor, ...]:
        """Return the action and the next state, for the inputs of :meth:`examples`."""
        count = len(self.spaces)
        parts, state = dict(zip(self.spaces, inputs[:count], strict=True)), inputs[count:-1]
        pictures = [as_input(parts.pop(name)) for name in self.cameras]
        vectors = [part.flatten(1).float() for part in parts.values()]
        if not vectors:  # the policy sees nothing but pictures
            vectors = [inputs[0].flatten(1)[:, :0].float()]
        frame = th.cat(vectors, dim=1)  # (batch, observation size)
        following: list[th.Tensor] = []
        fresh = inputs[-1].float()[
            :, None, None
        ]  # (batch, 1, 1), 1.0 at the start of an episode; unused without a state
        if self.history > 1:
            frame = th.cat([frame, (1.0 - fresh[:, 0]) * state[1]], dim=1)
            window = th.cat([state[0][:, 1:], frame[:, None]], dim=1)
            window = fresh * frame[:, None] + (1.0 - fresh) * window
            following.append(window)
        else:
            window = frame[:, None]
        predicted = self.predictions(window, pictures)
        if self.chunk > 1:
            averaged = self._add(predicted, (1.0 - fresh) * state[-1])
            predicted = averaged[:, :, :-2] / averaged[:, :, -2:-1]
            following.append(averaged)
        action = self.low + 0.5 * (predicted[:, 0] + 1.0) * (self.high - self.low)
        action = th.minimum(th.maximum(action, self.low), self.high)
        if self.history > 1:
            following.insert(1, action)
        return (action.reshape(-1, *self.shape), *following)

    def _add(self, predicted: th.Tensor, state: th.Tensor) -> th.Tensor:
        """Return the state of the predictions after one control step, with new predictions added."""
        state = th.cat([state[:, 1:], th.zeros_like(state[:, :1])], dim=1)
        count = state[:, :, -1:]
        weight = th.exp(-self.ensemble * count)
        return th.cat([state[:, :, :-2] + weight * predicted, state[:, :, -2:-1] + weight, count + 1.0], dim=2)
