"""Connects to the ROS master, and starts a master if necessary."""

from __future__ import annotations

import contextlib
import os
import xmlrpc.client
from typing import Any, cast
from urllib.parse import urlparse

from frobs_ros.errors import MasterError
from frobs_ros.ros import processes
from frobs_ros.ros.environment import MASTER_URI, is_local, use_ros

START_TIMEOUT = 30.0
"""Maximum time to wait for a ROS master to respond [s]."""


def master_uri() -> str:
    """Return the URI of the ROS master."""
    return os.environ.get("ROS_MASTER_URI") or MASTER_URI


def is_online() -> bool:
    """Return whether a ROS master responds."""
    use_ros()
    # Unlike rosgraph's check, close the connection immediately. Ignore all errors, because the server at this address
    # may not be a ROS master.
    with contextlib.suppress(Exception), xmlrpc.client.ServerProxy(master_uri()) as proxy:
        status, *_ = cast("list[Any]", proxy.getPid("/frobs"))
        return bool(status == 1)
    return False


def require() -> None:
    """Check that a ROS master responds.

    Raises:
        MasterError: No master responds.
    """
    if not is_online():
        raise MasterError(master_uri())


def connect() -> Any:
    """Return the XML-RPC interface of the ROS master."""
    require()
    import rosgraph

    return rosgraph.Master("/frobs", master_uri())


def ensure(*, terminal: bool = False) -> processes.Process | None:
    """Start a ROS master if none responds. The new master ends when this process ends.

    Only rosmaster is started, because ``roscore`` would also start the rosout node, which listens on every network
    interface.

    Returns:
        The new master, or None if a master was already running.

    Raises:
        MasterError: No master responds at ``ROS_MASTER_URI``, and this address is not on this machine.
        ProcessError: The master did not start.
    """
    if is_online():
        return None
    if not is_local(os.environ):
        raise MasterError(
            master_uri(),
            "the master does not respond; start it on its own machine, or set ROS_MASTER_URI to another master",
        )
    port = str(urlparse(master_uri()).port or urlparse(MASTER_URI).port)
    process = processes.start(
        "master", ["rosmaster", "--core", "-p", port], name="rosmaster", terminal=terminal, grace=3.0
    )
    process.wait_until(is_online, START_TIMEOUT)
    return process
