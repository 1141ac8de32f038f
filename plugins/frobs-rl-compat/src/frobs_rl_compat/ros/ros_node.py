"""Implements FRobs_RL's ``ros_node``, which starts and ends nodes and the ROS master.

Only :func:`ros_kill_node` may end nodes that this process has not started.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from frobs_core.util.errors import ParameterValueError
from frobs_rl_compat.ros.logged_errors import answers
from frobs_ros.errors import MasterError, RosError
from frobs_ros.ros import LOG, master, nodes, processes
from frobs_ros.ros.environment import child_variables, find_ros, link_modules
from frobs_ros.ros.names import join
from frobs_ros.ros.overlay import links_to_messages, make_overlay
from frobs_ros.ros.packages import find_node

START_TIMEOUT = 15.0
"""Maximum time to wait for a node to register with the master, or to end on request [s]."""
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
    """Run a node from a ROS package."""
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
    """End a node by name, regardless of which process started the node."""
    name = join(node_name)
    silence: RosError | None = None
    try:
        nodes.shut_down(name)
    except MasterError:
        raise
    except RosError as error:  # the node may have ended before it answered
        silence = error
    if not processes.wait_for(lambda: name not in nodes.names(), START_TIMEOUT if silence is None else _SILENCE):
        raise silence or RosError(f"the node {name} did not end within {START_TIMEOUT:g} s of the request.")
    return True


@answers(False)
def ros_kill_all_nodes() -> bool:
    """End all nodes that this process has started in child processes. Other nodes are not affected."""
    names = nodes.ours() if master.is_online() else set()
    for name in names:
        try:
            nodes.shut_down(name)
        except RosError as error:
            LOG.debug("%s", error)
    ended = processes.stop(processes.owned(["node", "state publisher"]))
    if not processes.wait_for(lambda: not master.is_online() or not nodes.ours() & names, START_TIMEOUT):
        raise RosError(f"the nodes {', '.join(sorted(nodes.ours() & names))} did not end on request.")
    return ended


@answers(False)
def ros_kill_master() -> bool:
    """End the ROS master if this process started it, or return False if another process started it."""
    ours = processes.owned(["master"])
    ended = processes.stop(ours)
    if not ours and master.is_online():
        raise MasterError(master.master_uri(), "the master was not stopped, because another process started it")
    return ended


@answers(False)
def ros_kill_all_processes() -> bool:
    """End all processes that this process has started: nodes, launch files, the simulation and the ROS master."""
    return processes.stop(processes.owned())


def _python_command(program: Path) -> tuple[list[str | Path], dict[str, str] | None]:
    """Return the command that runs a node, and the environment variables for this command.

    Python nodes from other packages run with this Python interpreter, which can import the modules that these packages
    require. ROS's own nodes run with the system's Python. The environment variables are None for ROS's own nodes and
    for nodes that are not Python scripts; None selects the variables for ROS programs.
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
    """Start a node, and return when the node is registered with the master.

    Args:
        kind: Kind of the process, as in :class:`frobs_ros.ros.processes.Process`.
        command: Program of the node, preceded by an interpreter if necessary.
        name: Name of the node in the ROS graph. Defaults to the node's own name.
        ns: Namespace of the node.
        terminal: Whether to run the node in an xterm window.
        output: Destination of the node's output, as in :func:`ros_node_from_pkg`.
        remaps: Additional arguments of the node, such as ``"_rate:=30"`` or ``"a:=b"``.
        environment: Environment variables of the node. By default, the variables for ROS programs are used.

    Raises:
        MasterError: No master responds.
        ProcessError: The node ended immediately, or did not register with the master in time.
    """
    before = nodes.names()
    words = [*command, f"__ns:={join(ns)}", *([f"__name:={name}"] if name else []), *remaps]
    title = join(ns, name or Path(command[-1]).name)
    process = processes.start(kind, words, name=title, terminal=terminal, output=output, environment=environment)
    replaces = {join(ns, name)} & before if name else set()  # a new node replaces an existing node of the same name

    def is_known() -> bool:
        names = (nodes.names() - before) | replaces
        return bool(names and nodes.of(process.pids(), names))

    process.wait_until(is_known, START_TIMEOUT)
    return process
