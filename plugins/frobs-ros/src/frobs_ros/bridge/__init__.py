"""Bridge that gives any FRobs simulation the ROS services, topics and controller managers of Gazebo."""

import logging

LOG = logging.getLogger("frobs.bridge")
"""Log of the bridge, which is written to the standard error output."""
