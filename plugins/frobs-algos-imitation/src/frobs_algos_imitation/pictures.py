"""Pictures of cameras: their encoders, their augmentation, and the memory that they need."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch as th
from torch import nn

from frobs_algos.encoder import SMALLEST, Encoder
from frobs_core.util.errors import ConfigurationError, IncompatibleSpaceError


def is_picture(space: gym.Space[Any]) -> bool:
    """Return whether a space contains pictures, (height, width, channels) uint8."""
    return isinstance(space, gym.spaces.Box) and space.dtype == np.uint8 and len(space.shape) == 3


def picture_bytes(spaces: Iterable[gym.Space[Any]]) -> int:
    """Return the number of bytes of the pictures of one observation, which consists of ``spaces``."""
    return sum(int(np.prod(space.shape or ())) for space in spaces if is_picture(space))


def require_memory(owner: str, spaces: Mapping[str, gym.Space[Any]], steps: int, advice: str) -> None:
    """Check that the pictures of ``steps`` observations fit into the memory that is available.

    Args:
        owner: Who keeps the pictures.
        spaces: Spaces of the parts of an observation.
        steps: Number of observations.
        advice: What the user can do, in which ``{steps}`` stands for the number of observations that fits.

    Raises:
        ConfigurationError: They do not fit.
    """
    size, available = picture_bytes(spaces.values()), available_memory()
    if size * steps > available:
        raise ConfigurationError(
            f"{owner}: the pictures of {steps:,} steps need {size * steps / 1e9:.1f} GB of memory, but "
            f"{available / 1e9:.1f} GB are available; {advice.format(steps=f'{available // size:,}')}"
        )


def available_memory() -> int:
    """Return the memory [bytes] that this process can still use, within the limits of its control group."""
    free = [2**63]
    with suppress(OSError, ValueError):
        lines = dict(line.split(":") for line in Path("/proc/meminfo").read_text("ascii").splitlines())
        free.append(1024 * int(lines["MemAvailable"].split()[0]))
    with suppress(OSError, ValueError):
        limit, used = (int(Path(f"/sys/fs/cgroup/memory.{name}").read_text("ascii")) for name in ("max", "current"))
        free.append(limit - used)
    if len(free) == 1:
        with suppress(OSError, ValueError, AttributeError):
            free.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    return max(0, min(free))


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
