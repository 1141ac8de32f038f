"""Networks that map a window of frames to actions, with actions in [−1, 1]."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import torch as th
from torch import nn


class Perceptron(nn.Sequential):
    """Multilayer perceptron for a window, (batch, history, frame size), and one action, (batch, 1, action size).

    Args:
        history: Number of frames in a window.
        frame: Number of values in a frame.
        action: Number of values in an action.
        points: Number of values that pictures are reduced to, or 0 without cameras.
        widths: Widths of the hidden layers.
    """

    def __init__(self, history: int, frame: int, action: int, points: int, widths: Sequence[int]) -> None:
        layers: list[nn.Module] = [nn.Flatten()]
        for before, after in pairwise([history * frame + points, *widths]):
            layers += [nn.Linear(before, after), nn.ReLU()]
        super().__init__(*layers, nn.Linear(widths[-1], action), nn.Unflatten(1, (1, action)))

    def forward(self, window: th.Tensor, points: th.Tensor | None = None) -> th.Tensor:
        """Return one action, (batch, 1, action size), for a window and the points, (batch, points), of pictures."""
        inputs = window if points is None else th.cat([window.flatten(1), points], dim=1)
        action: th.Tensor = super().forward(inputs)  # type: ignore[no-untyped-call]
        return action


class ChunkTransformer(nn.Module):
    """Transformer that encodes a window and decodes a chunk of actions (Zhao et al. 2023), without a latent variable.

    Args:
        history: Number of frames in a window.
        frame: Number of values in a frame.
        action: Number of values in an action.
        points: Number of values that pictures are reduced to, or 0 without cameras.
        chunk: Number of actions.
        width: Width of all layers.
        heads: Number of attention heads.
        layers: Number of encoder layers and of decoder layers.
    """

    def __init__(
        self,
        history: int,
        frame: int,
        action: int,
        points: int,
        chunk: int,
        width: int,
        heads: int,
        layers: tuple[int, int],
    ) -> None:
        super().__init__()
        self.embed = nn.Sequential(nn.Linear(frame, 4 * width), nn.ReLU(), nn.Linear(4 * width, width))
        self.places = nn.Parameter(0.02 * th.randn(history, width))
        self.queries = nn.Parameter(0.02 * th.randn(chunk, width))
        self.encoder = nn.ModuleList(Block(width, heads, crossing=False) for _ in range(layers[0]))
        self.decoder = nn.ModuleList(Block(width, heads, crossing=True) for _ in range(layers[1]))
        self.head = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, action))
        self.look = nn.Linear(points, width) if points else None

    def forward(self, window: th.Tensor, points: th.Tensor | None = None) -> th.Tensor:
        """Return actions, (batch, chunk, action size), for a window and the points, (batch, points), of pictures."""
        memory = self.embed(window) + self.places
        if self.look is not None:
            memory = th.cat([memory, self.look(points)[:, None]], dim=1)
        for block in self.encoder:
            memory = block(memory, memory)
        tokens = self.queries + th.zeros_like(memory[:, :1])
        for block in self.decoder:
            tokens = block(tokens, memory)
        actions: th.Tensor = self.head(tokens)
        return actions


class Block(nn.Module):
    """Transformer layer with normalization before each part: self-attention, optional cross-attention, perceptron."""

    def __init__(self, width: int, heads: int, crossing: bool) -> None:
        super().__init__()
        self.attention = Attention(width, heads)
        self.crossing = Attention(width, heads) if crossing else None
        self.norms = nn.ModuleList(nn.LayerNorm(width) for _ in range(3))
        self.ahead = nn.Sequential(nn.Linear(width, 4 * width), nn.ReLU(), nn.Linear(4 * width, width))

    def forward(self, tokens: th.Tensor, memory: th.Tensor) -> th.Tensor:
        """Return new tokens, (batch, tokens, width)."""
        seen = self.norms[0](tokens)
        tokens = tokens + self.attention(seen, seen)
        if self.crossing is not None:
            tokens = tokens + self.crossing(self.norms[1](tokens), memory)
        ahead: th.Tensor = tokens + self.ahead(self.norms[2](tokens))
        return ahead


class Attention(nn.Module):
    """Multi-head attention, written with operators that every ONNX runtime has."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads, self.size = heads, width // heads
        self.query, self.key, self.value, self.out = (nn.Linear(width, width) for _ in range(4))

    def forward(self, tokens: th.Tensor, memory: th.Tensor) -> th.Tensor:
        """Return what the tokens read from the memory, (batch, tokens, width)."""
        query, key, value = (
            self._split(self.query(tokens)),
            self._split(self.key(memory)),
            self._split(self.value(memory)),
        )
        weights = th.softmax(query @ key.transpose(-1, -2) / self.size**0.5, dim=-1)
        read: th.Tensor = self.out((weights @ value).transpose(1, 2).flatten(2))
        return read

    def _split(self, tokens: th.Tensor) -> th.Tensor:
        return tokens.reshape(tokens.shape[0], tokens.shape[1], self.heads, self.size).transpose(1, 2)
