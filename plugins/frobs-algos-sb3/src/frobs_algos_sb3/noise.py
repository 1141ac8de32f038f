"""Noise that is added to actions during data collection."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import numpy as np
from pydantic import NonNegativeFloat, PositiveFloat
from stable_baselines3.common.noise import (
    ActionNoise,
    NormalActionNoise,
    OrnsteinUhlenbeckActionNoise,
    VectorizedActionNoise,
)

from frobs_algos.settings import Settings
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ParameterValueError


class ActionNoiseConfig(Settings):
    """Settings of the noise that is added to actions in [−1, 1].

    Attributes:
        type: ``normal`` for noise that is independent at each step, or ``ornstein_uhlenbeck`` for noise that is
            correlated in time and reset at the start of each episode.
        mean: Mean of the noise: one number for all action components, or one per component.
        sigma: Standard deviation of the noise: one number for all action components, or one per component.
        theta: Rate at which ``ornstein_uhlenbeck`` noise returns to the mean.
        dt: Time step of ``ornstein_uhlenbeck`` noise.
    """

    type: Literal["normal", "ornstein_uhlenbeck"] = "normal"
    mean: float | list[float] = 0.0
    sigma: NonNegativeFloat | list[NonNegativeFloat] = 0.1
    theta: PositiveFloat = 0.15
    dt: PositiveFloat = 1e-2

    def build(self, num_envs: int, size: int) -> ActionNoise:
        """Return the noise for ``num_envs`` environments and ``size`` action components."""
        mean, sigma = (self._spread(name, size) for name in ("mean", "sigma"))
        if self.type == "normal":
            base: ActionNoise = NormalActionNoise(mean, sigma)
        else:
            base = OrnsteinUhlenbeckActionNoise(mean, sigma, self.theta, self.dt)
        if num_envs == 1:
            return base
        if self.type == "normal":
            return BatchedNormal(base, num_envs, mean, sigma)
        return VectorizedActionNoise(base, num_envs)

    def _spread(self, name: str, size: int) -> Floats:
        value = np.asarray(getattr(self, name), np.float64)
        if value.ndim and len(value) != size:
            raise ParameterValueError(
                name, value, f"one number, or a list of {size} numbers, one for each action component", "action_noise"
            )
        return np.broadcast_to(value, (size,)).copy()


class BatchedNormal(VectorizedActionNoise):
    """Normal noise that is drawn for all environments at once, with a mean and a standard deviation of shape (k,)."""

    def __init__(self, base_noise: ActionNoise, n_envs: int, mean: Floats, sigma: Floats) -> None:
        super().__init__(base_noise, n_envs)
        self._mean, self._sigma = mean, sigma

    def __call__(self) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
        """Draw noise, (n_envs, k)."""
        drawn = np.random.normal(self._mean, self._sigma, (self.n_envs, len(self._mean)))  # noqa: NPY002  # SB3's RNG
        return drawn.astype(np.float32)

    def reset(self, indices: Iterable[int] | None = None) -> None:
        """Do nothing, because the noise has no state."""


def noise_state(noise: ActionNoise | None) -> Floats | None:
    """Return the state of correlated noise, (num_envs, k), or None for noise without state."""
    noises = _correlated(noise)
    return np.stack([noise_process.noise_prev for noise_process in noises]) if noises else None


def restore_noise(noise: ActionNoise | None, state: Floats) -> None:
    """Restore the state of correlated noise."""
    for noise_process, row in zip(_correlated(noise), state, strict=True):
        noise_process.noise_prev = row.copy()


def _correlated(noise: ActionNoise | None) -> list[OrnsteinUhlenbeckActionNoise]:
    noises = noise.noises if isinstance(noise, VectorizedActionNoise) else [noise]
    return [noise_process for noise_process in noises if isinstance(noise_process, OrnsteinUhlenbeckActionNoise)]
