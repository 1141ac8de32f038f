"""Checks that a cluster's nodes have the versions, plugins, shared folder and memory that jobs require."""

from __future__ import annotations

import contextlib
import platform
import secrets
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import ray
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

from frobs_ray.errors import ClusterResourcesError, NodesDifferError
from frobs_train import versions

_TIMEOUT = 120  # [s] maximum time for a node to import FRobs and its plugins

Versions = Mapping[str, str]
"""Versions of Python, FRobs, all plugins and all libraries, by name."""


def flat_versions() -> dict[str, str]:
    """Return the versions on this machine that affect the results of a training run."""
    installed: Any = versions()
    return {
        "Python": ".".join(platform.python_version_tuple()[:2]),
        "frobs-core": installed["frobs-core"],
        **installed["plugins"],
        **installed["libraries"],
    }


def living_nodes() -> list[dict[str, Any]]:
    """Return Ray's description of each node that is alive."""
    return [node for node in ray.nodes() if node["Alive"]]


def check_resources(processors: int, memory: int) -> None:
    """Check that at least one node has enough processors and memory [B] for a job.

    Raises:
        ClusterResourcesError: No node is large enough.
    """
    nodes = [node["Resources"] for node in living_nodes()]
    if not any(node.get("CPU", 0) >= processors and node.get("memory", 0) >= memory for node in nodes):
        raise ClusterResourcesError(processors, memory, nodes)


def check_nodes(folder: Path) -> None:
    """Check that every node has the same versions as this machine and can read from and write to a folder.

    Raises:
        NodesDifferError: A node differs from this machine. The error message lists all differences.
    """
    here = ray.get_runtime_context().get_node_id()
    with _token(folder) as token:
        probe = ray.remote(examine_node)
        asked = {}
        for node in living_nodes():
            if node["NodeID"] != here:
                placed = NodeAffinitySchedulingStrategy(node["NodeID"], soft=False)
                asked[node["NodeManagerAddress"]] = probe.options(num_cpus=0, scheduling_strategy=placed).remote(token)
        problems = {}
        for address, reference in asked.items():
            try:
                theirs, sees_folder = ray.get(reference, timeout=_TIMEOUT)
            except Exception as error:  # importing FRobs on a node can raise any exception
                problems[address] = [f"FRobs does not run on this node: {_last_line(error)}"]
                continue
            lines = describe_differences(flat_versions(), theirs)
            if not sees_folder:
                lines.append(f"the node cannot write to the folder {folder}")
            if lines:
                problems[address] = lines
    if problems:
        raise NodesDifferError(problems)


def examine_node(token: Path) -> tuple[dict[str, str], bool]:
    """Return this node's versions, and whether the node can see a file and write to the file's folder."""
    beside = token.with_name(f"{token.name}-{secrets.token_hex(4)}")
    try:
        seen = token.is_file()
        if seen:
            beside.touch()
            beside.unlink()
    except OSError:
        seen = False
    return flat_versions(), seen


def describe_differences(here: Versions, there: Versions) -> list[str]:
    """Return a line for each version on a node that differs from the version on this machine."""
    return [
        f"{name} is {there[name]} on the node and {version} on this machine"
        if name in there
        else f"{name} {version} is missing on the node"
        for name, version in here.items()
        if there.get(name) != version
    ]


def difference_here(expected: Versions) -> str:
    """Return how this node differs from the machine that submitted the job, or an empty string if it does not."""
    differences = describe_differences(expected, flat_versions())
    return f"the node differs from the machine that submitted the job: {'; '.join(differences)}." if differences else ""


@contextmanager
def _token(folder: Path) -> Iterator[Path]:
    """Create a temporary file in a folder, so that other nodes can check whether they see the file."""
    path = folder.absolute() / f".frobs-{secrets.token_hex(8)}"
    path.touch()
    try:
        yield path
    finally:
        with contextlib.suppress(OSError):
            path.unlink()


def _last_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__
