"""Pictures of cameras: their encoders and their augmentation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import gymnasium as gym
import torch as th
from torch import nn

from frobs_algos.encoder import SMALLEST, Encoder
from frobs_core.util.errors import IncompatibleSpaceError


def check_pictures(owner: str, spaces: Mapping[str, gym.Space[Any]]) -> None:
    """Raise IncompatibleSpaceError if a picture is too small for :class:`Encoder`."""
    for name, space in spaces.items():
        height, width, _ = space.shape or (0, 0, 0)
        if min(height, width) < SMALLEST:
            raise IncompatibleSpaceError(
                owner,
                space,
                f"needs pictures of at least {SMALLEST} x {SMALLEST} pixels, but '{name}' has {height} x {width}; "
                "set a larger size.",
            )


def as_input(pictures: th.Tensor) -> th.Tensor:
    """Return pictures, (batch, height, width, channels) uint8, as (batch, channels, height, width) in [−0.5, 0.5]."""
    return pictures.permute(0, 3, 1, 2).float() / 255.0 - 0.5


def augmented(pictures: th.Tensor, shift: int, color: float, generator: th.Generator) -> th.Tensor:
    """Return pictures that are shifted and colored at random, each in its own way, as the network's input.

    Args:
        pictures: (batch, height, width, channels) uint8.
        shift: Maximum shift in each direction [pixels]. The pixels at the border are repeated.
        color: Maximum relative change of the contrast and of each channel's brightness.
        generator: Random numbers.
    """
    batch, height, width, channels = pictures.shape
    if shift:
        moves = th.randint(-shift, shift + 1, (2, batch, 1), generator=generator)
        rows = (th.arange(height) + moves[0]).clamp(0, height - 1)
        columns = (th.arange(width) + moves[1]).clamp(0, width - 1)
        pictures = pictures[th.arange(batch)[:, None, None], rows[:, :, None], columns[:, None, :]]
    inputs = as_input(pictures)
    if color:
        contrast, brightness = (
            color * (2.0 * th.rand((batch, count, 1, 1), generator=generator) - 1.0) for count in (1, channels)
        )
        inputs = inputs * (1.0 + contrast) + 0.5 * brightness
    return inputs


class Eyes(nn.ModuleList):
    """One encoder for each camera.

    Args:
        spaces: Spaces of the pictures.

    Attributes:
        size: Number of values that the pictures are reduced to.
    """

    def __init__(self, spaces: Iterable[gym.Space[Any]]) -> None:
        super().__init__(Encoder((space.shape or ())[-1]) for space in spaces)
        self.size = len(self) * Encoder.size

    def forward(self, pictures: Sequence[th.Tensor]) -> th.Tensor:
        """Return the points, (batch, size), for one input of :class:`Encoder` per camera."""
        return th.cat([encoder(each) for encoder, each in zip(self, pictures, strict=True)], dim=1)
