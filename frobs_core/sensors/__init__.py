"""What a robot's sensors read: the truth, with the noise, delay and losses that each of them declares.

A task makes :class:`Sensors` in ``bind``, resets and advances it with itself, and reads by name. Who makes the environment
can change them with its keyword ``sensors``::

    sensors:
      lidar: {rays: 36, noise: 0.01}    # of the robot's own sensor, these fields are others
      bumper: null                      # the robot goes without it
      scan: {type: lidar, frame: base_link, rays: 8, range_min: 0.1, range_max: 5.0}    # a further one

    sensors.py · timing.py · channel.py · instrument.py · lidar.py · bumper.py · imu.py · force_torque.py · settings.py · contacts.py
"""

from frobs_core.sensors.contacts import with_contacts
from frobs_core.sensors.instrument import Instrument, instrument_of
from frobs_core.sensors.sensors import Sensors

__all__ = [
    "Instrument",
    "Sensors",
    "instrument_of",
    "with_contacts",
]
