"""Implements FRobs_RL's ``ros_params``, which loads YAML files into ROS's parameter server."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from frobs_core.util.errors import ConfigFileError
from frobs_rl_compat.ros.logged_errors import answers
from frobs_ros.ros.master import connect
from frobs_ros.ros.names import join
from frobs_ros.ros.packages import find_file


@answers(False)
def ros_load_yaml_from_pkg(pkg_name: str, file_name: str, ns: str = "/") -> bool:
    """Load ROS parameters from a YAML file in the ``config`` folder of a ROS package."""
    return _load(find_file(pkg_name, "config", file_name), ns)


@answers(False)
def ros_load_yaml_from_path(file_path: str, ns: str = "/") -> bool:
    """Load ROS parameters from a YAML file."""
    return _load(Path(file_path).expanduser(), ns)


def _load(path: Path, ns: str) -> bool:
    """Load a file in the same way as ``rosparam load``, including angles such as ``deg(90)``. Keep other parameters."""
    for parameters, namespace in _read(path, ns):
        if not isinstance(parameters, dict):
            raise ConfigFileError(path, None, "the file must contain a mapping of parameter names to values.")
        master = connect()
        for name, value in _leaves(parameters):
            master.setParam(join(namespace, name), value)
    return True


def _read(path: Path, ns: str) -> list[tuple[Any, str]]:
    import yaml

    if not path.is_file():
        raise ConfigFileError(path, None, "the file does not exist.")
    connect()
    import rosparam

    try:
        loaded: list[tuple[Any, str]] = rosparam.load_file(str(path), default_namespace=join(ns))
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = mark.line + 1 if mark else None
        raise ConfigFileError(path, line, f"it is not valid YAML: {getattr(error, 'problem', error)}") from error
    except (rosparam.RosParamException, UnicodeDecodeError) as error:
        raise ConfigFileError(path, None, str(error)) from error
    if not loaded:
        raise ConfigFileError(path, None, "it is empty.")
    return loaded


def _leaves(parameters: dict[Any, Any], prefix: str = "") -> list[tuple[str, Any]]:
    """Return the full name and the value of each parameter in nested mappings."""
    leaves: list[tuple[str, Any]] = []
    for key, value in parameters.items():
        name = f"{prefix}{key}"
        leaves += _leaves(value, f"{name}/") if isinstance(value, dict) and value else [(name, value)]
    return leaves
