"""What a robot's sensors read: the truth, with the noise, delay and losses that each of them declares.

A task makes :class:`Sensors` in ``bind``, resets and advances it with itself, and reads by name.

    sensors.py · timing.py · channel.py · instrument.py · lidar.py · bumper.py · imu.py · settings.py · contacts.py
"""

from frobs_core.sensors.instrument import Instrument
from frobs_core.sensors.sensors import Sensors

__all__ = ["Instrument", "Sensors"]
