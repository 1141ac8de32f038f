"""What stands of FRobs_RL's functions and arguments: the tables of the documentation, which tests hold against the code."""

from __future__ import annotations

from collections.abc import Mapping

_SAME = ""
_SPAWN = "a pair (bool, str) always, also where FRobs_RL answers with a bare False"

FUNCTIONS: Mapping[str, Mapping[str, str]] = {
    "ros_controllers": {
        "load_controller_srv": "says whether the type's parameter or the type is missing",
        "load_controller_list_srv": _SAME,
        "unload_controller_srv": _SAME,
        "unload_controller_list_srv": _SAME,
        "switch_controllers_srv": "looks whether it was done: best effort says yes to names that are unknown",
        "start_controllers_srv": _SAME,
        "stop_controllers_srv": _SAME,
        "reset_controllers_srv": "stops, then starts",
        "spawn_controllers_srv": _SAME,
        "kill_controllers_srv": _SAME,
    },
    "ros_gazebo": {
        "launch_Gazebo": "Gazebo or the bridge; waits until it answers, instead of 5 s",
        "close_Gazebo": "ends ours; somebody else's goes on, and the answer is False",
        "gazebo_set_max_update_rate": _SAME,
        "gazebo_get_max_update_rate": "NaN where nothing answers",
        "gazebo_set_time_step": _SAME,
        "gazebo_get_time_step": "NaN where nothing answers",
        "gazebo_set_gravity": _SAME,
        "gazebo_get_gravity": "None where nothing answers",
        "gazebo_set_ODE_physics": "sets what is given; FRobs_RL sends the old values",
        "gazebo_get_ODE_physics": "None where nothing answers",
        "gazebo_set_default_properties": _SAME,
        "gazebo_reset_sim": _SAME,
        "gazebo_reset_world": _SAME,
        "gazebo_pause_physics": _SAME,
        "gazebo_unpause_physics": _SAME,
        "gazebo_step_physics": "waits until the steps are made",
        "gazebo_delete_model": _SAME,
        "gazebo_spawn_urdf_path": _SPAWN,
        "gazebo_spawn_urdf_pkg": _SPAWN,
        "gazebo_spawn_urdf_string": _SPAWN,
        "gazebo_spawn_urdf_param": _SPAWN,
        "gazebo_spawn_sdf_path": _SPAWN,
        "gazebo_spawn_sdf_pkg": _SPAWN,
        "gazebo_spawn_sdf_string": _SPAWN,
        "gazebo_spawn_sdf_param": _SPAWN,
        "gazebo_get_model_state": "four values; three times None and False where there is no such model",
        "gazebo_set_model_state": "four zeros turn nothing; nothing is slept, as the answer comes when it is done",
    },
    "ros_launch": {
        "ros_launch_from_pkg": "waits for the first node; a failure is a False",
        "ros_launch_from_path": "waits for the first node; a failure is a False",
        "ros_kill_launch_process": "ends ours, never somebody else's",
    },
    "ros_node": {
        "ros_node_from_pkg": "waits until the master knows the node; a failure is a False",
        "ros_kill_node": "the node that is named, whoever started it",
        "ros_kill_all_nodes": "ends ours, never somebody else's, nor this process's own node",
        "ros_kill_master": "ends ours; somebody else's goes on, and the answer is False",
        "ros_kill_all_processes": "ends ours, never somebody else's",
    },
    "ros_params": {"ros_load_yaml_from_pkg": _SAME, "ros_load_yaml_from_path": _SAME},
    "ros_spawn": {
        "init_robot_state_pub": "False where the description is missing",
        "spawn_model_in_gazebo": "False, with the reason, as soon as one of its parts fails",
    },
    "ros_urdf": {
        "urdf_load_from_pkg": "what is no robot is not loaded",
        "urdf_load_from_path": "what is no robot is not loaded",
        "urdf_parse_from_pkg": "works without ROS; None where it is no robot",
        "urdf_parse_from_path": "works without ROS; None where it is no robot",
    },
}
"""Module, function, and how it differs from FRobs_RL's beyond what it says in the log; empty: it does not."""

_LAUNCHED = "as launch_Gazebo's; without launch_gazebo a warning in the log"
_SPAWNED = "honoured; without spawn_robot a warning in the log"
_POSE = "honoured"

PARAMETERS: Mapping[str, str] = {
    "launch_gazebo": "honoured: Gazebo or the bridge, which close() ends",
    "gazebo_init_paused": "as launch_Gazebo's paused",
    "gazebo_use_gui": "as launch_Gazebo's gui",
    "gazebo_recording": _LAUNCHED,
    "gazebo_freq": "as launch_Gazebo's pub_clock_frequency",
    "world_path": _LAUNCHED,
    "world_pkg": _LAUNCHED,
    "world_filename": _LAUNCHED,
    "gazebo_max_freq": "honoured, also without launch_gazebo",
    "gazebo_timestep": "honoured, also without launch_gazebo",
    "spawn_robot": "honoured; needs pkg_name and urdf_file",
    "model_name_in_gazebo": "honoured",
    "namespace": "honoured",
    "pkg_name": _SPAWNED,
    "urdf_file": _SPAWNED,
    "urdf_folder": "honoured",
    "controller_file": _SPAWNED,
    "controller_list": "honoured: started with the robot, and reset with reset_controllers",
    "urdf_xacro_args": _SPAWNED,
    "rob_state_publisher_max_freq": _SPAWNED,
    "rob_st_term": "honoured; without xterm or display a log file",
    "model_pos_x": _POSE,
    "model_pos_y": _POSE,
    "model_pos_z": _POSE,
    "model_ori_x": "honoured; four zeros turn nothing, and a length that is not 1 is an error",
    "model_ori_y": "the same",
    "model_ori_z": "the same",
    "model_ori_w": "the same",
    "reset_controllers": "honoured; needs controller_list",
    "reset_mode": "honoured; 1 or 2",
    "step_mode": "honoured; 1 or 2",
    "num_gazebo_steps": "honoured in step_mode 2; in step_mode 1 a warning in the log",
}
"""Argument of RobotBasicEnv, then what becomes of it on every backend."""
