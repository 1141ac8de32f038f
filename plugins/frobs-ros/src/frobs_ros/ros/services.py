"""Calls ROS services, using persistent connections if possible, and reports the reason for each failure."""

from __future__ import annotations

import os
import threading
import time
from typing import Any

from frobs_ros.errors import MasterError, ServiceError
from frobs_ros.ros import processes
from frobs_ros.ros.environment import use_ros
from frobs_ros.ros.master import master_uri

_PAUSE = 0.05
LASTING = "/gazebo/"
"""Prefix of the simulation's own services.

Connections to these services stay open, because the services exist until the simulation ends.

Other services, such as the services of a robot's controller manager, are removed together with the robot. rospy does
not close connections to removed services, so a call through an open connection could reach a removed service.
"""
_open = threading.local()
"""Open connections of each thread, by service name. Threads cannot share a connection."""


def patience() -> float:
    """Return the maximum time to wait for a service to appear [s], from ``FROBS_ROS_TIMEOUT`` or 10 s by default."""
    return float(os.environ.get("FROBS_ROS_TIMEOUT") or 10.0)


def call(name: str, service: Any, *args: Any, tries: int = 1, **fields: Any) -> Any:
    """Call a service and return its response.

    Args:
        name: Full name of the service.
        service: Class of the service.
        *args: Request fields, in order.
        tries: Number of attempts.
        **fields: Request fields, by name.

    Raises:
        MasterError: No master responds.
        ServiceError: The service does not exist, or the call failed.
    """
    use_ros()
    import rospy

    wait_for(name)
    attempts = max(tries, 1) + (name in _connections())  # an open connection may lead to a server that has ended
    for attempt in range(attempts):
        if attempt:
            time.sleep(_PAUSE)
        try:
            return _connection(name, service)(*args, **fields)
        except (rospy.ServiceException, rospy.exceptions.TransportException, OSError) as error:
            _forget(name)
            failure = ServiceError(name, f"the call failed: {error}")
        except rospy.ROSException as error:
            raise ServiceError(name, f"the request is invalid: {error}") from error
    is_offered(name)  # raises the more helpful MasterError if no master responds
    raise failure


def wait_for(name: str, timeout: float | None = None) -> None:
    """Wait until a service exists, for at most ``timeout`` [s], which defaults to the result of :func:`patience`.

    Raises:
        MasterError: No master responds.
        ServiceError: The service did not become available in time.
    """
    if name in _connections():
        return
    if not processes.wait_for(lambda: is_offered(name), patience() if timeout is None else timeout):
        raise ServiceError(
            name,
            "the service is not available; check that Gazebo or the bridge is running and connected to the ROS master "
            f"{master_uri()}",
        )


def is_open(name: str) -> bool:
    """Return whether a connection to a service is open."""
    return name in _connections()


def is_offered(name: str) -> bool:
    """Return whether a service exists.

    Raises:
        MasterError: No master responds.
    """
    use_ros()
    import rosgraph

    try:
        return bool(rosgraph.Master("/frobs", master_uri()).lookupService(name))
    except rosgraph.MasterError:
        return False
    except OSError as error:
        raise MasterError(master_uri()) from error


def _connections() -> dict[str, Any]:
    uri = (master_uri(), os.getpid())  # a forked process must not use its parent's connections
    if getattr(_open, "uri", None) != uri:
        _open.uri, _open.connections = uri, {}
    connections: dict[str, Any] = _open.connections
    return connections


def _connection(name: str, service: Any) -> Any:
    import rospy

    connections = _connections()
    if name not in connections:
        if not name.startswith(LASTING):
            return rospy.ServiceProxy(name, service)
        connections[name] = rospy.ServiceProxy(name, service, persistent=True)
    return connections[name]


def _forget(name: str) -> None:
    connection = _connections().pop(name, None)
    if connection is not None:
        connection.close()
