"""Selects the backend that implements Gazebo's ROS interface: Gazebo itself, or the bridge with a FRobs simulator.

All backends accept the same :class:`Launch` options. The reference states whether each backend honors, emulates or
rejects each option.
"""

from __future__ import annotations

import os
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

from frobs_core.util.errors import (
    ConfigurationError,
    ConflictingOptionsError,
    MissingSettingError,
    ParameterValueError,
)
from frobs_rl_compat.replacements import has_original
from frobs_ros.errors import ProcessError
from frobs_ros.ros import LOG
from frobs_ros.ros.environment import child_variables

VARIABLE = "FROBS_ROS_BACKEND"
GAZEBO, BRIDGE = "gazebo", "bridge:"
DEFAULT_BRIDGE = "bridge:mujoco"


@dataclass(frozen=True, kw_only=True)
class Launch:
    """Options for launching a simulation, as described in :func:`frobs_rl_compat.ros.ros_gazebo.launch_Gazebo`."""

    paused: bool = False
    use_sim_time: bool = True
    gui: bool = True
    recording: bool = False
    debug: bool = False
    verbose: bool = False
    world: Path | None = None
    respawn: bool = False
    clock_frequency: float = 100
    server_required: bool = False
    gui_required: bool = False


def choose() -> str:
    """Return the backend that the environment variable or ROS parameter ``FROBS_ROS_BACKEND`` selects, or the default.

    The default is Gazebo if gazebo_ros is installed, and the bridge with MuJoCo otherwise.
    """
    from frobs_ros.ros.master import connect, is_online

    chosen = os.environ.get(VARIABLE, "")
    if not chosen and is_online():
        master = connect()
        chosen = str(master.getParam(f"/{VARIABLE}")) if master.hasParam(f"/{VARIABLE}") else ""
    if not chosen:
        return GAZEBO if has_original("gazebo_ros") else DEFAULT_BRIDGE
    if chosen != GAZEBO and not (chosen.startswith(BRIDGE) and chosen != BRIDGE):
        raise ParameterValueError(VARIABLE, chosen, "'gazebo', 'bridge:mujoco', 'bridge:pybullet' or 'bridge:gazebo'")
    return chosen


def check(launch: Launch, backend: str) -> None:
    """Check that a backend supports the given options."""
    if launch.clock_frequency < 0:
        raise ParameterValueError(
            "pub_clock_frequency",
            launch.clock_frequency,
            "at least 0 Hz; 0 publishes the time after every physics step",
        )
    if launch.respawn and (launch.server_required or launch.gui_required):
        raise ConflictingOptionsError(["respawn_gazebo", "server_required or gui_required"])
    if launch.gui_required and not launch.gui:
        raise MissingSettingError("gui_required", "gui")
    if launch.gui_required and not has_display():
        raise ConfigurationError(
            "gui_required requires a display, but none is available; set DISPLAY or omit gui_required."
        )
    if backend == GAZEBO:
        return
    for name, given, reason in (
        ("recording", launch.recording, "the bridge does not write state logs"),
        ("gui_required", launch.gui_required, "the bridge keeps running after its window is closed"),
    ):
        if given:
            raise ConfigurationError(
                f"{name} is not supported by the backend '{backend}': {reason}; omit this option or set "
                f"{VARIABLE}=gazebo."
            )


def command(launch: Launch, backend: str) -> tuple[list[str], dict[str, str]]:
    """Return the command that starts a backend, and the environment variables for this command."""
    gui = launch.gui and has_display()
    if launch.gui and not gui:
        LOG.warning("the simulation runs without a window, because no display is available")
    return _gazebo(launch, gui) if backend == GAZEBO else _bridge(launch, backend, gui)


def has_display() -> bool:
    """Return whether a display is available for opening windows."""
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _gazebo(launch: Launch, gui: bool) -> tuple[list[str], dict[str, str]]:
    switches = ("paused", "use_sim_time", "recording", "debug", "verbose", "server_required", "gui_required")
    given = {name: getattr(launch, name) for name in switches}
    given |= {"gui": gui, "respawn_gazebo": launch.respawn, "use_clock_frequency": True}
    words = ["roslaunch", "gazebo_ros", "empty_world.launch"]
    words += [f"{name}:={str(value).lower()}" for name, value in given.items()]
    words += [f"pub_clock_frequency:={launch.clock_frequency}"]
    words += [f"world_name:={launch.world}"] if launch.world else []
    variables = child_variables()
    if shutil.which("gzserver", path=variables["PATH"]) is None:
        raise ProcessError("Gazebo", "the program 'gzserver' is not installed; run 'frobs doctor ros' for details")
    return words, variables


def _bridge(launch: Launch, backend: str, gui: bool) -> tuple[list[str], dict[str, str]]:
    words = [sys.executable, *(["-X", "faulthandler"] if launch.debug else []), "-m", "frobs_ros.bridge"]
    words += ["--simulator", backend.removeprefix(BRIDGE), "--clock-frequency", str(launch.clock_frequency)]
    words += ["--paused"] if launch.paused else []
    words += ["--gui"] if gui else []
    words += ["--verbose"] if launch.verbose or launch.debug else []
    words += ["--world", str(launch.world)] if launch.world else []
    variables = dict(os.environ)  # lets the bridge import the same packages as this process
    if launch.debug:
        variables["FROBS_DEBUG"] = "1"
    return words, variables
