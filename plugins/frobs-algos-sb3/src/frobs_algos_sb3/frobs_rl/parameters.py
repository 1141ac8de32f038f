"""Where parameters come from: the YAML file, through ROS's parameter server where there is one.

This is the one place in which the class API meets ROS.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from frobs_algos_sb3.frobs_rl.settings import ROOT
from frobs_core.errors import ConfigFileError
from frobs_core.yaml import load_yaml, plain


def load_parameters(path: Path, ns: str) -> Mapping[str, Any]:
    """Read a YAML file; where a parameter server runs, put it there under a namespace.

    Args:
        path: The file.
        ns: The namespace: ``"/"``, ``"/robot1"``.

    Returns:
        The file; every mapping in it knows its keys' lines.

    Raises:
        ConfigFileError: The file cannot be used.
    """
    mapping = load_yaml(path)
    server = parameter_server()
    if server is not None and isinstance(mapping.get(ROOT), Mapping):
        server.set_param(_name(ns), plain(mapping[ROOT]))
    return mapping


def current_parameters(mapping: Mapping[str, Any], ns: str) -> Mapping[str, Any]:
    """Return the parameters as they stand now: somebody may have changed them on the parameter server.

    Args:
        mapping: What :func:`load_parameters` returned.
        ns: The same namespace.

    Raises:
        ConfigFileError: They were removed from the server.
    """
    server = parameter_server()
    if server is None:
        return mapping
    if not server.has_param(_name(ns)):
        raise ConfigFileError(
            f"the parameter server, {_name(ns)}", None, "the parameters are gone; build the model anew."
        )
    now = server.get_param(_name(ns))
    return mapping if now == plain(mapping[ROOT]) else {ROOT: now}


def parameter_server() -> Any:
    """Return ``rospy`` where it is installed and a ROS master answers, or None."""
    try:
        import rosgraph  # type: ignore[import-untyped,import-not-found,unused-ignore]
        import rospy  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError:
        return None
    return rospy if rosgraph.is_master_online() else None


def _name(ns: str) -> str:
    return f"/{ns.strip('/')}/{ROOT}" if ns.strip("/") else f"/{ROOT}"
