"""Finds and shuts down nodes that are registered with a ROS master."""

from __future__ import annotations

import xmlrpc.client
from typing import Any

from frobs_ros.errors import MasterError, RosError
from frobs_ros.ros import processes
from frobs_ros.ros.master import connect, master_uri

_TIMEOUT = 3.0
_CALLER = "/frobs"


class _Timed(xmlrpc.client.Transport):
    """An XML-RPC transport with a time limit, because a node may hang."""

    def make_connection(self, host: Any) -> Any:
        connection = super().make_connection(host)
        connection.timeout = _TIMEOUT
        return connection


def names() -> set[str]:
    """Return the names of all registered nodes."""
    publishers, subscribers, services = connect().getSystemState()
    return {node for group in (publishers, subscribers, services) for _, members in group for node in members}


def pid_of(name: str) -> int | None:
    """Return the process ID of a node, or None if the node does not respond."""
    try:
        code, _, pid = _node(name).getPid(_CALLER)
    except (OSError, xmlrpc.client.Error, RosError):
        return None
    return int(pid) if code == 1 else None


def of(pids: set[int], among: set[str]) -> set[str]:
    """Return the names in ``among`` that belong to nodes in the processes with the IDs ``pids``."""
    return {name for name in among if pid_of(name) in pids}


def ours() -> set[str]:
    """Return the names of all nodes that this process started as child processes."""
    pids = {pid for process in processes.owned() for pid in process.pids()}
    return of(pids, names()) if pids else set()


def shut_down(name: str) -> None:
    """Ask a node to shut down.

    Raises:
        MasterError: No master responds, or the node is not registered.
        RosError: The node does not respond.
    """
    try:
        _node(name).shutdown(_CALLER, "ended by ros_kill_node")
    except (OSError, xmlrpc.client.Error) as error:
        raise RosError(
            f"the node {name} does not respond: {error}; run 'rosnode cleanup' to remove dead nodes."
        ) from error


def _node(name: str) -> Any:
    import rosgraph

    try:
        uri = connect().lookupNode(name)
    except rosgraph.MasterError as error:
        known = ", ".join(sorted(names())) or "none"
        raise MasterError(master_uri(), f"no node is named '{name}'; registered nodes: {known}") from error
    return xmlrpc.client.ServerProxy(uri, transport=_Timed())
