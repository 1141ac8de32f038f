"""Lidars, which measure distances with rays that the simulation casts."""

from __future__ import annotations

from frobs_core.sensing.sensors.instrument import Instrument
from frobs_core.util.arrays import Floats


class LidarInstrument(Instrument):
    """Instrument that measures the distance along each ray [m]."""

    def measure(self) -> Floats:
        """Return the distances, (num_envs, rays) [m]."""
        return self.robot.lidar(self.name)
