"""Options of commands that configure training runs."""

from __future__ import annotations

from dataclasses import dataclass

from frobs_cli.field_options import option
from frobs_cli.options import Attach, Controller, Gripper, NumEnvs, Robot, Simulator, Tcp


@dataclass(frozen=True, kw_only=True)
class RunFlags:
    """Flags of :func:`frobs_train.resolve_config`.

    Attributes:
        algorithm: Training algorithm: a name from 'frobs list algorithms'.
        base: How the robot's root link can move: fixed, floating or wheeled.
        object: Object to manipulate, for tasks such as PickAndPlace: an STL, OBJ, COLLADA or URDF file, in meters.
        object_mass: Mass of the object of --object, in kg.
        object_scale: Factor for the lengths of the object of --object: 0.001 if it is in millimeters.
        steps: Total number of environment steps of a run, summed over all environments.
    """

    algorithm: str | None = option(None, show_default="ppo")
    robot: Robot = None
    tcp: Tcp = None
    gripper: Gripper = None
    attach: Attach = None
    base: str | None = option(None, metavar="KIND", show_default="the robot's base")
    simulator: Simulator = None
    controller: Controller = None
    num_envs: NumEnvs = None
    object: str | None = option(None, metavar="FILE", show_default="the task's object")
    object_mass: float | None = option(None, metavar="KG", show_default="from the object's volume")
    object_scale: float | None = option(None, metavar="S", show_default="1")
    steps: int | None = option(None, min=1)
