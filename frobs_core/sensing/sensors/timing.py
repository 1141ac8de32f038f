"""Converts sensor rates and delays to numbers of control steps."""

from __future__ import annotations

from frobs_core.description import Sensor
from frobs_core.util.errors import SettingError

_CLOSE = 1e-6


def count_period(name: str, sensor: Sensor, control_timestep: float) -> int:
    """Return the number of control steps from one sensor sample to the next.

    If a sensor takes a whole number of samples during each control step, the period is 1, because only the latest
    sample is read.
    """
    if sensor.rate is None:
        return 1
    steps = 1.0 / (sensor.rate * control_timestep)
    if steps < 1.0 and abs(round(1.0 / steps) * steps - 1.0) < _CLOSE:
        return 1
    whole = round(steps)
    if whole >= 1 and abs(steps - whole) < _CLOSE * whole:
        return whole
    if steps > 1.0:
        rates = [1.0 / (control_timestep * int(steps)), 1.0 / (control_timestep * (int(steps) + 1))]
    else:
        rates = [int(1.0 / steps) / control_timestep, (int(1.0 / steps) + 1) / control_timestep]
    possible = " or ".join(f"{rate:.10g}" for rate in sorted(rates))
    raise SettingError(
        f"sensors.{name}",
        f"a rate of {sensor.rate:g} Hz does not fit the control_timestep of {control_timestep:g} s; "
        f"use {possible} Hz, as in sensors={{'{name}': {{'rate': {min(rates):.10g}}}}}, "
        "or change the control_timestep.",
    )


def count_delay(name: str, sensor: Sensor, control_timestep: float) -> int:
    """Return the number of control steps between taking a sample and reading it."""
    steps = sensor.delay / control_timestep
    whole = round(steps)
    if abs(steps - whole) > _CLOSE * max(whole, 1):
        near = [f"{count * control_timestep:.10g}" for count in (int(steps), int(steps) + 1)]
        raise SettingError(
            f"sensors.{name}",
            f"a delay of {sensor.delay:g} s is not a multiple of the control_timestep of {control_timestep:g} s; "
            f"use {' or '.join(near)} s, as in sensors={{'{name}': {{'delay': {near[1]}}}}}.",
        )
    return whole
