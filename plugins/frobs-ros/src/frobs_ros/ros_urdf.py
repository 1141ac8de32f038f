"""FRobs_RL's ``ros_urdf``: load robot descriptions from files as texts or into the parameter server.

Files are expanded by xacro regardless of their suffix; packages of FRobs_RL also load SDF with these functions. Parsing
a file requires no part of ROS.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from frobs_core.errors import ModelFileError, ParameterValueError
from frobs_core.models import expand_xacro, parse_xml
from frobs_ros.log import answers
from frobs_ros.master import connect
from frobs_ros.names import join
from frobs_ros.packages import RosPackages, find_file


@answers(False)
def urdf_load_from_pkg(
    pkg_name: str,
    model_name: str,
    param_name: str,
    folder: str = "/urdf",
    ns: str | None = None,
    args_xacro: Sequence[str] | None = None,
) -> bool:
    """Load a URDF or xacro file of a ROS package into a parameter."""
    return _load(parse_model(find_file(pkg_name, folder, model_name), args_xacro), param_name, ns)


@answers(False)
def urdf_load_from_path(
    model_path: str, param_name: str, ns: str | None = None, args_xacro: Sequence[str] | None = None
) -> bool:
    """Load a URDF or xacro file into a parameter."""
    return _load(parse_model(Path(model_path), args_xacro), param_name, ns)


@answers(None)
def urdf_parse_from_pkg(
    pkg_name: str, model_name: str, folder: str = "/urdf", args_xacro: Sequence[str] | None = None
) -> str | None:
    """Return the URDF from a URDF or xacro file of a ROS package.

    Returns:
        The URDF; None if the package or file does not exist or is invalid.
    """
    return parse_model(find_file(pkg_name, folder, model_name), args_xacro)


@answers(None)
def urdf_parse_from_path(model_path: str, args_xacro: Sequence[str] | None = None) -> str | None:
    """Return the URDF from a URDF or xacro file.

    Returns:
        The URDF; None if the file does not exist or is invalid.
    """
    return parse_model(Path(model_path), args_xacro)


def parse_model(path: Path, arguments: Sequence[str] | None = None) -> str:
    """Expand a file.

    Raises:
        ConfigurationError: An argument is not of the form ``name:=value``.
        ModelFileError: The file is missing or invalid.
    """
    file = path.expanduser().absolute()
    if not file.is_file():
        raise ModelFileError(file, "the file does not exist.")
    text = expand_xacro(file, xacro_arguments(arguments), RosPackages(file))
    parse_xml(text.encode(), file)
    return text


def xacro_arguments(arguments: Sequence[str] | None) -> Mapping[str, str]:
    """Return xacro arguments by name.

    Raises:
        ConfigurationError: An argument is not of the form ``name:=value``.
    """
    if isinstance(arguments, str):
        raise ParameterValueError("xacro arguments", arguments, "a list of 'name:=value', not a string")
    found = {}
    for argument in arguments or ():
        name, assigned, value = str(argument).partition(":=")
        if not assigned or not name:
            raise ParameterValueError("xacro argument", argument, "of the form 'name:=value'")
        found[name] = value
    return found


def _load(text: str, parameter: str, ns: str | None) -> bool:
    name = join(ns, parameter)
    connect().setParam(name, text)
    return True
