"""Start the bridge instead of Gazebo's server, for the replacement of ``gazebo_ros``."""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from frobs_cli.errors import MissingFileError
from frobs_core.util.errors import ConfigurationError, FrobsError, ParameterValueError
from frobs_models import path_folders
from frobs_rl_compat.replacements import arguments
from frobs_rl_compat.ros import backends

_EMPTY = ("", "empty.world", "worlds/empty.world")
"""Names of the empty world, which does not require a file."""


def main() -> None:
    """Run the bridge in this process, or exit with status 1 after an error."""
    try:
        launch, backend = read(arguments())
        words, variables = backends.command(launch, backend)
    except FrobsError as error:
        sys.exit(f"error: {error}")
    os.execve(words[0], words, variables)


def read(given: list[str]) -> tuple[backends.Launch, str]:
    """Parse the arguments from a launch file, and return the launch options and the backend."""
    options = _parse(given)
    if options.physics != "ode":
        raise ParameterValueError(
            "physics",
            options.physics,
            "'ode' (the default), because the bridge cannot change its simulator's physics engine",
        )
    if not options.ros_network:
        raise ParameterValueError("enable_ros_network", False, "true, because the bridge can only be used through ROS")
    backend = backends.choose()
    if backend == backends.GAZEBO:
        raise ConfigurationError(
            f"{backends.VARIABLE}=gazebo requires the ROS package gazebo_ros, which is not installed; choose "
            "'bridge:gazebo', which starts FRobs's own Gazebo, or another bridge."
        )
    launch = backends.Launch(
        paused=options.paused,
        gui=options.gui and not options.headless,
        recording=options.recording,
        debug=options.debug,
        verbose=options.verbose,
        world=find_world(options.world),
        clock_frequency=options.clock_frequency if options.use_clock_frequency else 0,
        gui_required=options.gui_required,
    )
    backends.check(launch, backend)
    return launch, backend


def find_world(name: str) -> Path | None:
    """Find a world file by its path or in ``GAZEBO_RESOURCE_PATH``, or return None for the empty world."""
    if name in _EMPTY:
        return None
    for folder in (Path(), *path_folders("GAZEBO_RESOURCE_PATH")):
        if (folder / name).is_file():
            return (folder / name).absolute()
    raise MissingFileError(Path(name), "pass the absolute path of a world file, or set GAZEBO_RESOURCE_PATH")


def _parse(given: list[str]) -> Namespace:
    parser = ArgumentParser(prog="gzserver", description=__doc__, allow_abbrev=False)
    for name in ("paused", "gui", "headless", "recording", "debug", "gui-required"):
        parser.add_argument(f"--{name}", type=_flag, default=False)
    for name in ("use-clock-frequency", "ros-network"):
        parser.add_argument(f"--{name}", type=_flag, default=True)
    parser.add_argument("--verbose", type=_flag, nargs="?", const=True, default=False)
    parser.add_argument("--physics", default="ode")
    parser.add_argument("--clock-frequency", type=float, default=100.0)
    parser.add_argument("world", nargs="?", default="")
    return parser.parse_args(given)


def _flag(text: str) -> bool:
    if text.lower() not in ("true", "false", "1", "0"):
        raise ValueError(text)
    return text.lower() in ("true", "1")


if __name__ == "__main__":
    main()
