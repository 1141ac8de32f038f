"""Spawns URDF and SDF models from a file, a file in a ROS package, a string, or a ROS parameter.

Each function returns whether the model was spawned, and the simulation's message. The reason for a failure is logged.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

from frobs_rl_compat.gazebo.poses import pose_message
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
    """Call a spawn service."""
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


def _spawns(service: str) -> Callable[[Callable[..., str]], Callable[..., tuple[bool, str]]]:
    """Turn a function that returns a model's XML into a function that spawns the model at a given pose."""

    def decorate(read: Callable[..., str]) -> Callable[..., tuple[bool, str]]:
        source = inspect.signature(read)
        signature = inspect.Signature([*source.parameters.values(), *_PLACE], return_annotation="tuple[bool, str]")

        @wraps(read)
        def spawn(*args: Any, **kwargs: Any) -> tuple[bool, str]:
            place = dict(signature.bind(*args, **kwargs).arguments)
            model = {name: place.pop(name) for name in source.parameters if name in place}
            return _spawn(service, read(**model), **place)

        spawn.__signature__ = signature  # type: ignore[attr-defined]
        return answers(False, pair=True, vital=True)(spawn)

    return decorate


@_spawns("spawn_urdf_model")
def gazebo_spawn_urdf_path(model_path: str) -> str:
    """Spawn a model from a URDF or xacro file."""
    return parse_model(Path(model_path))


@_spawns("spawn_urdf_model")
def gazebo_spawn_urdf_pkg(pkg_name: str, file_name: str, file_folder: str = "/urdf") -> str:
    """Spawn a model from a URDF or xacro file in a ROS package."""
    return parse_model(find_file(pkg_name, file_folder, file_name))


@_spawns("spawn_urdf_model")
def gazebo_spawn_urdf_string(model_string: str) -> str:
    """Spawn a model from a URDF string."""
    return model_string


@_spawns("spawn_urdf_model")
def gazebo_spawn_urdf_param(param_name: str) -> str:
    """Spawn a model from a URDF that is stored in a ROS parameter."""
    return _parameter(param_name)


@_spawns("spawn_sdf_model")
def gazebo_spawn_sdf_path(model_path: str) -> str:
    """Spawn a model from an SDF file."""
    return _read(Path(model_path))


@_spawns("spawn_sdf_model")
def gazebo_spawn_sdf_pkg(pkg_name: str, file_name: str, file_folder: str = "sdf") -> str:
    """Spawn a model from an SDF file in a ROS package."""
    return _read(find_file(pkg_name, file_folder, file_name))


@_spawns("spawn_sdf_model")
def gazebo_spawn_sdf_string(model_string: str) -> str:
    """Spawn a model from an SDF string."""
    return model_string


@_spawns("spawn_sdf_model")
def gazebo_spawn_sdf_param(param_name: str) -> str:
    """Spawn a model from an SDF that is stored in a ROS parameter."""
    return _parameter(param_name)


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
