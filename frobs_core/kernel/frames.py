"""Pictures of a camera with a frame rate, noise or a delay."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from frobs_core.contracts import Stateful
from frobs_core.description import Sensor
from frobs_core.sensing.sensors.channel import Channel, count_delay, count_period
from frobs_core.util.arrays import Mask
from frobs_core.util.random import RandomSource

Draw = Callable[[Mask], np.ndarray[Any, Any]]
"""Function that draws the pictures of the k environments in a mask, (k, height, width, channels)."""


@dataclass(frozen=True, kw_only=True)
class _Film(Sensor):
    """Values that a camera records, in [0, ``highest``]."""

    type_name: ClassVar[str] = "camera"

    numbers: int
    highest: float

    @property
    def width(self) -> int:
        return self.numbers

    @property
    def bounds(self) -> tuple[float, float]:
        return 0.0, self.highest


class Frames(Stateful):
    """The newest pictures that have arrived from a camera in all environments.

    Args:
        name: Name of the observation term.
        draw: Function that draws pictures.
        low: Lower bound of a picture, (height, width, channels), which also states the type of the pictures.
        high: Upper bound of a picture, (height, width, channels).
        settings: ``camera``, ``rate`` [Hz], ``noise`` in the unit of the pictures, and ``delay`` [s].
        num_envs: Number of environments.
        control_timestep: [s]

    Attributes:
        is_ideal: Whether the pictures have neither noise nor delay.

    Raises:
        ConfigurationError: A setting is out of range, or does not fit the control timestep.
    """

    def __init__(
        self,
        name: str,
        draw: Draw,
        low: np.ndarray[Any, Any],
        high: np.ndarray[Any, Any],
        settings: Mapping[str, Any],
        num_envs: int,
        control_timestep: float,
    ) -> None:
        rate, noise, delay = (settings[key] for key in ("rate", "noise", "delay"))
        film = _Film(
            frame=settings["camera"], rate=rate, noise=noise, delay=delay, numbers=low.size, highest=high.flat[0]
        )
        period, steps = (count("observations", name, film, control_timestep) for count in (count_period, count_delay))
        self.is_ideal = film.is_ideal
        self._draw, self._picture = draw, low
        self._channel = Channel(f"camera/{name}", film, num_envs, period, steps)
        self._true = np.zeros((num_envs, low.size))

    def reset(self, mask: Mask | None, rng: RandomSource) -> None:
        """Take the first picture of an episode in the environments selected by ``mask``."""
        rows = np.ones(len(self._true), np.bool_) if mask is None else mask
        self._channel.reset(rng, self._drawn(rows), rows)

    def advance(self, rng: RandomSource) -> None:
        """Advance by one control step, and take the pictures that are due."""
        due = self._channel.due(rng)
        self._channel.advance(rng, self._drawn(due) if due.any() else None, due)

    def read(self) -> np.ndarray[Any, Any]:
        """Return the pictures that have arrived, (num_envs, height, width, channels)."""
        numbers = self._channel.reading.reshape(-1, *self._picture.shape)
        pictures = np.rint(numbers) if self._picture.dtype.kind == "u" else numbers
        return pictures.astype(self._picture.dtype)

    def _drawn(self, rows: Mask) -> np.ndarray[Any, Any]:
        self._true[rows] = self._draw(rows).reshape(-1, self._picture.size)
        return self._true

    def stored_parts(self) -> Mapping[str, Channel]:
        return {"arriving": self._channel}
