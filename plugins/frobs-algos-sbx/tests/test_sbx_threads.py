"""JAX computes on as many threads as ``torch_threads`` says, on limited processors too."""

from __future__ import annotations

import subprocess
import sys

import pytest

SCRIPT = """
import contextlib, logging, os, sys
logging.basicConfig(format="%(message)s", stream=sys.stdout)
if sys.argv[1] != "all":
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
from frobs_algos_sbx.threads import set_threads
for count in sys.argv[2:]:
    set_threads(int(count))
names = []
for task in os.listdir("/proc/self/task"):
    with contextlib.suppress(OSError):  # the thread has ended
        names.append(open(f"/proc/self/task/{task}/comm").read().strip())
print("pool", names.count("tf_XLAEigen"), "NPROC" in os.environ)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="threads are counted in /proc")
@pytest.mark.parametrize(
    ("processors", "counts", "printed"),
    [
        ("all", ["1"], ["pool 1 False"]),
        pytest.param("all", ["3", "3"], ["pool 3 False"], marks=pytest.mark.slow),
        pytest.param("one", ["1"], ["pool 1 False"], marks=pytest.mark.slow),
        pytest.param(
            "all",
            ["2", "1"],
            ["JAX already runs with 2 threads in this process, so torch_threads = 1 has no effect.", "pool 2 False"],
            marks=pytest.mark.slow,
        ),
    ],
    ids=["one", "three", "affinity", "too-late"],
)
def test_the_pool_of_jax_has_the_chosen_size(processors: str, counts: list[str], printed: list[str]) -> None:
    command = [sys.executable, "-c", SCRIPT, processors, *counts]
    done = subprocess.run(command, check=True, text=True, capture_output=True)
    assert done.stdout.splitlines() == printed
