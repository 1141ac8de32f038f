from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import scaling

from frobs_devkit.scaling import ScalingResult

_CLUSTER = """
import json
import scaling
ranges = ("--num-envs", "4", "--threads", "1", "--processes", "1", "--seconds", "0.2")
with scaling.local_cluster() as address:
    row = scaling.measure(scaling.IDS[0], address, *ranges)
print(json.dumps(row))
"""  # in a separate process, because Ray reads its token when it is imported

ROWS = json.loads(scaling.RECORD.read_text("utf-8"))


def test_the_page_is_the_report_of_the_record() -> None:
    assert scaling.PAGE.read_text("utf-8") == scaling.report(ROWS)
    assert tuple(row["id"] for row in ROWS) == scaling.IDS


def test_the_page_says_how_busy_the_machine_was() -> None:
    busy = [{**row, "shared": True} for row in ROWS]
    assert "**Other programs used the machine" in scaling.report(busy)
    idle = [{**row, "shared": False} for row in ROWS]
    assert "**Other programs used the machine" not in scaling.report(idle)


def test_the_record_has_two_nodes_on_one_machine() -> None:
    for row in ROWS:
        result = ScalingResult.from_dict(row)
        assert [(point.processes, point.nodes, point.hosts) for point in result.sweep("cluster")] == [
            (1, 1, 1),
            (2, 2, 1),
        ]


@pytest.mark.needs("ray")
@pytest.mark.slow
def test_processes_on_a_cluster_are_measured() -> None:
    done = subprocess.run(
        [sys.executable, "-c", _CLUSTER], cwd=Path(__file__).parent, check=True, stdout=subprocess.PIPE
    )
    row = json.loads(done.stdout.splitlines()[-1])
    result = ScalingResult.from_dict(row)
    assert [(point.processes, point.nodes) for point in result.sweep("cluster")] == [(1, 1), (2, 2)]
    assert "| cluster | 4 | 1 | 2 | 2 |" in scaling.report([row])
