"""FRobs_RL's ``ros_node``: nodes and the master. Only processes that this process started are ended."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from frobs_core.errors import ParameterValueError
from frobs_ros import master, nodes, processes
from frobs_ros.environment import child_variables, find_ros, link_modules
from frobs_ros.errors import MasterError, PackageNotFoundError, RosError
from frobs_ros.log import LOG, answers
from frobs_ros.names import join
from frobs_ros.overlay import links_to_messages, make_overlay
from frobs_ros.packages import find_package

START_TIMEOUT = 15.0
"""[s] until a node must be registered with the master."""
OUTPUTS = ("log", "screen", None)
_SILENCE = 3.0


@answers(False, vital=True)
def ros_node_from_pkg(
    pkg_name: str,
    node_name: str,
    launch_master: bool = False,
    launch_master_term: bool = True,
    launch_new_term: bool = True,
    name: str | None = None,
    ns: str = "/",
    output: str | None = "log",
) -> bool:
    """Run a node of a ROS package.

    Args:
        pkg_name: Name of the package.
        node_name: Name of the node's program in the package.
        launch_master: Whether to start a ROS master if none answers.
        launch_master_term: Whether to run that master in an xterm.
        launch_new_term: Whether to run the node in an xterm.
        name: Name of the node in the graph; default: the node's own name.
        ns: Namespace of the node.
        output: Destination of its output: ``"log"``, a file; ``"screen"``, the output of this process; None, discarded.
    """
    if output not in OUTPUTS:
        raise ParameterValueError("output", output, "'log', 'screen' or None")
    program = find_node(pkg_name, node_name)
    if launch_master:
        master.ensure(terminal=launch_master_term)
    command, environment = _python_command(program)
    start_node("node", command, name=name, ns=ns, terminal=launch_new_term, output=output, environment=environment)
    return True


@answers(False)
def ros_kill_node(node_name: str) -> bool:
    """End a node by name, regardless of who started it.

    Args:
        node_name: Name of the node in the graph.
    """
    name = join(node_name)
    silence: RosError | None = None
    try:
        nodes.shut_down(name)
    except MasterError:
        raise
    except RosError as error:  # it may have ended before it answered
        silence = error
    if not processes.wait_for(lambda: name not in nodes.names(), START_TIMEOUT if silence is None else _SILENCE):
        raise silence or RosError(f"the node {name} did not end within {START_TIMEOUT:g} s of the request.")
    return True


@answers(False)
def ros_kill_all_nodes() -> bool:
    """End the nodes in processes that this process started, but neither its own node nor any others."""
    found = nodes.ours() if master.is_online() else set()
    for name in found:
        try:
            nodes.shut_down(name)
        except RosError as error:
            LOG.debug("%s", error)
    ended = processes.stop(processes.owned(["node", "state publisher"]))
    if not processes.wait_for(lambda: not master.is_online() or not nodes.ours() & found, START_TIMEOUT):
        raise RosError(f"the nodes {', '.join(sorted(nodes.ours() & found))} did not end on request.")
    return ended


@answers(False)
def ros_kill_master() -> bool:
    """End the ROS master if this process started it; otherwise return False."""
    ours = processes.owned(["master"])
    ended = processes.stop(ours)
    if not ours and master.is_online():
        raise MasterError(master.master_uri(), "this process did not start it, so it is not ended")
    return ended


@answers(False)
def ros_kill_all_processes() -> bool:
    """End all processes that this process has started: nodes, launch files, Gazebo, the master; no others."""
    return processes.stop(processes.owned())


def find_node(package: str, node: str) -> Path:
    """Return the program of a node, as ``rosrun PACKAGE NODE`` finds it.

    Raises:
        PackageNotFoundError: The package or the program does not exist; lists alternatives.
    """
    folder = find_package(package)
    prefixes = [Path(prefix) for prefix in os.environ.get("CMAKE_PREFIX_PATH", "").split(os.pathsep) if prefix]
    installation = find_ros()
    prefixes += [installation.prefix] if installation else []
    places = [prefix / "lib" / package for prefix in prefixes] + [folder]
    programs = {
        path.name: path
        for place in reversed(places)
        for path in sorted(place.rglob("*"), reverse=True)
        if path.is_file() and os.access(path, os.X_OK)
    }
    if node not in programs:
        raise PackageNotFoundError(package, programs, places, folder / node)
    return programs[node]


def _python_command(program: Path) -> tuple[list[str | Path], dict[str, str] | None]:
    """Return the command and the environment that run a node; None: the environment of ROS's programs.

    A Python node of a package runs with this Python, which has the modules that the package imports. ROS's own nodes
    run with the system's Python.
    """
    with program.open("rb") as file:
        first = file.readline(200)
    installation = find_ros()
    if not (first.startswith(b"#!") and b"python" in first) or (
        installation is not None and program.is_relative_to(installation.prefix / "lib")
    ):
        return [program], None
    folders = [os.environ.get("PYTHONPATH", ""), link_modules(), str(make_overlay(links_to_messages()))]
    return [sys.executable, program], {**child_variables(), "PYTHONPATH": os.pathsep.join(filter(None, folders))}


def start_node(
    kind: str,
    command: Sequence[str | Path],
    *,
    name: str | None = None,
    ns: str | None = "/",
    terminal: bool = False,
    output: str | None = "log",
    remaps: tuple[str, ...] = (),
    environment: Mapping[str, str] | None = None,
) -> processes.Process:
    """Start a node; return when it is registered with the master.

    Args:
        kind: Kind of the process.
        command: Program of the node, preceded by its interpreter if necessary.
        name: Name in the graph; default: the node's own name.
        ns: Namespace of the node.
        terminal: Whether to run it in an xterm.
        output: Destination of its output.
        remaps: Additional arguments: ``"_rate:=30"``, ``"a:=b"``.
        environment: Its environment variables; None: those of ROS's programs.

    Raises:
        MasterError: No master answers.
        ProcessError: It ended immediately, or did not register with the master in time.
    """
    before = nodes.names()
    words = [*command, f"__ns:={join(ns)}", *([f"__name:={name}"] if name else []), *remaps]
    title = join(ns, name or Path(command[-1]).name)
    process = processes.start(kind, words, name=title, terminal=terminal, output=output, environment=environment)
    replaces = {join(ns, name)} & before if name else set()  # a node replaces another one of the same name

    def is_known() -> bool:
        found = (nodes.names() - before) | replaces
        return bool(found and nodes.of(process.pids(), found))

    process.wait_until(is_known, START_TIMEOUT)
    return process
