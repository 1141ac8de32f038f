"""Implements FRobs_RL's ``ros_launch``, which runs launch files in child processes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from frobs_cli.errors import MissingFileError
from frobs_core.util.errors import ParameterValueError
from frobs_rl_compat.ros.logged_errors import answers
from frobs_ros.errors import ProcessError
from frobs_ros.ros import LOG, master, nodes, processes
from frobs_ros.ros.packages import find_anywhere

START_TIMEOUT = 30.0
"""Maximum time to wait for the first node of a launch file [s]."""
_GRACE = 20.0  # roslaunch waits 15 s for each node to end


@answers(False, vital=True)
def ros_launch_from_pkg(
    pkg_name: str, launch_file: str, args: Sequence[str] | None = None, launch_new_term: bool = True
) -> bool:
    """Run a launch file from a ROS package."""
    return launch(find_anywhere(pkg_name, "launch", launch_file, ".launch"), args, terminal=launch_new_term)


@answers(False, vital=True)
def ros_launch_from_path(
    launch_file_path: str, args: Sequence[str] | None = None, launch_new_term: bool = True
) -> bool:
    """Run a launch file."""
    return launch(Path(launch_file_path).expanduser(), args, terminal=launch_new_term)


@answers(False)
def ros_kill_launch_process() -> bool:
    """End the launch files that this process has started, and all their nodes. Other nodes are not affected."""
    return processes.stop(processes.owned(["launch"]))


def launch(file: Path, args: Sequence[str] | None, *, terminal: bool) -> bool:
    """Run a launch file, and return when its first node is registered.

    If no ROS master responds, a master is started.

    Raises:
        ConfigurationError: The file does not exist, or an argument does not have the form ``name:=value``.
        ProcessError: roslaunch failed.
    """
    if not file.is_file():
        raise MissingFileError(file, "pass the path of a launch file")
    words = [args] if isinstance(args, str) else [str(word) for word in args or ()]
    for word in words:
        if ":=" not in word:
            raise ParameterValueError("launch argument", word, "of the form 'name:=value'")
    master.ensure()
    before = nodes.names()
    process = processes.start(
        "launch", ["roslaunch", file, *words], name=file.name, terminal=terminal, output="screen", grace=_GRACE
    )
    until = time.monotonic() + START_TIMEOUT
    while process.is_running:
        new = nodes.names() - before
        if new and nodes.of(process.pids(), new):
            return True
        if time.monotonic() > until:
            LOG.warning("%s is running, but none of its nodes started within %g s", file, START_TIMEOUT)
            return True
        time.sleep(0.05)
    if process.returncode:
        raise ProcessError(f"roslaunch {file}", f"it ended with exit code {process.returncode}", process.output())
    return True
