"""Models come: from URDF and SDF, as a file, a file of a package, a text, or a parameter.

Each function returns whether the model is there and what the simulation says; a False is logged with its reason.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from frobs_ros.environment import use_ros
from frobs_ros.errors import MasterError, ServiceError
from frobs_ros.gazebo.poses import pose_message
from frobs_ros.log import answers
from frobs_ros.master import connect, master_uri
from frobs_ros.packages import find_file
from frobs_ros.ros_urdf import parse_model
from frobs_ros.services import call


@answers(False, pair=True)
def gazebo_spawn_urdf_path(
    model_path: str,
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
    """Spawn a model from a URDF or xacro file.

    Args:
        model_path: The file.
        model_name: Its name in the simulation; none may be taken twice.
        robot_namespace: Of its topics and of its controller manager.
        reference_frame: The model or link that the pose is relative to; ``"world"`` for none.
        pos_x: [m]
        pos_y: [m]
        pos_z: [m]
        ori_x: Of a quaternion of length 1; four zeros are no rotation.
        ori_y: Of the quaternion.
        ori_z: Of the quaternion.
        ori_w: Scalar of the quaternion.

    Returns:
        Whether the model is there; what the simulation says, or why it was not asked.
    """
    pose = ((pos_x, pos_y, pos_z), (ori_x, ori_y, ori_z, ori_w))
    return _spawn("spawn_urdf_model", parse_model(Path(model_path)), model_name, robot_namespace, reference_frame, pose)


@answers(False, pair=True)
def gazebo_spawn_urdf_pkg(
    pkg_name: str,
    file_name: str,
    file_folder: str = "/urdf",
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
    """Spawn a model from a URDF or xacro file of a ROS package.

    Args:
        pkg_name: The ROS package that holds it.
        file_name: The file.
        file_folder: Its folder in the package.
        model_name: Its name in the simulation; none may be taken twice.
        robot_namespace: Of its topics and of its controller manager.
        reference_frame: The model or link that the pose is relative to; ``"world"`` for none.
        pos_x: [m]
        pos_y: [m]
        pos_z: [m]
        ori_x: Of a quaternion of length 1; four zeros are no rotation.
        ori_y: Of the quaternion.
        ori_z: Of the quaternion.
        ori_w: Scalar of the quaternion.

    Returns:
        Whether the model is there; what the simulation says, or why it was not asked.
    """
    pose = ((pos_x, pos_y, pos_z), (ori_x, ori_y, ori_z, ori_w))
    return _spawn(
        "spawn_urdf_model",
        parse_model(find_file(pkg_name, file_folder, file_name)),
        model_name,
        robot_namespace,
        reference_frame,
        pose,
    )


@answers(False, pair=True)
def gazebo_spawn_urdf_string(
    model_string: str,
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
    """Spawn a model from a URDF text.

    Args:
        model_string: The model.
        model_name: Its name in the simulation; none may be taken twice.
        robot_namespace: Of its topics and of its controller manager.
        reference_frame: The model or link that the pose is relative to; ``"world"`` for none.
        pos_x: [m]
        pos_y: [m]
        pos_z: [m]
        ori_x: Of a quaternion of length 1; four zeros are no rotation.
        ori_y: Of the quaternion.
        ori_z: Of the quaternion.
        ori_w: Scalar of the quaternion.

    Returns:
        Whether the model is there; what the simulation says, or why it was not asked.
    """
    pose = ((pos_x, pos_y, pos_z), (ori_x, ori_y, ori_z, ori_w))
    return _spawn("spawn_urdf_model", model_string, model_name, robot_namespace, reference_frame, pose)


@answers(False, pair=True)
def gazebo_spawn_urdf_param(
    param_name: str,
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
    """Spawn a model from a URDF on the parameter server.

    Args:
        param_name: The parameter that holds the model.
        model_name: Its name in the simulation; none may be taken twice.
        robot_namespace: Of its topics and of its controller manager.
        reference_frame: The model or link that the pose is relative to; ``"world"`` for none.
        pos_x: [m]
        pos_y: [m]
        pos_z: [m]
        ori_x: Of a quaternion of length 1; four zeros are no rotation.
        ori_y: Of the quaternion.
        ori_z: Of the quaternion.
        ori_w: Scalar of the quaternion.

    Returns:
        Whether the model is there; what the simulation says, or why it was not asked.
    """
    pose = ((pos_x, pos_y, pos_z), (ori_x, ori_y, ori_z, ori_w))
    return _spawn("spawn_urdf_model", _parameter(param_name), model_name, robot_namespace, reference_frame, pose)


@answers(False, pair=True)
def gazebo_spawn_sdf_path(
    model_path: str,
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
    """Spawn a model from an SDF file.

    Args:
        model_path: The file.
        model_name: Its name in the simulation; none may be taken twice.
        robot_namespace: Of its topics and of its controller manager.
        reference_frame: The model or link that the pose is relative to; ``"world"`` for none.
        pos_x: [m]
        pos_y: [m]
        pos_z: [m]
        ori_x: Of a quaternion of length 1; four zeros are no rotation.
        ori_y: Of the quaternion.
        ori_z: Of the quaternion.
        ori_w: Scalar of the quaternion.

    Returns:
        Whether the model is there; what the simulation says, or why it was not asked.
    """
    pose = ((pos_x, pos_y, pos_z), (ori_x, ori_y, ori_z, ori_w))
    return _spawn("spawn_sdf_model", _read(Path(model_path)), model_name, robot_namespace, reference_frame, pose)


@answers(False, pair=True)
def gazebo_spawn_sdf_pkg(
    pkg_name: str,
    file_name: str,
    file_folder: str = "sdf",
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
    """Spawn a model from an SDF file of a ROS package.

    Args:
        pkg_name: The ROS package that holds it.
        file_name: The file.
        file_folder: Its folder in the package.
        model_name: Its name in the simulation; none may be taken twice.
        robot_namespace: Of its topics and of its controller manager.
        reference_frame: The model or link that the pose is relative to; ``"world"`` for none.
        pos_x: [m]
        pos_y: [m]
        pos_z: [m]
        ori_x: Of a quaternion of length 1; four zeros are no rotation.
        ori_y: Of the quaternion.
        ori_z: Of the quaternion.
        ori_w: Scalar of the quaternion.

    Returns:
        Whether the model is there; what the simulation says, or why it was not asked.
    """
    pose = ((pos_x, pos_y, pos_z), (ori_x, ori_y, ori_z, ori_w))
    return _spawn(
        "spawn_sdf_model",
        _read(find_file(pkg_name, file_folder, file_name)),
        model_name,
        robot_namespace,
        reference_frame,
        pose,
    )


@answers(False, pair=True)
def gazebo_spawn_sdf_string(
    model_string: str,
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
    """Spawn a model from an SDF text.

    Args:
        model_string: The model.
        model_name: Its name in the simulation; none may be taken twice.
        robot_namespace: Of its topics and of its controller manager.
        reference_frame: The model or link that the pose is relative to; ``"world"`` for none.
        pos_x: [m]
        pos_y: [m]
        pos_z: [m]
        ori_x: Of a quaternion of length 1; four zeros are no rotation.
        ori_y: Of the quaternion.
        ori_z: Of the quaternion.
        ori_w: Scalar of the quaternion.

    Returns:
        Whether the model is there; what the simulation says, or why it was not asked.
    """
    pose = ((pos_x, pos_y, pos_z), (ori_x, ori_y, ori_z, ori_w))
    return _spawn("spawn_sdf_model", model_string, model_name, robot_namespace, reference_frame, pose)


@answers(False, pair=True)
def gazebo_spawn_sdf_param(
    param_name: str,
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
    """Spawn a model from an SDF on the parameter server.

    Args:
        param_name: The parameter that holds the model.
        model_name: Its name in the simulation; none may be taken twice.
        robot_namespace: Of its topics and of its controller manager.
        reference_frame: The model or link that the pose is relative to; ``"world"`` for none.
        pos_x: [m]
        pos_y: [m]
        pos_z: [m]
        ori_x: Of a quaternion of length 1; four zeros are no rotation.
        ori_y: Of the quaternion.
        ori_z: Of the quaternion.
        ori_w: Scalar of the quaternion.

    Returns:
        Whether the model is there; what the simulation says, or why it was not asked.
    """
    pose = ((pos_x, pos_y, pos_z), (ori_x, ori_y, ori_z, ori_w))
    return _spawn("spawn_sdf_model", _parameter(param_name), model_name, robot_namespace, reference_frame, pose)


def _spawn(
    service: str,
    text: str,
    model_name: str,
    robot_namespace: str,
    reference_frame: str,
    pose: tuple[tuple[float, float, float], tuple[float, float, float, float]],
) -> tuple[bool, str]:
    """Ask the simulation.

    Raises:
        ServiceError: It refuses.
    """
    use_ros()
    from gazebo_msgs.srv import SpawnModel

    name = f"/gazebo/{service}"
    answer = call(name, SpawnModel, model_name, text, robot_namespace, pose_message(*pose), reference_frame)
    if not answer.success:
        raise RefusedError(name, answer.status_message)
    return True, answer.status_message


class RefusedError(ServiceError):
    """The simulation's own words, which the caller gets as they are.

    Args:
        service: The service's full name.
        reason: What the simulation says.
    """

    def __str__(self) -> str:
        """Return what the simulation says."""
        return self.reason


def _read(path: Path) -> str:
    try:
        return path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ServiceError("/gazebo/spawn_sdf_model", f"{path} cannot be read: {error}") from error


def _parameter(name: str) -> Any:
    master = connect()
    if not master.hasParam(name):
        raise MasterError(master_uri(), f"there is no parameter '{name}'")
    return str(master.getParam(name))
