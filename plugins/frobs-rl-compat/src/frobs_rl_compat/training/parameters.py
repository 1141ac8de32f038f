"""Parameters from the YAML file, passed through ROS's parameter server if one is running.

No other module of the class API uses the parameter server.
"""

from __future__ import annotations

import socket
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

from frobs_core.util.errors import ConfigFileError
from frobs_core.util.plain import plain
from frobs_core.util.yaml import load_yaml
from frobs_rl_compat.training.settings import ROOT
from frobs_ros.errors import RosNotFoundError
from frobs_ros.ros.environment import use_ros
from frobs_ros.ros.master import is_online, master_uri

_TIMEOUT = 1.0


def load_parameters(path: Path, ns: str) -> Mapping[str, Any]:
    """Read a YAML file, and copy its parameters to the parameter server if one is running.

    ``ns`` is the namespace on the parameter server, such as ``"/"`` or ``"/robot1"``.
    """
    mapping = load_yaml(path)
    server = parameter_server()
    if server is not None and isinstance(mapping.get(ROOT), Mapping):
        server.set_param(_name(ns), plain(mapping[ROOT], for_yaml=True))
    return mapping


def current_parameters(mapping: Mapping[str, Any], ns: str) -> Mapping[str, Any]:
    """Return the current parameters, which may have changed on the parameter server after :func:`load_parameters`."""
    server = parameter_server()
    if server is None:
        return mapping
    if not server.has_param(_name(ns)):
        raise ConfigFileError(
            f"the parameter server, {_name(ns)}",
            None,
            "the parameters were deleted; create the model again to restore them.",
        )
    now = server.get_param(_name(ns))
    return mapping if now == plain(mapping[ROOT], for_yaml=True) else {ROOT: now}


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


def _name(ns: str) -> str:
    return f"/{ns.strip('/')}/{ROOT}" if ns.strip("/") else f"/{ROOT}"
