"""Implements FRobs_RL's ``ros_urdf``, which reads robot description files and can store the text in ROS parameters.

All files are expanded by xacro, regardless of their suffix. FRobs_RL packages also load SDF files with these functions.
Parsing a file does not require ROS.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from frobs_core.util.errors import ModelFileError, ParameterValueError
from frobs_models import expand_xacro, parse_xml
from frobs_rl_compat.ros.logged_errors import answers
from frobs_ros.ros.master import connect
from frobs_ros.ros.names import join
from frobs_ros.ros.packages import RosPackages, find_file


@answers(False)
def urdf_load_from_pkg(
    pkg_name: str,
    model_name: str,
    param_name: str,
    folder: str = "/urdf",
    ns: str | None = None,
    args_xacro: Sequence[str] | None = None,
) -> bool:
    """Load a URDF or xacro file from a ROS package into a ROS parameter."""
    return _load(parse_model(find_file(pkg_name, folder, model_name), args_xacro), param_name, ns)


@answers(False)
def urdf_load_from_path(
    model_path: str, param_name: str, ns: str | None = None, args_xacro: Sequence[str] | None = None
) -> bool:
    """Load a URDF or xacro file into a ROS parameter."""
    return _load(parse_model(Path(model_path), args_xacro), param_name, ns)


@answers(None)
def urdf_parse_from_pkg(
    pkg_name: str, model_name: str, folder: str = "/urdf", args_xacro: Sequence[str] | None = None
) -> str | None:
    """Expand a URDF or xacro file from a ROS package.

    Returns:
        The expanded URDF, or None if the package or the file does not exist, or if the file is invalid.
    """
    return parse_model(find_file(pkg_name, folder, model_name), args_xacro)


@answers(None)
def urdf_parse_from_path(model_path: str, args_xacro: Sequence[str] | None = None) -> str | None:
    """Expand a URDF or xacro file.

    Returns:
        The expanded URDF, or None if the file does not exist or is invalid.
    """
    return parse_model(Path(model_path), args_xacro)


def parse_model(path: Path, arguments: Sequence[str] | None = None) -> str:
    """Expand a file with xacro, and return the resulting XML.

    Raises:
        ConfigurationError: An argument does not have the form ``name:=value``.
        ModelFileError: The file is missing or invalid.
    """
    file = path.expanduser().absolute()
    if not file.is_file():
        raise ModelFileError(file, "the file does not exist.")
    text = expand_xacro(file, xacro_arguments(arguments), RosPackages(file))
    parse_xml(text.encode(), file)
    return text


def xacro_arguments(arguments: Sequence[str] | None) -> Mapping[str, str]:
    """Return the values of xacro arguments by name."""
    if isinstance(arguments, str):
        raise ParameterValueError("xacro arguments", arguments, "a list of 'name:=value' strings, not a single string")
    values = {}
    for argument in arguments or ():
        name, assigned, value = str(argument).partition(":=")
        if not assigned or not name:
            raise ParameterValueError("xacro argument", argument, "of the form 'name:=value'")
        values[name] = value
    return values


def _load(text: str, parameter: str, ns: str | None) -> bool:
    name = join(ns, parameter)
    connect().setParam(name, text)
    return True
