"""Implements FRobs_RL's ``ros_gazebo``: launches Gazebo or the bridge, and calls the simulation's services.

Each function returns the same values as in FRobs_RL. If a function returns False, the reason is logged.
"""

from frobs_rl_compat.gazebo.launch import close_Gazebo, launch_Gazebo
from frobs_rl_compat.gazebo.physics import (
    gazebo_get_gravity,
    gazebo_get_max_update_rate,
    gazebo_get_ODE_physics,
    gazebo_get_time_step,
    gazebo_set_default_properties,
    gazebo_set_gravity,
    gazebo_set_max_update_rate,
    gazebo_set_ODE_physics,
    gazebo_set_time_step,
)
from frobs_rl_compat.gazebo.spawn import (
    gazebo_spawn_sdf_param,
    gazebo_spawn_sdf_path,
    gazebo_spawn_sdf_pkg,
    gazebo_spawn_sdf_string,
    gazebo_spawn_urdf_param,
    gazebo_spawn_urdf_path,
    gazebo_spawn_urdf_pkg,
    gazebo_spawn_urdf_string,
)
from frobs_rl_compat.gazebo.state import gazebo_get_model_state, gazebo_set_model_state
from frobs_rl_compat.gazebo.world import (
    gazebo_delete_model,
    gazebo_pause_physics,
    gazebo_reset_sim,
    gazebo_reset_world,
    gazebo_step_physics,
    gazebo_unpause_physics,
)

__all__ = [
    "close_Gazebo", "gazebo_delete_model", "gazebo_get_ODE_physics", "gazebo_get_gravity",
    "gazebo_get_max_update_rate", "gazebo_get_model_state", "gazebo_get_time_step", "gazebo_pause_physics",
    "gazebo_reset_sim", "gazebo_reset_world", "gazebo_set_ODE_physics", "gazebo_set_default_properties",
    "gazebo_set_gravity", "gazebo_set_max_update_rate", "gazebo_set_model_state", "gazebo_set_time_step",
    "gazebo_spawn_sdf_param", "gazebo_spawn_sdf_path", "gazebo_spawn_sdf_pkg", "gazebo_spawn_sdf_string",
    "gazebo_spawn_urdf_param", "gazebo_spawn_urdf_path", "gazebo_spawn_urdf_pkg", "gazebo_spawn_urdf_string",
    "gazebo_step_physics", "gazebo_unpause_physics", "launch_Gazebo",
]  # fmt: skip
