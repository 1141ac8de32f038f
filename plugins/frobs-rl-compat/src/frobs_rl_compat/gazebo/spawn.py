"""Spawns URDF and SDF models from a file, a file in a ROS package, a string, or a ROS parameter.

Each function returns whether the model was spawned, and the simulation's message. The reason for a failure is logged.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

from frobs_rl_compat.gazebo.poses import pose_message
from frobs_rl_compat.ros.arguments import with_parameters
from frobs_rl_compat.ros.logged_errors import answers
from frobs_rl_compat.ros.ros_urdf import parse_model
from frobs_ros.errors import MasterError, ServiceError
from frobs_ros.ros.environment import use_ros
from frobs_ros.ros.master import connect, master_uri
from frobs_ros.ros.packages import find_file
from frobs_ros.ros.services import call


def _spawn(
    service: str,
    text: str,
    model_name: str = "robot1",
    robot_namespace: str = "/",
    reference_frame: str = "world",
    pos_x: float = 0.0,
    pos_y: float = 0.0,
    pos_z: float = 0.0,
    ori_x: float = 0.0,
    ori_y: float = 0.0,
    ori_z: float = 0.0,
    ori_w: float = 1.0,
) -> tuple[bool, str]:
    use_ros()
    from gazebo_msgs.srv import SpawnModel

    name = f"/gazebo/{service}"
    pose = pose_message((pos_x, pos_y, pos_z), (ori_x, ori_y, ori_z, ori_w))
    answer = call(name, SpawnModel, model_name, text, robot_namespace, pose, reference_frame)
    if not answer.success:
        raise RefusedError(name, answer.status_message)
    return True, answer.status_message


_PLACE = list(inspect.signature(_spawn).parameters.values())[2:]
"""Parameters that all spawn functions of FRobs_RL have in common."""


def _spawns(function: Callable[..., tuple[bool, str]]) -> Callable[..., tuple[bool, str]]:
    return answers(False, pair=True, vital=True)(with_parameters(function, _PLACE))


@_spawns
def gazebo_spawn_urdf_path(model_path: str, **place: Any) -> tuple[bool, str]:
    """Spawn a model from a URDF or xacro file."""
    return _spawn("spawn_urdf_model", parse_model(Path(model_path)), **place)


@_spawns
def gazebo_spawn_urdf_pkg(pkg_name: str, file_name: str, file_folder: str = "/urdf", **place: Any) -> tuple[bool, str]:
    """Spawn a model from a URDF or xacro file in a ROS package."""
    return _spawn("spawn_urdf_model", parse_model(find_file(pkg_name, file_folder, file_name)), **place)


@_spawns
def gazebo_spawn_urdf_string(model_string: str, **place: Any) -> tuple[bool, str]:
    """Spawn a model from a URDF string."""
    return _spawn("spawn_urdf_model", model_string, **place)


@_spawns
def gazebo_spawn_urdf_param(param_name: str, **place: Any) -> tuple[bool, str]:
    """Spawn a model from a URDF that is stored in a ROS parameter."""
    return _spawn("spawn_urdf_model", _parameter(param_name), **place)


@_spawns
def gazebo_spawn_sdf_path(model_path: str, **place: Any) -> tuple[bool, str]:
    """Spawn a model from an SDF file."""
    return _spawn("spawn_sdf_model", _read(Path(model_path)), **place)


@_spawns
def gazebo_spawn_sdf_pkg(pkg_name: str, file_name: str, file_folder: str = "sdf", **place: Any) -> tuple[bool, str]:
    """Spawn a model from an SDF file in a ROS package."""
    return _spawn("spawn_sdf_model", _read(find_file(pkg_name, file_folder, file_name)), **place)


@_spawns
def gazebo_spawn_sdf_string(model_string: str, **place: Any) -> tuple[bool, str]:
    """Spawn a model from an SDF string."""
    return _spawn("spawn_sdf_model", model_string, **place)


@_spawns
def gazebo_spawn_sdf_param(param_name: str, **place: Any) -> tuple[bool, str]:
    """Spawn a model from an SDF that is stored in a ROS parameter."""
    return _spawn("spawn_sdf_model", _parameter(param_name), **place)


class RefusedError(ServiceError):
    """The simulation rejected a model. The error message is the simulation's own message, unchanged."""

    def __str__(self) -> str:
        """Return the simulation's message."""
        return self.reason


def _read(path: Path) -> str:
    try:
        return path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ServiceError("/gazebo/spawn_sdf_model", f"{path} cannot be read: {error}") from error


def _parameter(name: str) -> str:
    master = connect()
    if not master.hasParam(name):
        raise MasterError(master_uri(), f"there is no parameter '{name}'")
    return str(master.getParam(name))
