"""Measure how speed and memory scale, and write docs/explanation/scaling-measured.md and its plot.

Requires an idle machine and frobs-ray. The cluster has two nodes on this machine, each with one processor.
"""

from __future__ import annotations

import json
import os
import secrets
import subprocess
import sys
import tempfile
from argparse import ArgumentParser
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import date
from pathlib import Path
from typing import Any, cast

from common import ROOT, current_commit, is_shared, machine

from frobs_devkit.scaling import ScalingPoint, ScalingResult, plot_scaling

PAGE = ROOT / "docs" / "explanation" / "scaling-measured.md"
PICTURE = ROOT / "docs" / "images" / "scaling.png"
RECORD = Path(__file__).with_name("scaling_measured.json")
IDS = ("frobs/Irb120Reach-v0", "frobs/KobukiMaze-v0")
SIZES = "1,8,64,512,4096"
"""Numbers of environments in one process."""

NODES = 2


@contextmanager
def local_cluster(nodes: int = NODES) -> Iterator[str]:
    """Start a Ray cluster whose nodes are on this machine, each with one processor, and yield its address.

    The token of the cluster stays in the environment of this process.
    """
    token = {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": secrets.token_hex(32), "RAY_USAGE_STATS_ENABLED": "0"}
    os.environ.update(token)
    from ray.cluster_utils import Cluster

    with tempfile.TemporaryDirectory(prefix="ray-", ignore_cleanup_errors=True) as folder:
        # The argument temp_dir would not do: Cluster writes its address to the default folder, without creating it.
        os.environ["RAY_TMPDIR"] = folder
        options = {"num_cpus": 1, "object_store_memory": 2**29}
        cluster: Any = Cluster(initialize_head=True, head_node_args={**options, "include_dashboard": False})
        try:
            for _ in range(nodes - 1):
                cluster.add_node(**options)
            cluster.wait_for_nodes()
            yield cluster.address
        finally:
            cluster.shutdown()
            del os.environ["RAY_TMPDIR"]


def measure(id: str, address: str, *options: str) -> dict[str, Any]:
    """Return the results of ``frobs bench ID --scaling``, with the circumstances."""
    command = [sys.executable, "-m", "frobs_cli", "bench", id, "--scaling", "--runner", "ray", "--ray-address", address]
    arguments = ["--num-envs", SIZES, "--jobs", "1,2", *options, "--json"]
    shared = is_shared()
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run([*command, *arguments], cwd=folder, check=True, text=True, stdout=subprocess.PIPE)
    found = cast("dict[str, Any]", json.loads(done.stdout))
    return found | {
        "date": f"{date.today()}",
        "commit": current_commit(),
        "on": machine(),
        "shared": shared or is_shared(),
    }


def report(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the page.

    Args:
        rows: Results of :func:`measure`, one per ID.
    """
    results = [ScalingResult.from_dict(dict(row)) for row in rows]
    first = rows[0]
    commits = ", ".join(dict.fromkeys(row["commit"] for row in rows))
    lines = [
        "# Benchmarks: scaling",
        "",
        f"Written by `tests/benchmarks/scaling.py` on {date.fromisoformat(first['date']):%d %B %Y}. Machine: {first['on']}. "
        f"Commit: {commits}. [Scaling](scaling.md) explains the measurements.",
        "",
        *_circumstances(rows),
        f"The cluster consists of {NODES} Ray nodes **on the same machine**, each with one processor. The nodes share "
        "the machine's memory and caches, and there is no network between them. Compare the rows *cluster* with the rows "
        "*processes* to see whether Ray slows down the processes. The measurements do not include the effects of a network.",
        "",
        "![Speed and memory use for different numbers of environments, threads and processes](../images/scaling.png)",
        "",
        "The error bars show the slowest and the fastest of five time windows.",
    ]
    for result in results:
        lines += ["", f"## {result.id}", "", *_section(result)]
    return "\n".join(lines) + "\n"


def _circumstances(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    if not any(row["shared"] for row in rows):
        return []
    loads = " and ".join(f"{row['load']:.0f}" for row in rows)
    return [
        f"**Other programs used the machine during these measurements**: {loads} processes were competing for its "
        f"{rows[0]['processors']} processors at the start. The *processor time* column shows how much of a processor "
        "each thread received. The speed per processor is the speed that a whole processor would have allowed; the plot uses "
        "this speed. Run the script again on an idle machine for better figures.",
        "",
    ]


def _section(result: ScalingResult) -> list[str]:
    per_env = (result.memory_per_env or 0) / 1e3
    return [
        "| varied | environments per process | threads | processes | nodes | steps/s | slowest to fastest window | "
        "processor time | steps/s per processor | memory per process |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
        *(_row(point) for point in result.points),
        "",
        f"A process needs {result.memory_per_process / 1e6:.0f} MB, and each additional environment needs {per_env:.1f} kB. A process "
        f"starts within {result.startup:.1f} s (median).",
    ]


def _row(point: ScalingPoint) -> str:
    cells = (
        point.sweep,
        f"{point.num_envs:,}",
        f"{point.threads}",
        f"{point.processes}",
        f"{point.nodes}",
        f"{point.steps_per_second:,.0f}",
        f"{point.low:,.0f} to {point.high:,.0f}",
        f"{point.processor_share:.0%}",
        f"{point.undisturbed / (point.processes * point.threads):,.0f}",
        f"{point.memory / 1e6:,.0f} MB",
    )
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=2.0, help="duration of the measurement at each size [s]")
    parser.add_argument("--kept", action="store_true", help="write the page from the last measurement")
    options = parser.parse_args()
    if not options.kept:
        with local_cluster() as address:
            rows = [measure(id, address, "--seconds", f"{options.seconds}") for id in IDS]
        RECORD.write_text(json.dumps(rows, indent=1) + "\n", "utf-8")
    rows = json.loads(RECORD.read_text("utf-8"))
    results = [ScalingResult.from_dict(row) for row in rows]
    plot_scaling(results, PICTURE)
    PAGE.write_text(report(rows), "utf-8")


if __name__ == "__main__":
    main()
