"""A cluster of two nodes on this machine, and commands that use it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from ray.cluster_utils import Cluster

STORE = 100 * 2**20
PATIENCE = 600.0  # [s] on a busy machine


class TwoNodes:
    """A head node and a second node with one processor each.

    Args:
        folder: Working folder of the commands.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.cluster = Cluster(  # type: ignore[no-untyped-call]
            initialize_head=True,
            head_node_args={"num_cpus": 1, "object_store_memory": STORE, "include_dashboard": False},
        )
        self.second = self.add_node()

    def add_node(self) -> Any:
        """Add a node with one processor."""
        return self.cluster.add_node(num_cpus=1, object_store_memory=STORE)

    def replace_second(self) -> None:
        """Kill the second node, and let another one join."""
        self.cluster.remove_node(self.second, allow_graceful=False)
        self.second = self.add_node()

    def start(self, *arguments: str) -> subprocess.Popen[str]:
        """Start a command of ``frobs`` on the cluster."""
        address = ["--runner", "ray", "--ray-address", self.cluster.address]
        return subprocess.Popen(
            [sys.executable, "-m", "frobs_cli", *arguments, *address],
            cwd=self.folder,
            env=os.environ,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def run(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run a command of ``frobs`` on the cluster to its end."""
        process = self.start(*arguments)
        return finish(process)


def finish(process: subprocess.Popen[str]) -> subprocess.CompletedProcess[str]:
    """Wait for a command."""
    stdout, stderr = process.communicate(timeout=PATIENCE)
    return subprocess.CompletedProcess(process.args, process.returncode, stdout, stderr)


def wait_for(condition: Callable[[], Any], process: subprocess.Popen[str]) -> None:
    """Wait until something is so, while a command runs."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert process.poll() is None, finish(process)
        assert time.monotonic() < end, "it took too long"
        time.sleep(0.2)


@pytest.fixture
def two_nodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[TwoNodes]:
    """Start a cluster of two nodes on this machine."""
    monkeypatch.setenv("RAY_AUTH_MODE", "disabled")
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    nodes = TwoNodes(tmp_path)
    yield nodes
    nodes.cluster.shutdown()  # type: ignore[no-untyped-call]
