"""What measures, without any fault, for one sensor of a robot."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from importlib import import_module
from typing import Any

from frobs_core.arrays import Floats, Mask
from frobs_core.errors import PluginError
from frobs_core.interfaces import Contact, RobotHandle, Scene, Sensor, Simulation, Snapshot


class Instrument(ABC):
    """Measures the truth, batched; its faults are added outside of it.

    Args:
        name: Of the sensor.
        sensor: Its description.
        simulation: That is measured in.
        robot: That carries it.
        control_timestep: [s]
    """

    def __init__(
        self, name: str, sensor: Sensor, simulation: Simulation, robot: RobotHandle, control_timestep: float
    ) -> None:
        self.name, self.sensor = name, sensor
        self.simulation, self.robot, self.control_timestep = simulation, robot, control_timestep

    @classmethod
    def contacts(cls, name: str, sensor: Any, robot: str, scene: Scene) -> Mapping[str, Contact]:
        """Return the contacts that the simulation must watch for a sensor, by name.

        Args:
            name: Of the sensor.
            sensor: Its description.
            robot: Name of the robot in the simulation.
            scene: Where it stands.
        """
        return {}

    def reset(self, mask: Mask | None) -> None:
        """Begin an episode where ``mask`` says; the robot has been placed."""

    def advance(self) -> None:
        """Take in what a control step changed."""

    @abstractmethod
    def measure(self) -> Floats:
        """Return (num_envs, width): what a perfect sensor reads now."""

    def snapshot(self) -> Snapshot:
        """Return what is kept between steps."""
        return {}

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""


def instrument_of(sensor: Sensor) -> type[Instrument]:
    """Import what measures for a sensor.

    Raises:
        PluginError: The sensor names no class that can be imported.
    """
    module, _, attribute = sensor.instrument.partition(":")
    try:
        cls: type[Instrument] = getattr(import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise PluginError(
            f"the sensor type {type(sensor).__name__} names the instrument '{sensor.instrument}', which cannot be "
            f"imported: {error}."
        ) from error
    return cls
