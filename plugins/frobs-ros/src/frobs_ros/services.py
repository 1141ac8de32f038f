"""Calls of services: over connections that stay open where they may, and with a reason for each failure."""

from __future__ import annotations

import os
import threading
import time
from typing import Any

from frobs_ros import processes
from frobs_ros.environment import use_ros
from frobs_ros.errors import MasterError, ServiceError
from frobs_ros.master import master_uri

_PAUSE = 0.05
LASTING = "/gazebo/"
"""Services of the simulation itself, which last as long as it does: connections to them stay open.

Others, of a robot's controller manager, go with the robot, and rospy leaves their connections open: a call would reach
one that is withdrawn.
"""
_open = threading.local()
"""A connection for each service and thread: one cannot be shared between threads."""


def patience() -> float:
    """Return how long a service that is not there yet is waited for [s]: ``FROBS_ROS_TIMEOUT``, or 10."""
    return float(os.environ.get("FROBS_ROS_TIMEOUT") or 10.0)


def call(name: str, service: Any, *args: Any, tries: int = 1, **fields: Any) -> Any:
    """Call a service and return its answer.

    Args:
        name: The service's full name.
        service: Its class.
        *args: The request's fields in their order.
        tries: How often to try.
        **fields: The request's fields by name.

    Raises:
        MasterError: No master answers.
        ServiceError: The service is not there, or broke off.
    """
    use_ros()
    import rospy

    wait_for(name)
    attempts = max(tries, 1) + (name in _connections())  # one that stood open may lead to a server that is gone
    for attempt in range(attempts):
        if attempt:
            time.sleep(_PAUSE)
        try:
            return _connection(name, service)(*args, **fields)
        except (rospy.ServiceException, rospy.exceptions.TransportException, OSError) as error:
            _forget(name)
            failure = ServiceError(name, f"it broke off: {error}")
        except rospy.ROSException as error:
            raise ServiceError(name, f"the request does not fit: {error}") from error
    is_offered(name)  # that the master is gone says more
    raise failure


def wait_for(name: str, timeout: float | None = None) -> None:
    """Wait until a service is offered, for ``timeout`` [s] or :func:`patience`.

    Raises:
        MasterError: No master answers.
        ServiceError: Nobody offers it in time.
    """
    if name in _connections():
        return
    if not processes.wait_for(lambda: is_offered(name), patience() if timeout is None else timeout):
        raise ServiceError(name, f"nobody offers it; is Gazebo, or the bridge, running with {master_uri()}?")


def is_open(name: str) -> bool:
    """Return whether a connection to a service stands open."""
    return name in _connections()


def is_offered(name: str) -> bool:
    """Return whether somebody offers a service.

    Raises:
        MasterError: No master answers.
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
    uri = (master_uri(), os.getpid())  # a fork must not speak through its parent's connections
    if getattr(_open, "uri", None) != uri:
        _open.uri, _open.connections = uri, {}
    found: dict[str, Any] = _open.connections
    return found


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
