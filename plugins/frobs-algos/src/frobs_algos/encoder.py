"""Encoder of pictures."""

from __future__ import annotations

import torch as th
from torch import nn

__all__ = ["SMALLEST", "Encoder"]

SMALLEST = 20
"""Smallest height and width of a picture that :class:`Encoder` can process [pixels]."""

_CHANNELS = (32, 48, 48)


class Encoder(nn.Module):
    """Convolutional network that reduces a picture to points (Levine et al. 2016, spatial softmax).

    Each channel of the last layer becomes the expected position of its activations in the picture, x and y in [−1, 1].

    Args:
        channels: Number of channels of a picture.

    Attributes:
        size: Number of values that a picture is reduced to.
    """

    size = 2 * _CHANNELS[-1]

    def __init__(self, channels: int) -> None:
        super().__init__()
        first, second, third = _CHANNELS
        self.layers = nn.Sequential(
            nn.Conv2d(channels, first, 5, 2),
            nn.ReLU(),
            nn.Conv2d(first, second, 3, 2),
            nn.ReLU(),
            nn.Conv2d(second, third, 3),
            nn.ReLU(),
        )

    def forward(self, pictures: th.Tensor) -> th.Tensor:
        """Return the points, (batch, size), for pictures, (batch, channels, height, width) in [−0.5, 0.5]."""
        maps = self.layers(pictures)
        height, width = maps.shape[2:]
        weights = th.softmax(maps.flatten(2), dim=2).reshape(*maps.shape[:2], height, width)
        x = (weights.sum(2) * th.linspace(-1.0, 1.0, width, device=maps.device)).sum(2)
        y = (weights.sum(3) * th.linspace(-1.0, 1.0, height, device=maps.device)).sum(2)
        return th.cat([x, y], dim=1)
