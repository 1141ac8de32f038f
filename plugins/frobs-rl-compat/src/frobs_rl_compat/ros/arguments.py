"""Describes the arguments of FRobs_RL's functions. Each argument name has the same meaning in all functions."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

ARGUMENTS: Mapping[str, str] = {
    "ns": "Namespace of the robot or its parameters.",
    "max_retries": "Maximum number of attempts.",
    "retries": "Maximum number of attempts.",
    "controller_name": "Name of the controller. The parameter ``<ns>/<controller>/type`` defines the controller type.",
    "controller_list": "Names of the controllers.",
    "start_controllers": "Names of the controllers to start.",
    "stop_controllers": "Names of the controllers to stop.",
    "reset_controllers": "Names of the controllers to stop and restart.",
    "spawn_controllers": "Names of the controllers to load and start.",
    "kill_controllers": "Names of the controllers to stop and unload.",
    "strictness": "1 to switch as many controllers as possible, or 2 to switch either all controllers or none.",
    "start_asap": "Whether to start each controller as soon as its hardware is ready. Ignored when stopping.",
    "timeout": "Maximum time to wait for pending controllers [s], or 0 to wait without a limit.",
    "pkg_name": "ROS package that contains the file.",
    "file_name": "Name of the file.",
    "file_folder": "Folder that contains the file, relative to the package.",
    "file_path": "Path of the file.",
    "folder": "Folder that contains the file, relative to the package.",
    "model_path": "Path of the model file.",
    "model_string": "XML text of the model.",
    "model_name": "Name of the model in the simulation, or name of the model file.",
    "param_name": "Name of the parameter that contains the model's XML text, such as ``robot_description``.",
    "args_xacro": 'Arguments of the xacro file, such as ``["effort:=true"]``.',
    "launch_file": "Name of a launch file in the package's ``launch`` folder, or anywhere else in the package.",
    "launch_file_path": "Path of the launch file.",
    "args": 'Arguments of the launch file, such as ``["gui:=false"]``.',
    "launch_new_term": "Whether to run the program in an xterm window.",
    "robot_namespace": "Namespace of the model's topics and controller manager.",
    "reference_frame": 'Model or link that the pose is relative to, or ``"world"`` for an absolute pose.',
    "ref_frame": "Model or link that the pose and the velocity are relative to.",
    "relative_entity_name": "Model or link that the pose and the twist are relative to.",
    **dict.fromkeys(("pos_x", "pos_y", "pos_z"), "Position [m]."),
    **dict.fromkeys(("ori_x", "ori_y", "ori_z"), "Vector part of a unit quaternion. Four zeros mean no rotation."),
    "sleep_time": "Waiting time in FRobs_RL [s]. FRobs ignores this value and returns as soon as the state is set.",
    "model_urdf_file": "URDF or xacro file of the robot.",
    "model_urdf_folder": "Folder that contains the URDF or xacro file, relative to the package.",
    "controllers_file": "YAML file in the package's ``config`` folder, or None if the robot has no controllers.",
    "controllers_list": "Names of the controllers to load and start.",
    "namespace": "Namespace of the robot.",
    "max_pub_freq": "Maximum rate of the state publisher [Hz], or None for the publisher's default rate.",
    "rob_st_term": "Whether to run the state publisher in an xterm window.",
    "gazebo_name": "Name of the model in the simulation.",
    "gaz_ref_frame": "Model or link that the pose is relative to.",
    "ori_w": "Scalar part of the quaternion.",
    **dict.fromkeys(("lin_vel_x", "lin_vel_y", "lin_vel_z"), "Linear velocity [m/s]."),
    **dict.fromkeys(("ang_vel_x", "ang_vel_y", "ang_vel_z"), "Angular velocity [rad/s]."),
}


def describe_arguments(function: Callable[..., Any]) -> str:
    """Return a function's docstring, with an ``Args`` section from ``ARGUMENTS`` added if the docstring has none."""
    text = function.__doc__ or ""
    names = inspect.signature(function).parameters
    if not names or "    Args:\n" in text:
        return text
    head, returns, rest = text.rstrip().partition("\n\n    Returns:")
    rows = "".join(f"        {name}: {ARGUMENTS[name]}\n" for name in names)
    return f"{head}\n\n    Args:\n{rows}{returns[1:]}{rest}\n    "
