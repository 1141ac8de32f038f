"""Lidars, which measure distances with rays that the simulation casts."""

from __future__ import annotations

from frobs_core.arrays import Floats
from frobs_core.sensors.instrument import Instrument


class LidarInstrument(Instrument):
    """Instrument that measures the distance along each ray [m]."""

    def measure(self) -> Floats:
        """Return the distances, (num_envs, rays) [m]."""
        return self.robot.lidar(self.name)
