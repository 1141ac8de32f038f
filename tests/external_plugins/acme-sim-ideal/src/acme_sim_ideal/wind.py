"""A sensor of the wind, which simulators with the ability ``wind`` have."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from frobs_core.arrays import Floats
from frobs_core.interfaces import Sensor
from frobs_core.sensors import Instrument


@dataclass(frozen=True, kw_only=True)
class Anemometer(Sensor):
    """Measures the velocity of the wind in the world frame, (3,) [m/s]."""

    type_name: ClassVar[str] = "anemometer"
    instrument: ClassVar[str] = "acme_sim_ideal.wind:WindInstrument"
    unit: ClassVar[str] = "m/s"
    needs: ClassVar[str] = "wind"

    @property
    def width(self) -> int:
        """Three components."""
        return 3


class WindInstrument(Instrument):
    """Reads the wind from the simulation."""

    def measure(self) -> Floats:
        """Return (num_envs, 3) [m/s]."""
        simulation: Any = self.simulation
        wind: Floats = simulation.wind_velocity()
        return wind
