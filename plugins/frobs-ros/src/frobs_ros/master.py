"""The ROS master: whether one answers, and one of our own."""

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
"""[s] for a master to answer."""


def master_uri() -> str:
    """Return where the master is, or should be."""
    return os.environ.get("ROS_MASTER_URI") or MASTER_URI


def is_online() -> bool:
    """Return whether a master answers."""
    use_ros()
    # Not rosgraph's own question, which leaves its connection to the garbage collector. Anything may answer there.
    with contextlib.suppress(Exception), xmlrpc.client.ServerProxy(master_uri()) as proxy:
        status, *_ = cast("list[Any]", proxy.getPid("/frobs"))
        return bool(status == 1)
    return False


def require() -> None:
    """Do nothing where a master answers.

    Raises:
        MasterError: None does.
    """
    if not is_online():
        raise MasterError(master_uri())


def connect() -> Any:
    """Return the master's own interface.

    Raises:
        MasterError: No master answers.
    """
    require()
    import rosgraph

    return rosgraph.Master("/frobs", master_uri())


def ensure(*, terminal: bool = False) -> processes.Process | None:
    """Start a master where none answers; it ends with this process.

    It is rosmaster alone: the node rosout, which ``roscore`` starts too, listens on every interface.

    Returns:
        The master; None where one answered before.

    Raises:
        MasterError: None answers where ``ROS_MASTER_URI`` says, and that is not on this machine.
        ProcessError: It did not start.
    """
    if is_online():
        return None
    if not is_local(os.environ):
        raise MasterError(
            master_uri(), "it does not answer, and none can be started from here: it is another machine's"
        )
    port = str(urlparse(master_uri()).port or urlparse(MASTER_URI).port)
    process = processes.start(
        "master", ["rosmaster", "--core", "-p", port], name="rosmaster", terminal=terminal, grace=3.0
    )
    process.wait_until(is_online, START_TIMEOUT)
    return process
