"""Force-torque sensors, whose readings come from the simulation."""

from __future__ import annotations

from frobs_core.sensing.sensors.instrument import Instrument
from frobs_core.util.arrays import Floats


class ForceTorqueInstrument(Instrument):
    """Instrument that measures the force and torque that a joint transmits, in the sensor's frame."""

    def measure(self) -> Floats:
        """Return force [N] and torque [N·m], (num_envs, 6)."""
        return self.simulation.sensor_wrench(self.robot.name, self.name)
