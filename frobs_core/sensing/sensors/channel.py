"""Converts true values into the readings of an imperfect sensor, at times that are counted in control steps."""

from __future__ import annotations

import numpy as np

from frobs_core.contracts import Snapshot, Stateful
from frobs_core.description import Sensor
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import SettingError
from frobs_core.util.random import RandomSource

_CLOSE = 1e-6

MAX_DELAY = 1_000
"""Maximum delay of a sensor or camera [control steps], because all samples that have not arrived are stored."""


class Channel(Stateful):
    """Samples of one sensor, including samples that have not arrived yet.

    Samples are taken at a reset and every ``period`` control steps after the reset. Each sample becomes readable
    ``delay`` steps after it was taken. The first sample of an episode is returned until later samples arrive, as if the
    robot had been in the same state for a long time. The name of the random stream is unique for each sensor.
    """

    def __init__(self, stream: str, sensor: Sensor, num_envs: int, period: int, delay: int) -> None:
        self._noise_stream, self._dropout_stream = f"{stream}/noise", f"{stream}/dropout"
        self._sensor, self._period = sensor, period
        (self._low, self._high), self._lost = sensor.bounds, sensor.lost
        self._noise, self._resolution = np.asarray(sensor.noise), np.asarray(sensor.resolution)
        # Divisor that is never 0. Elements without a resolution do not use the result of the division.
        self._grain = np.where(self._resolution > 0.0, self._resolution, 1.0)
        self._samples: Floats = np.zeros((num_envs, delay + 1, sensor.width))  # of the last control steps, newest first
        self._everywhere = np.ones(num_envs, np.bool_)

    @property
    def reading(self) -> Floats:
        """Sample that arrives at the current step, (num_envs, width)."""
        arriving: Floats = self._samples[:, -1]
        return arriving

    def due(self, rng: RandomSource) -> Mask:
        """Return a mask of the environments whose sensor takes a sample at this step, (num_envs,) bool."""
        if self._period == 1:
            return self._everywhere
        due: Mask = rng.steps % np.uint64(self._period) == 0
        return due

    def reset(self, rng: RandomSource, true: Floats, mask: Mask) -> None:
        """Take the first sample of an episode in the environments in ``mask``, given the true values (num_envs, width)."""
        sample = self._spoil(rng, true[mask], mask)
        if self._sensor.dropout and self._lost is not None:
            sample = self._lose(rng, sample, mask)
        self._samples[mask] = sample[:, None]

    def advance(self, rng: RandomSource, true: Floats | None, due: Mask) -> None:
        """Advance by one control step, and take samples in the environments ``due``.

        The true values, (num_envs, width), are None if no environment takes a sample.
        """
        if self._samples.shape[1] > 1:
            self._samples[:, 1:] = self._samples[:, :-1].copy()
        if true is None:
            return
        sample = self._spoil(rng, true[due], due)
        if self._sensor.dropout:
            if self._lost is None:
                kept = rng.uniform(self._dropout_stream, mask=due) >= self._sensor.dropout
                sample = np.where(kept[:, None], sample, self._samples[due, 0])
            else:
                sample = self._lose(rng, sample, due)
        self._samples[due, 0] = sample

    def _spoil(self, rng: RandomSource, true: Floats, mask: Mask) -> Floats:
        """Add noise to true values, (n, width), round them to the resolution, and clip them to the range."""
        if not self._noise.any() and not self._resolution.any():
            return true
        sample = true
        if self._noise.any():
            sample = sample + self._noise * rng.normal(self._noise_stream, shape=(self._sensor.width,), mask=mask)
        if self._resolution.any():
            sample = np.where(self._resolution > 0.0, np.rint(sample / self._grain) * self._grain, sample)
        sample = np.clip(sample, self._low, self._high)
        return sample if self._lost is None else np.where(true == self._lost, true, sample)

    def _lose(self, rng: RandomSource, sample: Floats, mask: Mask) -> Floats:
        """Replace randomly selected elements of samples, (n, width), with the reading that indicates a dropout."""
        kept = rng.uniform(self._dropout_stream, shape=(self._sensor.width,), mask=mask) >= self._sensor.dropout
        return np.where(kept, sample, np.asarray(self._lost, np.float64))

    def stored_arrays(self) -> Snapshot:
        return {"samples": self._samples}


def count_period(keyword: str, name: str, sensor: Sensor, control_timestep: float) -> int:
    """Return the number of control steps from one sensor sample to the next.

    Args:
        keyword: Keyword of the environment under which the sensor is set.
        name: Name of the sensor under the keyword.
        sensor: The sensor.
        control_timestep: [s]

    If a sensor takes a whole number of samples during each control step, the period is 1, because only the latest
    sample is read.
    """
    if sensor.rate is None:
        return 1
    steps = 1.0 / (sensor.rate * control_timestep)
    if steps < 1.0 and abs(round(1.0 / steps) * steps - 1.0) < _CLOSE:
        return 1
    nearest = round(steps)
    if nearest >= 1 and abs(steps - nearest) < _CLOSE * nearest:
        return nearest
    if steps > 1.0:
        rates = [1.0 / (control_timestep * int(steps)), 1.0 / (control_timestep * (int(steps) + 1))]
    else:
        rates = [int(1.0 / steps) / control_timestep, (int(1.0 / steps) + 1) / control_timestep]
    possible = " or ".join(f"{rate:.10g}" for rate in sorted(rates))
    raise SettingError(
        f"{keyword}.{name}",
        f"a rate of {sensor.rate:g} Hz does not fit the control_timestep of {control_timestep:g} s; "
        f"use {possible} Hz, as in {keyword}={{'{name}': {{'rate': {min(rates):.10g}}}}}, "
        "or change the control_timestep.",
    )


def count_delay(keyword: str, name: str, sensor: Sensor, control_timestep: float) -> int:
    """Return the number of control steps between taking a sample and reading it; see :func:`count_period`."""
    steps = sensor.delay / control_timestep
    nearest = round(steps)
    if abs(steps - nearest) > _CLOSE * max(nearest, 1):
        near = [f"{count * control_timestep:.10g}" for count in (int(steps), int(steps) + 1)]
        raise SettingError(
            f"{keyword}.{name}",
            f"a delay of {sensor.delay:g} s is not a multiple of the control_timestep of {control_timestep:g} s; "
            f"use {' or '.join(near)} s, as in {keyword}={{'{name}': {{'delay': {near[1]}}}}}.",
        )
    if nearest > MAX_DELAY:
        raise SettingError(
            f"{keyword}.{name}",
            f"a delay of {sensor.delay:g} s is {nearest:,} control steps; at most {MAX_DELAY:,} are possible, which is "
            f"{MAX_DELAY * control_timestep:g} s.",
        )
    return nearest
