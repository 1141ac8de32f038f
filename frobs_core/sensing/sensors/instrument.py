"""Instruments, which measure true values for a robot's sensors, and the contacts that they need."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from frobs_core.contracts import RobotHandle, Simulation, Stateful
from frobs_core.description import Contact, Placement, Scene, Sensor
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.attributes import load_attribute
from frobs_core.util.errors import PluginError


class Instrument(Stateful, ABC):
    """Base class of instruments, which measure true values in batches.

    ``frobs_core.sensing.sensors.channel.Channel`` adds noise, delay and other imperfections.

    Args:
        name: Name of the sensor.
        sensor: Description of the sensor.
        simulation: Simulation to measure in.
        robot: Robot that carries the sensor.
        control_timestep: [s]
    """

    def __init__(
        self, name: str, sensor: Sensor, simulation: Simulation, robot: RobotHandle, control_timestep: float
    ) -> None:
        self.name, self.sensor = name, sensor
        self.simulation, self.robot, self.control_timestep = simulation, robot, control_timestep

    @classmethod
    def contacts(cls, name: str, sensor: Any, robot: str, scene: Scene) -> Mapping[str, Contact]:
        """Return the contacts that the simulation must monitor for a sensor, by name.

        Args:
            name: Name of the sensor.
            sensor: Description of the sensor.
            robot: Name of the robot in the simulation.
            scene: Scene of the simulation.
        """
        return {}

    def reset(self, mask: Mask | None) -> None:
        """Begin an episode in the environments selected by ``mask``, after the robot has been placed."""

    def advance(self) -> None:
        """Update the instrument after a control step."""

    @abstractmethod
    def measure(self) -> Floats:
        """Return the current reading of a perfect sensor, (num_envs, width)."""


def instrument_of(sensor: Sensor) -> type[Instrument]:
    """Import the instrument of a sensor.

    Raises:
        PluginError: The instrument cannot be imported.
    """
    try:
        cls: type[Instrument] = load_attribute(sensor.instrument)
    except (ImportError, AttributeError, ValueError) as error:
        raise PluginError(
            f"the sensor type {type(sensor).__name__} has the instrument '{sensor.instrument}', which cannot be "
            f"imported: {error}."
        ) from error
    return cls


def with_contacts(scene: Scene, robots: Mapping[str, Placement]) -> Scene:
    """Return a copy of a scene that includes the contacts required by the sensors of robots, by robot name."""
    needed = {
        contact: declared
        for robot, placement in robots.items()
        for name, sensor in placement.robot.sensors.items()
        for contact, declared in instrument_of(sensor).contacts(name, sensor, robot, scene).items()
    }
    return replace(scene, contacts={**scene.contacts, **needed}) if needed else scene
