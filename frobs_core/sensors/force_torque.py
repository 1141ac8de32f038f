"""Force-torque sensors, which the simulation measures."""

from __future__ import annotations

from frobs_core.arrays import Floats
from frobs_core.sensors.instrument import Instrument


class ForceTorqueInstrument(Instrument):
    """Measures the wrench in a joint, in the sensor's frame."""

    def measure(self) -> Floats:
        """Return (num_envs, 6): force [N] and torque [N·m]."""
        return self.simulation.sensor_wrench(self.robot.name, self.name)
