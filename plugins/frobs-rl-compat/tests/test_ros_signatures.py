"""The names, arguments and defaults of FRobs_RL's documentation, §2.8.1–2.8.8."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import re
import subprocess
import sys
from importlib.machinery import PathFinder
from pathlib import Path

import pytest
import yaml

from frobs_cli.parameters import descriptions
from frobs_rl_compat.ros import backends, robot_settings
from frobs_rl_compat.ros.robot_basic_env import RobotBasicEnv

_TIMES = "ns=None, strictness=1, start_asap=False, timeout=3.0"
_PLACE = "pos_x=0.0, pos_y=0.0, pos_z=0.0"
_SPAWN = f"model_name='robot1', robot_namespace='/', reference_frame='world', {_PLACE}, ori_x=0.0, ori_y=0.0, ori_z=0.0, ori_w=1.0"
_PUT = (
    f"model_name, ref_frame='world', {_PLACE}, ori_x=0.0, ori_y=0.0, ori_z=0.0, ori_w=0.0, lin_vel_x=0.0, lin_vel_y=0.0, "
    "lin_vel_z=0.0, ang_vel_x=0.0, ang_vel_y=0.0, ang_vel_z=0.0, sleep_time=0.05"
)
_ODE = (
    "auto_disable_bodies, sor_pgs_precon_iters, sor_pgs_iters, sor_pgs_w, sor_pgs_rms_error_tol, contact_surface_layer, "
    "contact_max_correcting_vel, cfm, erp, max_contacts"
)
_LAUNCH = (
    "paused=False, use_sim_time=True, gui=True, recording=False, debug=False, verbose=False, output='screen', "
    "custom_world_path=None, custom_world_pkg=None, custom_world_name=None, respawn_gazebo=False, "
    "pub_clock_frequency=100, server_required=False, gui_required=False, launch_new_term=True"
)
DOCUMENTED = {
    "ros_controllers": {
        "load_controller_srv": "controller_name, ns=None, max_retries=5",
        "load_controller_list_srv": "controller_list, ns=None, max_retries=5",
        "unload_controller_srv": "controller_name, ns=None, max_retries=5",
        "unload_controller_list_srv": "controller_list, ns=None, max_retries=5",
        "switch_controllers_srv": f"start_controllers, stop_controllers, {_TIMES}, max_retries=5",
        "start_controllers_srv": f"start_controllers, {_TIMES}",
        "stop_controllers_srv": f"stop_controllers, {_TIMES}",
        "reset_controllers_srv": f"reset_controllers, max_retries=10, {_TIMES}",
        "spawn_controllers_srv": f"spawn_controllers, {_TIMES}",
        "kill_controllers_srv": f"kill_controllers, {_TIMES}",
    },
    "ros_gazebo": {
        "launch_Gazebo": _LAUNCH,
        "close_Gazebo": "",
        "gazebo_set_max_update_rate": "max_update_rate",
        "gazebo_get_max_update_rate": "",
        "gazebo_set_time_step": "new_time_step",
        "gazebo_get_time_step": "",
        "gazebo_set_gravity": "x, y, z",
        "gazebo_get_gravity": "",
        "gazebo_set_ODE_physics": _ODE,
        "gazebo_get_ODE_physics": "",
        "gazebo_set_default_properties": "",
        "gazebo_reset_sim": "retries=5",
        "gazebo_reset_world": "retries=5",
        "gazebo_pause_physics": "retries=5",
        "gazebo_unpause_physics": "retries=5",
        "gazebo_step_physics": "steps=1",
        "gazebo_delete_model": "model_name",
        "gazebo_spawn_urdf_path": f"model_path, {_SPAWN}",
        "gazebo_spawn_urdf_pkg": f"pkg_name, file_name, file_folder='/urdf', {_SPAWN}",
        "gazebo_spawn_urdf_string": f"model_string, {_SPAWN}",
        "gazebo_spawn_urdf_param": f"param_name, {_SPAWN}",
        "gazebo_spawn_sdf_path": f"model_path, {_SPAWN}",
        "gazebo_spawn_sdf_pkg": f"pkg_name, file_name, file_folder='sdf', {_SPAWN}",
        "gazebo_spawn_sdf_string": f"model_string, {_SPAWN}",
        "gazebo_spawn_sdf_param": f"param_name, {_SPAWN}",
        "gazebo_get_model_state": "model_name, relative_entity_name='world'",
        "gazebo_set_model_state": _PUT,
    },
    "ros_launch": {
        "ros_launch_from_pkg": "pkg_name, launch_file, args=None, launch_new_term=True",
        "ros_launch_from_path": "launch_file_path, args=None, launch_new_term=True",
        "ros_kill_launch_process": "",
    },
    "ros_node": {
        "ros_node_from_pkg": "pkg_name, node_name, launch_master=False, launch_master_term=True, launch_new_term=True, "
        "name=None, ns='/', output='log'",
        "ros_kill_node": "node_name",
        "ros_kill_all_nodes": "",
        "ros_kill_master": "",
        "ros_kill_all_processes": "",
    },
    "ros_params": {
        "ros_load_yaml_from_pkg": "pkg_name, file_name, ns='/'",
        "ros_load_yaml_from_path": "file_path, ns='/'",
    },
    "ros_spawn": {
        "init_robot_state_pub": "namespace='/', max_pub_freq=None, launch_new_term=False",
        "spawn_model_in_gazebo": "pkg_name, model_urdf_file, controllers_file, controllers_list=[], model_urdf_folder='/urdf', "
        f"ns='/', args_xacro=None, max_pub_freq=None, rob_st_term=False, gazebo_name='robot1', gaz_ref_frame='world', {_PLACE}, "
        "ori_w=0.0, ori_x=0.0, ori_y=0.0, ori_z=0.0",
    },
    "ros_urdf": {
        "urdf_load_from_pkg": "pkg_name, model_name, param_name, folder='/urdf', ns=None, args_xacro=None",
        "urdf_load_from_path": "model_path, param_name, ns=None, args_xacro=None",
        "urdf_parse_from_pkg": "pkg_name, model_name, folder='/urdf', args_xacro=None",
        "urdf_parse_from_path": "model_path, args_xacro=None",
    },
}
ENVIRONMENT = (
    "launch_gazebo=False, gazebo_init_paused=True, gazebo_use_gui=True, gazebo_recording=False, gazebo_freq=100, "
    "world_path=None, world_pkg=None, world_filename=None, gazebo_max_freq=None, gazebo_timestep=None, spawn_robot=False, "
    "model_name_in_gazebo='robot', namespace='/robot', pkg_name=None, urdf_file=None, urdf_folder='/urdf', "
    "controller_file=None, controller_list=None, urdf_xacro_args=None, rob_state_publisher_max_freq=None, rob_st_term=False, "
    f"{_PLACE.replace('pos', 'model_pos')}, model_ori_x=0.0, model_ori_y=0.0, model_ori_z=0.0, model_ori_w=0.0, "
    "reset_controllers=False, reset_mode=1, step_mode=1, num_gazebo_steps=1"
)
TABLES = yaml.safe_load((Path(__file__).parents[3] / "docs/generate/frobs_rl.yaml").read_text("utf-8"))
ALL = [(module, name) for module, functions in DOCUMENTED.items() for name in functions]


def taken(function: object) -> str:
    """Return what a function takes, as the documentation writes it."""
    parameters = inspect.signature(function).parameters.values()  # type: ignore[arg-type]
    words = [p.name if p.default is p.empty else f"{p.name}={p.default!r}" for p in parameters if p.name != "self"]
    return ", ".join(words)


@pytest.mark.parametrize(("module", "name"), ALL, ids=[name for _, name in ALL])
def test_functions_take_what_is_documented(module: str, name: str) -> None:
    function = getattr(importlib.import_module(f"frobs_rl_compat.ros.{module}"), name)
    assert taken(function) == DOCUMENTED[module][name]
    assert function.__doc__
    assert [p for p in inspect.signature(function).parameters if f"        {p}: " not in function.__doc__] == []


def test_the_environment_takes_what_is_documented() -> None:
    assert taken(RobotBasicEnv.__init__) == ENVIRONMENT
    names = robot_settings.RobotSettings.names()
    assert names == tuple(inspect.signature(RobotBasicEnv).parameters)
    assert [name for name in names if name not in descriptions(RobotBasicEnv)] == []


def test_the_tables_of_the_documentation_name_everything_once() -> None:
    assert {name for functions in TABLES["functions"].values() for name in functions} == {name for _, name in ALL}
    assert {module: set(functions) for module, functions in TABLES["functions"].items()} == {
        module: set(functions) for module, functions in DOCUMENTED.items()
    }
    launch = inspect.signature(importlib.import_module("frobs_rl_compat.ros.ros_gazebo").launch_Gazebo).parameters
    assert list(TABLES["launch"]) == list(launch)
    assert list(TABLES["parameters"]) == list(robot_settings.RobotSettings.names())


def test_every_argument_of_the_environment_goes_somewhere() -> None:
    """Handed to the launch or to the robot's spawning, or named in the environment's own code."""
    own = inspect.getsource(RobotBasicEnv)
    for name in robot_settings.RobotSettings.names():
        handed = name in robot_settings.LAUNCH or name in robot_settings.ROBOT
        assert handed or re.search(rf"\b(settings|self\._settings)\.{name}\b", own), name


@pytest.mark.parametrize(("module", "name"), ALL, ids=[name for _, name in ALL])
def test_every_function_is_called_in_the_tests(module: str, name: str) -> None:
    here = Path(__file__)
    text = "".join(path.read_text() for path in here.parent.glob("test_*.py") if path != here)
    spawn = re.fullmatch(r"gazebo_spawn_(urdf|sdf)_(string|path|pkg|param)", name)  # by getattr, each of them
    assert spawn or re.search(rf"\b{name}\b", text), name


def test_a_launch_is_described_by_the_fields_that_the_backends_read() -> None:
    assert len(dataclasses.fields(backends.Launch)) == 11


def test_nothing_of_ros_is_imported_until_it_is_used() -> None:
    modules = ", ".join(f"frobs_rl_compat.ros.{module}" for module in [*DOCUMENTED, "robot_basic_env"])
    code = f"import sys, {modules}; print([m for m in ('rospy', 'rosgraph', 'mujoco') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_machine_without_ros_is_told_what_to_install(tmp_path: Path) -> None:
    code = f"""
from pathlib import Path
from frobs_ros.ros import environment
environment.DISTRIBUTION = environment.SYSTEM = Path({str(tmp_path)!r})
from frobs_rl_compat.ros.ros_gazebo import gazebo_pause_physics
gazebo_pause_physics()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    if PathFinder.find_spec("rospy") is None:
        assert "RosNotFoundError: ROS cannot be used: the Python module 'rospy' is not installed" in done.stderr
        assert "apt-get install ros-core" in done.stderr
        assert "frobs doctor ros" in done.stderr
