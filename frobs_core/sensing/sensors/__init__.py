"""Readings of a robot's sensors: the true values with noise, delay and dropout applied.

A task creates a :class:`Sensors` object in ``bind``, calls the object's methods in its own ``reset`` and ``advance``,
and reads sensors by name. Users can change the sensors with the environment's keyword ``sensors``::

    sensors:
      lidar: {rays: 36, noise: 0.01}    # overrides these fields of the robot's sensor
      bumper: null                      # removes the sensor
      scan: {type: lidar, frame: base_link, rays: 8, range_min: 0.1, range_max: 5.0}    # adds a sensor

The package contains the modules ``sensors``, ``channel``, ``instrument``, ``instruments`` and ``settings``.
"""

from frobs_core.sensing.sensors.instrument import Instrument, instrument_of, with_contacts
from frobs_core.sensing.sensors.sensors import Sensors

__all__ = ["Instrument", "Sensors", "instrument_of", "with_contacts"]
