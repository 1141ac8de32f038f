"""Validates the arguments of RobotBasicEnv, and passes each argument to the function that uses it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from frobs_core.util.errors import MissingSettingError, ParameterValueError
from frobs_rl_compat.gazebo.poses import orientation, position
from frobs_ros.ros import LOG

LAUNCH: Mapping[str, str] = {
    "gazebo_init_paused": "paused",
    "gazebo_use_gui": "gui",
    "gazebo_recording": "recording",
    "gazebo_freq": "pub_clock_frequency",
    "world_path": "custom_world_path",
    "world_pkg": "custom_world_pkg",
    "world_filename": "custom_world_name",
}
"""Maps argument names of RobotBasicEnv to the corresponding argument names of launch_Gazebo."""

ROBOT: Mapping[str, str] = {
    "pkg_name": "pkg_name",
    "urdf_file": "model_urdf_file",
    "controller_file": "controllers_file",
    "controller_list": "controllers_list",
    "urdf_folder": "model_urdf_folder",
    "namespace": "ns",
    "urdf_xacro_args": "args_xacro",
    "rob_state_publisher_max_freq": "max_pub_freq",
    "rob_st_term": "rob_st_term",
    "model_name_in_gazebo": "gazebo_name",
    **{f"model_{name}": name for name in ("pos_x", "pos_y", "pos_z", "ori_w", "ori_x", "ori_y", "ori_z")},
}
"""Maps argument names of RobotBasicEnv to the corresponding argument names of spawn_model_in_gazebo."""


@dataclass(frozen=True)
class RobotSettings:
    """Arguments of :class:`frobs_rl_compat.ros.robot_basic_env.RobotBasicEnv`, whose docstring describes them."""

    launch_gazebo: bool = False
    gazebo_init_paused: bool = True
    gazebo_use_gui: bool = True
    gazebo_recording: bool = False
    gazebo_freq: int = 100
    world_path: str | None = None
    world_pkg: str | None = None
    world_filename: str | None = None
    gazebo_max_freq: float | None = None
    gazebo_timestep: float | None = None
    spawn_robot: bool = False
    model_name_in_gazebo: str = "robot"
    namespace: str = "/robot"
    pkg_name: str | None = None
    urdf_file: str | None = None
    urdf_folder: str = "/urdf"
    controller_file: str | None = None
    controller_list: Sequence[str] | None = None
    urdf_xacro_args: Sequence[str] | None = None
    rob_state_publisher_max_freq: float | None = None
    rob_st_term: bool = False
    model_pos_x: float = 0.0
    model_pos_y: float = 0.0
    model_pos_z: float = 0.0
    model_ori_x: float = 0.0
    model_ori_y: float = 0.0
    model_ori_z: float = 0.0
    model_ori_w: float = 0.0
    reset_controllers: bool = False
    reset_mode: int = 1
    step_mode: int = 1
    num_gazebo_steps: int = 1

    def check(self) -> None:
        """Validate the arguments before any process is started."""
        for name in ("reset_mode", "step_mode"):
            if getattr(self, name) not in (1, 2):
                raise ParameterValueError(name, getattr(self, name), "1 or 2")
        if int(self.num_gazebo_steps) != self.num_gazebo_steps or self.num_gazebo_steps < 1:
            raise ParameterValueError("num_gazebo_steps", self.num_gazebo_steps, "an integer of at least 1")
        if self.step_mode == 1 and self.num_gazebo_steps != 1:
            LOG.warning(
                "num_gazebo_steps=%d is ignored because step_mode 1 does not count physics steps", self.num_gazebo_steps
            )
        for name in ("gazebo_max_freq", "gazebo_timestep"):
            value = getattr(self, name)
            if value is not None and not (value > 0 or (value == 0 and name == "gazebo_max_freq")):
                raise ParameterValueError(name, value, "above 0" if name == "gazebo_timestep" else "at least 0")
        position(self.model_pos_x, self.model_pos_y, self.model_pos_z)
        orientation(self.model_ori_x, self.model_ori_y, self.model_ori_z, self.model_ori_w)
        if self.spawn_robot and not (self.pkg_name and self.urdf_file):
            raise MissingSettingError("spawn_robot", "pkg_name and urdf_file")
        if self.reset_controllers and not self.controller_list:
            raise MissingSettingError("reset_controllers", "controller_list")
        self._say_what_is_not_used()

    def _say_what_is_not_used(self) -> None:
        """Log a warning about launch or robot arguments that are ignored because nothing is launched or spawned."""
        launch = ("gazebo_recording", "world_path", "world_pkg", "world_filename")
        robot = ("pkg_name", "urdf_file", "controller_file", "urdf_xacro_args", "rob_state_publisher_max_freq")
        for switch, names in (("launch_gazebo", launch), ("spawn_robot", robot)):
            given = [name for name in names if getattr(self, name)]
            if given and not getattr(self, switch):
                LOG.warning(
                    "%s ignored because %s is False", f"{', '.join(given)} {'is' if len(given) == 1 else 'are'}", switch
                )

    def launch(self) -> dict[str, Any]:
        """Return the arguments for launch_Gazebo."""
        return {theirs: getattr(self, ours) for ours, theirs in LAUNCH.items()}

    def robot(self) -> dict[str, Any]:
        """Return the arguments for spawn_model_in_gazebo."""
        keywords = {theirs: getattr(self, ours) for ours, theirs in ROBOT.items()}
        return keywords | {"controllers_list": list(self.controller_list or ())}

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Return the argument names, in order."""
        return tuple(field.name for field in fields(cls))
