"""Launches and closes the simulation."""

from __future__ import annotations

from pathlib import Path

from frobs_cli.errors import MissingFileError
from frobs_core.util.errors import MissingSettingError, ParameterValueError
from frobs_rl_compat.ros import backends
from frobs_rl_compat.ros.logged_errors import answers
from frobs_ros.errors import ProcessError
from frobs_ros.ros import master, processes
from frobs_ros.ros.packages import find_anywhere
from frobs_ros.ros.services import is_offered

LAUNCH_TIMEOUT = 120.0
"""Maximum time to wait for the simulation to respond [s]."""
_GRACE = 10.0
_LAST, _FIRST = "/gazebo/get_world_properties", "/gazebo/pause_physics"
OUTPUTS = ("screen", "log")


@answers(False, vital=True)
def launch_Gazebo(  # noqa: N802 # FRobs_RL's name
    paused: bool = False,
    use_sim_time: bool = True,
    gui: bool = True,
    recording: bool = False,
    debug: bool = False,
    verbose: bool = False,
    output: str = "screen",
    custom_world_path: str | None = None,
    custom_world_pkg: str | None = None,
    custom_world_name: str | None = None,
    respawn_gazebo: bool = False,
    pub_clock_frequency: int = 100,
    server_required: bool = False,
    gui_required: bool = False,
    launch_new_term: bool = True,
) -> bool:
    """Launch Gazebo or the bridge, and wait until the simulation responds.

    The environment variable or ROS parameter ``FROBS_ROS_BACKEND`` selects the backend: ``gazebo``, ``bridge:mujoco``,
    ``bridge:pybullet`` or ``bridge:gazebo``. The default is Gazebo if gazebo_ros is installed, and the bridge with
    MuJoCo otherwise. If no ROS master responds, a master is started.

    Returns:
        Whether the simulation responds.
    """
    if output not in OUTPUTS:
        raise ParameterValueError("output", output, "'screen' or 'log'")
    launch = backends.Launch(
        paused=paused,
        use_sim_time=use_sim_time,
        gui=gui,
        recording=recording,
        debug=debug,
        verbose=verbose,
        world=find_world(custom_world_path, custom_world_pkg, custom_world_name),
        respawn=respawn_gazebo,
        clock_frequency=pub_clock_frequency,
        server_required=server_required,
        gui_required=gui_required,
    )
    backend = backends.choose()
    backends.check(launch, backend)
    words, variables = backends.command(launch, backend)
    master.ensure()
    if is_offered(_FIRST):
        raise ProcessError(
            "Gazebo",
            f"a simulation is already connected to the ROS master {master.master_uri()}; close that simulation first",
        )
    master.connect().setParam("/use_sim_time", use_sim_time)
    process = processes.start(
        "gazebo",
        words,
        name="Gazebo" if backend == backends.GAZEBO else backend,
        terminal=launch_new_term,
        output=output,
        environment=variables,
        respawn=respawn_gazebo and backend != backends.GAZEBO,
        grace=_GRACE,
    )
    process.wait_until(lambda: is_offered(_FIRST) and is_offered(_LAST), LAUNCH_TIMEOUT)
    return True


@answers(False)
def close_Gazebo() -> bool:  # noqa: N802 # FRobs_RL's name
    """Close the simulation that this process launched. Other simulations are not affected."""
    running = processes.owned(["gazebo"])
    if not running:
        raise ProcessError("Gazebo", "no simulation was closed, because this process has not launched one")
    return processes.stop(running)


def find_world(path: str | None, package: str | None, name: str | None) -> Path | None:
    """Return the path of a world file, or None for an empty world."""
    if path:
        file = Path(path).expanduser().absolute()
        if not file.is_file():
            raise MissingFileError(file, "pass the path of a world file")
        return file
    if not package and not name:
        return None
    if not package or not name:
        raise MissingSettingError("loading a world from a package", "the names of both the package and the world file")
    return find_anywhere(package, "worlds", name, ".world")
