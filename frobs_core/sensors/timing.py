"""Seconds of a sensor in control steps of an environment."""

from __future__ import annotations

from frobs_core.errors import SensorSettingError
from frobs_core.interfaces import Sensor

_CLOSE = 1e-6


def count_period(name: str, sensor: Sensor, control_timestep: float) -> int:
    """Return the control steps from one sample to the next.

    A sensor that takes a whole number of samples in each control step is read at its newest: the period is 1.

    Args:
        name: Of the sensor, for the message.
        sensor: Whose rate it is.
        control_timestep: [s]

    Raises:
        ConfigurationError: Samples and control steps do not meet; the nearest rates are named.
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
    raise SensorSettingError(
        name,
        f"a rate of {sensor.rate:g} Hz, which does not meet the control steps of "
        f"{control_timestep:g} s; {possible} Hz would, as in sensors={{'{name}': {{'rate': {min(rates):.10g}}}}}, or another "
        "control_timestep.",
    )


def count_delay(name: str, sensor: Sensor, control_timestep: float) -> int:
    """Return the control steps from a sample to when it is read.

    Args:
        name: Of the sensor, for the message.
        sensor: Whose delay it is.
        control_timestep: [s]

    Raises:
        ConfigurationError: The delay is no whole multiple of the control step; the nearest are named.
    """
    steps = sensor.delay / control_timestep
    whole = round(steps)
    if abs(steps - whole) > _CLOSE * max(whole, 1):
        near = [f"{count * control_timestep:.10g}" for count in (int(steps), int(steps) + 1)]
        raise SensorSettingError(
            name,
            f"a delay of {sensor.delay:g} s, which is no whole multiple of the control_timestep of "
            f"{control_timestep:g} s; {' or '.join(near)} s would be, as in sensors={{'{name}': {{'delay': {near[1]}}}}}.",
        )
    return whole
