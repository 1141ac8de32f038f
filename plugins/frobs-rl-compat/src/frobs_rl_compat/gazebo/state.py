"""Gets and sets the poses and velocities of models."""

from __future__ import annotations

from typing import Any

from frobs_core.util.errors import ParameterValueError
from frobs_rl_compat.gazebo.poses import pose_message, position
from frobs_rl_compat.ros.logged_errors import answers
from frobs_ros.errors import ServiceError
from frobs_ros.ros.environment import use_ros
from frobs_ros.ros.services import call

_GET, _SET = "/gazebo/get_model_state", "/gazebo/set_model_state"


@answers((None, None, None, False))
def gazebo_get_model_state(model_name: str, relative_entity_name: str = "world") -> tuple[Any, Any, Any, bool]:
    """Return the pose and the velocity of a model.

    Returns:
        The header, the pose, the twist, and True, or ``(None, None, None, False)`` if the model does not exist.
    """
    use_ros()
    from gazebo_msgs.srv import GetModelState

    answer = call(_GET, GetModelState, model_name, relative_entity_name)
    if not answer.success:
        raise ServiceError(_GET, f"'{model_name}': {answer.status_message}")
    return answer.header, answer.pose, answer.twist, True


@answers(False)
def gazebo_set_model_state(
    model_name: str,
    ref_frame: str = "world",
    pos_x: float = 0.0,
    pos_y: float = 0.0,
    pos_z: float = 0.0,
    ori_x: float = 0.0,
    ori_y: float = 0.0,
    ori_z: float = 0.0,
    ori_w: float = 0.0,
    lin_vel_x: float = 0.0,
    lin_vel_y: float = 0.0,
    lin_vel_z: float = 0.0,
    ang_vel_x: float = 0.0,
    ang_vel_y: float = 0.0,
    ang_vel_z: float = 0.0,
    sleep_time: float = 0.05,
) -> bool:
    """Set the pose and the velocity of a model."""
    use_ros()
    from gazebo_msgs.msg import ModelState
    from gazebo_msgs.srv import SetModelState
    from geometry_msgs.msg import Twist, Vector3

    if not sleep_time >= 0.0:
        raise ParameterValueError("sleep_time", sleep_time, "0 or more [s]")
    twist = Twist(
        Vector3(*position(lin_vel_x, lin_vel_y, lin_vel_z)), Vector3(*position(ang_vel_x, ang_vel_y, ang_vel_z))
    )
    pose = pose_message((pos_x, pos_y, pos_z), (ori_x, ori_y, ori_z, ori_w))
    answer = call(_SET, SetModelState, ModelState(model_name, pose, twist, ref_frame))
    if not answer.success:
        raise ServiceError(_SET, f"'{model_name}': {answer.status_message}")
    return True
