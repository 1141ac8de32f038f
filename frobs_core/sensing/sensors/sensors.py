"""The sensors of a robot, for use in a task."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import gymnasium as gym
import numpy as np

from frobs_core.contracts import Simulation, Snapshot, Stateful
from frobs_core.description import ObservationTerm, Sensor
from frobs_core.sensing.sensors.channel import Channel, count_delay, count_period
from frobs_core.sensing.sensors.instrument import Instrument, instrument_of
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import check_name
from frobs_core.util.random import RandomSource


class Sensors(Stateful):
    """The sensors of a robot in all environments.

    A task creates a ``Sensors`` object in ``bind``. The task calls :meth:`reset` at the end of its own ``reset``, when
    the robot and the scene are in place, calls :meth:`advance` in its own ``advance``, and includes :meth:`snapshot` in
    its own snapshot. Readings refer to the time of the last :meth:`reset` or :meth:`advance`, so read the sensors
    before you move any object. Each environment of a vector environment reads the same values as a single environment
    would.

    An ideal sensor has no noise, resolution, delay or dropout, and takes a sample at each control step. Such a sensor
    is evaluated only when it is read, so an unused sensor takes no computing time.

    Args:
        simulation: Simulation to measure in.
        control_timestep: [s]
        robot: Name of the robot in the simulation.
        names: Sensors that the task reads, or None for all sensors of the robot.

    Raises:
        UnknownNameError: The robot or a sensor does not exist.
        ConfigurationError: The rate or the delay of a sensor is incompatible with the control timestep.
    """

    def __init__(
        self, simulation: Simulation, control_timestep: float, robot: str = "robot", names: Sequence[str] | None = None
    ) -> None:
        check_name("robot of the simulation", robot, simulation.robots)
        handle = simulation.robots[robot]
        there = handle.robot.sensors
        self._num_envs = simulation.num_envs
        self._sensors: dict[str, Sensor] = {}
        for name in there if names is None else names:
            check_name(f"sensor of robot '{handle.robot.name}'", name, there)
            self._sensors[name] = there[name]
        self._instruments = {
            name: instrument_of(sensor)(name, sensor, simulation, handle, control_timestep)
            for name, sensor in self._sensors.items()
        }
        self._channels: dict[str, Channel] = {}
        for name, sensor in self._sensors.items():
            period = count_period("sensors", name, sensor, control_timestep)
            delay = count_delay("sensors", name, sensor, control_timestep)
            if period > 1 or not sensor.is_ideal:
                self._channels[name] = Channel(f"sensor/{robot}/{name}", sensor, self._num_envs, period, delay)
        self._readings: dict[str, Floats] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the available sensors."""
        return tuple(self._sensors)

    def term(self, name: str) -> ObservationTerm:
        """Return an observation term that reads the sensor ``name``.

        Raises:
            UnknownNameError: The sensor does not exist.
        """
        space, unit = self.space(name), self._sensors[name].unit
        return ObservationTerm(
            read=lambda: self.read(name), low=space.low, high=space.high, unit=unit, proprioceptive=True
        )

    def space(self, name: str) -> gym.spaces.Box:
        """Return the space of the sensor ``name`` in one environment: (width,) float32, in the sensor's unit.

        Raises:
            UnknownNameError: The sensor does not exist.
        """
        sensor = self._sensor(name)
        low, high = sensor.bounds
        return gym.spaces.Box(np.float32(low), np.float32(high), (sensor.width,), np.float32)

    def reset(self, mask: Mask | None, rng: RandomSource) -> None:
        """Take the first samples of an episode. The robot and the scene must be in place.

        Args:
            mask: The environments to reset.
            rng: Random source that was passed to the task's reset.
        """
        self._readings.clear()
        rows = np.ones(self._num_envs, np.bool_) if mask is None else mask
        for name, instrument in self._instruments.items():
            instrument.reset(mask)
            if name in self._channels:
                self._channels[name].reset(rng, instrument.measure(), rows)

    def advance(self, rng: RandomSource) -> None:
        """Advance by one control step, with the step's random source. Call it after the simulation has stepped."""
        self._readings.clear()
        for name, instrument in self._instruments.items():
            instrument.advance()
            if name in self._channels:
                channel = self._channels[name]
                due = channel.due(rng)
                channel.advance(rng, instrument.measure() if due.any() else None, due)

    def read(self, name: str) -> Floats:
        """Return the reading of the sensor ``name`` in its unit, (num_envs, width) float64.

        The array is read-only and valid until the next step.

        Raises:
            UnknownNameError: The sensor does not exist.
        """
        found = self._readings.get(name)
        if found is None:
            self._sensor(name)
            channel = self._channels.get(name)
            found = (self._instruments[name].measure() if channel is None else channel.reading).view()
            found.flags.writeable = False
            self._readings[name] = found
        return found

    def _sensor(self, name: str) -> Sensor:
        check_name("sensor", name, self._sensors)
        return self._sensors[name]

    def stored_parts(self) -> Mapping[str, Instrument | Channel]:
        instruments = {f"sensor/{name}": instrument for name, instrument in self._instruments.items()}
        return {**instruments, **{f"sensor/{name}/read": channel for name, channel in self._channels.items()}}

    def restore(self, snapshot: Snapshot) -> None:
        self._readings.clear()
        super().restore(snapshot)
