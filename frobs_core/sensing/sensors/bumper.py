"""Bumpers, which detect contacts at any time during a control step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from frobs_core.contracts import RobotHandle, Simulation
from frobs_core.description import Contact, Scene, Sensor
from frobs_core.sensing.sensors.instrument import Instrument
from frobs_core.util.arrays import Floats


class BumperInstrument(Instrument):
    """Instrument that reads 1.0 if any of a bumper's links touched something, and 0.0 otherwise."""

    def __init__(
        self, name: str, sensor: Sensor, simulation: Simulation, robot: RobotHandle, control_timestep: float
    ) -> None:
        super().__init__(name, sensor, simulation, robot, control_timestep)
        self._contacts = [_contact(name, link, robot.name) for link in sensor.frames]

    @classmethod
    def contacts(cls, name: str, sensor: Any, robot: str, scene: Scene) -> Mapping[str, Contact]:
        """Return one contact for each link. If there is no floor, ``"floor"`` is removed from the ignored objects."""
        there = tuple(side for side in sensor.ignore if side != "floor" or scene.floor)
        return {_contact(name, link, robot): Contact(first=f"{robot}/{link}", ignore=there) for link in sensor.frames}

    def measure(self) -> Floats:
        """Return the state of the switch, (num_envs, 1)."""
        touched = self.simulation.contact(self._contacts[0])
        for name in self._contacts[1:]:
            touched = touched | self.simulation.contact(name)
        return touched[:, None].astype(np.float64)


def _contact(name: str, link: str, robot: str) -> str:
    return f"{robot}/{name}/{link}"
