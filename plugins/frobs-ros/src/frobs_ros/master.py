"""The ROS master: checks whether one answers, and starts one."""

from __future__ import annotations

import contextlib
import os
import xmlrpc.client
from typing import Any, cast
from urllib.parse import urlparse

from frobs_ros import processes
from frobs_ros.environment import MASTER_URI, is_local, use_ros
from frobs_ros.errors import MasterError

START_TIMEOUT = 30.0
"""[s] to wait for a master to answer."""


def master_uri() -> str:
    """Return the URI of the master."""
    return os.environ.get("ROS_MASTER_URI") or MASTER_URI


def is_online() -> bool:
    """Return whether a master answers."""
    use_ros()
    # Unlike rosgraph's check, this closes the connection at once. Any server may answer there.
    with contextlib.suppress(Exception), xmlrpc.client.ServerProxy(master_uri()) as proxy:
        status, *_ = cast("list[Any]", proxy.getPid("/frobs"))
        return bool(status == 1)
    return False


def require() -> None:
    """Return if a master answers.

    Raises:
        MasterError: No master answers.
    """
    if not is_online():
        raise MasterError(master_uri())


def connect() -> Any:
    """Return the XML-RPC interface of the master.

    Raises:
        MasterError: No master answers.
    """
    require()
    import rosgraph

    return rosgraph.Master("/frobs", master_uri())


def ensure(*, terminal: bool = False) -> processes.Process | None:
    """Start a master unless one answers; it ends with this process.

    Only rosmaster is started: the node rosout, which ``roscore`` starts too, listens on every interface.

    Returns:
        The master; None if one answered already.

    Raises:
        MasterError: No master answers at ``ROS_MASTER_URI``, and that address is not on this machine.
        ProcessError: The master did not start.
    """
    if is_online():
        return None
    if not is_local(os.environ):
        raise MasterError(
            master_uri(), "it does not answer, and it cannot be started from here because it is on another machine"
        )
    port = str(urlparse(master_uri()).port or urlparse(MASTER_URI).port)
    process = processes.start(
        "master", ["rosmaster", "--core", "-p", port], name="rosmaster", terminal=terminal, grace=3.0
    )
    process.wait_until(is_online, START_TIMEOUT)
    return process
