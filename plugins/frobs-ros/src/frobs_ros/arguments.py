"""The arguments of FRobs_RL's functions, each described once: a name has the same meaning in all of them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

ARGUMENTS: Mapping[str, str] = {
    "ns": "Namespace of the robot or of the parameters.",
    "max_retries": "Number of attempts.",
    "retries": "Number of attempts.",
    "controller_name": "The controller, whose type is the parameter ``<ns>/<controller>/type``.",
    "controller_list": "The controllers.",
    "start_controllers": "The controllers to start.",
    "stop_controllers": "The controllers to stop.",
    "reset_controllers": "The controllers to stop and start again.",
    "spawn_controllers": "The controllers to load and start.",
    "kill_controllers": "The controllers to stop and unload.",
    "strictness": "1 does what can be done, 2 does all or nothing.",
    "start_asap": "Whether to start each controller as soon as its hardware is ready; ignored when stopping.",
    "timeout": "Time after which pending controllers are given up [s]; 0 for never.",
    "pkg_name": "The ROS package that contains the file.",
    "file_name": "The file.",
    "file_folder": "The file's folder in the package.",
    "file_path": "The file.",
    "folder": "The file's folder in the package.",
    "model_path": "The model file.",
    "model_string": "The model's XML.",
    "model_name": "The model's name in the simulation, or the name of its file.",
    "param_name": "The parameter with the model's XML: ``robot_description``.",
    "args_xacro": 'Arguments of the xacro: ``["effort:=true"]``.',
    "launch_file": "The file, in the package's folder ``launch`` or below the package.",
    "launch_file_path": "The file.",
    "args": 'Arguments of the launch file: ``["gui:=false"]``.',
    "launch_new_term": "Whether to run the program in an xterm.",
    "robot_namespace": "Namespace of the model's topics and of its controller manager.",
    "reference_frame": 'The model or link that the pose is relative to; ``"world"`` for none.',
    "ref_frame": "The model or link that pose and velocity are relative to.",
    "relative_entity_name": "The model or link that pose and twist are relative to.",
    **dict.fromkeys(("pos_x", "pos_y", "pos_z"), "Position [m]."),
    **dict.fromkeys(("ori_x", "ori_y", "ori_z"), "Vector part of a unit quaternion; four zeros mean no rotation."),
    "sleep_time": "Time that FRobs_RL slept before it answered [s]; FRobs answers when the state is set, without sleeping.",
    "model_urdf_file": "The robot's URDF or xacro.",
    "model_urdf_folder": "The URDF's folder in the package.",
    "controllers_file": "YAML file in the package's folder ``config``; None: the robot has no controllers.",
    "controllers_list": "The controllers to load and start.",
    "namespace": "Namespace of the robot.",
    "max_pub_freq": "Maximum rate of the state publisher [Hz]; None: its default.",
    "rob_st_term": "Whether to run the state publisher in an xterm.",
    "gazebo_name": "The model's name in the simulation.",
    "gaz_ref_frame": "The model or link that the pose is relative to.",
    "ori_w": "Scalar part of the quaternion.",
    **dict.fromkeys(("lin_vel_x", "lin_vel_y", "lin_vel_z"), "Linear velocity [m/s]."),
    **dict.fromkeys(("ang_vel_x", "ang_vel_y", "ang_vel_z"), "Angular velocity [rad/s]."),
}


def describe_arguments(function: Callable[..., Any]) -> str:
    """Return a function's docstring, with a section ``Args`` from this table unless it has one."""
    text = function.__doc__ or ""
    names = inspect.signature(function).parameters
    if not names or "    Args:\n" in text:
        return text
    head, returns, rest = text.rstrip().partition("\n\n    Returns:")
    rows = "".join(f"        {name}: {ARGUMENTS[name]}\n" for name in names)
    return f"{head}\n\n    Args:\n{rows}{returns[1:]}{rest}\n    "
