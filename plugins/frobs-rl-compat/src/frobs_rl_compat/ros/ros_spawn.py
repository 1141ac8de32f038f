"""Implements FRobs_RL's ``ros_spawn``, which spawns a robot with its description, state publisher and controllers."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from frobs_core.util.errors import ParameterValueError
from frobs_rl_compat.gazebo.poses import orientation
from frobs_rl_compat.gazebo.spawn import gazebo_spawn_urdf_string
from frobs_rl_compat.ros.logged_errors import answers, or_raise
from frobs_rl_compat.ros.ros_controllers import spawn_controllers_srv
from frobs_rl_compat.ros.ros_node import start_node
from frobs_rl_compat.ros.ros_params import ros_load_yaml_from_pkg
from frobs_rl_compat.ros.ros_urdf import urdf_load_from_pkg
from frobs_ros.errors import MasterError
from frobs_ros.ros.master import connect, master_uri
from frobs_ros.ros.names import join

_STATE_PUBLISHER = "robot_state_publisher"
_DESCRIPTION = "robot_description"


@answers(False, vital=True)
def init_robot_state_pub(
    namespace: str = "/", max_pub_freq: float | None = None, launch_new_term: bool = False
) -> bool:
    """Start a robot_state_publisher, which publishes the poses of a robot's links on tf.

    The parameter ``<namespace>/robot_description`` must exist. The node is :mod:`frobs_ros.ros.state_publisher`, which
    behaves like ROS's own robot_state_publisher.
    """
    description = join(namespace, _DESCRIPTION)
    if not connect().hasParam(description):
        raise MasterError(
            master_uri(), f"the parameter {description} does not exist; load the robot's URDF into this parameter first"
        )
    if max_pub_freq is not None and not max_pub_freq > 0:
        raise ParameterValueError("max_pub_freq", max_pub_freq, "above 0 [Hz]")
    rate = (f"_publish_frequency:={max_pub_freq}",) if max_pub_freq is not None else ()
    node = [sys.executable, "-m", "frobs_ros.ros.state_publisher"]
    start_node("state publisher", node, name=_STATE_PUBLISHER, ns=namespace, terminal=launch_new_term, remaps=rate)
    return True


@answers(False, vital=True)
def spawn_model_in_gazebo(
    pkg_name: str,
    model_urdf_file: str,
    controllers_file: str | None,
    controllers_list: Sequence[str] = [],  # FRobs_RL's default, a list that is never modified
    model_urdf_folder: str = "/urdf",
    ns: str = "/",
    args_xacro: Sequence[str] | None = None,
    max_pub_freq: float | None = None,
    rob_st_term: bool = False,
    gazebo_name: str = "robot1",
    gaz_ref_frame: str = "world",
    pos_x: float = 0.0,
    pos_y: float = 0.0,
    pos_z: float = 0.0,
    ori_w: float = 0.0,
    ori_x: float = 0.0,
    ori_y: float = 0.0,
    ori_z: float = 0.0,
) -> bool:
    """Load a robot's description, start its state publisher, spawn its model, and load and start its controllers."""
    quat = orientation(ori_x, ori_y, ori_z, ori_w)
    or_raise(urdf_load_from_pkg)(pkg_name, model_urdf_file, _DESCRIPTION, model_urdf_folder, ns, args_xacro)
    or_raise(init_robot_state_pub)(ns, max_pub_freq, rob_st_term)
    text = connect().getParam(join(ns, _DESCRIPTION))
    or_raise(gazebo_spawn_urdf_string)(text, gazebo_name, join(ns), gaz_ref_frame, pos_x, pos_y, pos_z, *quat)
    if controllers_file:
        or_raise(ros_load_yaml_from_pkg)(pkg_name, controllers_file, ns)
    if controllers_list:
        or_raise(spawn_controllers_srv)(controllers_list, ns)
    return True
