"""Accesses the ROS parameter server, which stores FRobs_RL's algorithm parameters, if a ROS master is running."""

from __future__ import annotations

import socket
from typing import Any
from urllib.parse import urlparse

from frobs_ros.errors import RosNotFoundError
from frobs_ros.ros.environment import use_ros
from frobs_ros.ros.master import is_online, master_uri

_TIMEOUT = 1.0


def parameter_server() -> Any:
    """Return ``rospy``, which has ``set_param``, ``has_param`` and ``get_param``, or None if no master responds.

    If no process listens at the master's address, ROS is not imported.
    """
    address = urlparse(master_uri())
    try:
        socket.create_connection((address.hostname or "localhost", address.port or 80), _TIMEOUT).close()
    except OSError:
        return None
    try:
        use_ros()
    except RosNotFoundError:
        return None
    import rospy

    return rospy if is_online() else None
