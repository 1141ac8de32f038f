"""Measure the latency of a policy node of ROS 2, and the success of policies in two processes.

Writes ``docs/explanation/ros2-measured.md``. Requires ROS 2 for the tests (``.ci/ros2.sh``) and an idle machine, and takes
about an hour::

    python tests/benchmarks/ros2.py
    python tests/benchmarks/ros2.py --cycles 2000 --episodes 0    # half a minute; writes nothing
"""

from __future__ import annotations

import signal
import sys
import tempfile
from argparse import ArgumentParser
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from datetime import date
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2] / "plugins" / "frobs-ros2" / "tests"))

from common import ROOT, current_commit, frobs, is_shared, machine
from loopback import RATE, measure_loopback
from ros2_processes import Process
from ros2_wheels import ros2_variables

from frobs_train.evaluation.evaluate import wilson_interval

PAGE = ROOT / "docs" / "explanation" / "ros2-measured.md"
IDS = ("frobs/Irb120Reach-v0", "frobs/Ur5PickAndPlace-v0", "frobs/KobukiMaze-v0")
MEDIAN, LATE = 1.5, 5.0
"""Largest median and 99th percentile of the time from a joint state to a command [ms]."""


def lockstep(stack: ExitStack, id: str, episodes: int) -> dict[str, Any]:
    """Return the ``success_rate`` and ``success_interval`` of an ID's policy in lockstep with a served simulation."""
    variables = ros2_variables()
    assert variables is not None, "ROS 2 is missing; run .ci/ros2.sh"
    node = stack.enter_context(Process(variables, "frobs", "ros2", "run", id, "--lockstep", "--json"))
    options = ("--lockstep", "--episodes", episodes, "--json")
    result = stack.enter_context(Process(variables, "frobs", "ros2", "serve", id, *options)).result()
    node.process.send_signal(signal.SIGINT)
    node.result()
    done = result["successes"]
    return {"success_rate": done / episodes, "success_interval": wilson_interval(done, episodes)}


def percentages(row: Mapping[str, Any]) -> str:
    """Return a success rate with its interval."""
    low, high = row["success_interval"]
    return f"{row['success_rate']:.1%} ({low:.1%} to {high:.1%})"


def report(trips: Mapping[str, Mapping[str, Any]], rows: Sequence[tuple[str, Any, Any]], episodes: int) -> str:
    """Return the page.

    Args:
        trips: Results of :func:`measure_loopback`, by the name of the node.
        rows: Each ID with its success in lockstep and in ``frobs evaluate``.
        episodes: Number of episodes.
    """
    latency = "".join(
        f"| {name} | {row['median']:.2f} ms | {row['late']:.2f} ms | {row['sent'] - row['arrived']:,} of {row['sent']:,} "
        f"| {row['cpu']:.2f} ms |\n"
        for name, row in trips.items()
    )
    success = "".join(f"| `{id}` | {percentages(ours)} | {percentages(theirs)} |\n" for id, ours, theirs in rows)
    return f"""# Benchmarks: ROS 2

`python tests/benchmarks/ros2.py` measured these numbers on {date.today()} at commit {current_commit()}, on {machine()}.

## Latency

A node sends joint states at {RATE:g} Hz, and measures when the command of another process arrives. Limits for the policy
node: a median of {MEDIAN:g} ms and a 99th percentile of {LATE:g} ms on an idle machine.

| the other process | median | 99 % | lost | processor time per cycle, with the start |
|---|---|---|---|---|
{latency}
## Success in two processes

`frobs ros2 serve` and `frobs ros2 run` in lockstep over {episodes} episodes, with 95 % intervals:

| ID | through ROS 2 | `frobs evaluate` |
|---|---|---|
{success}"""


def main() -> None:
    """Measure, print the page, and write it if everything was measured."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--cycles", type=int, default=30_000)
    parser.add_argument("--episodes", type=int, default=500)
    options = parser.parse_args()
    variables = ros2_variables()
    assert variables is not None, "ROS 2 is missing; run .ci/ros2.sh"
    with ExitStack() as stack, tempfile.TemporaryDirectory() as folder:

        def start(*command: object) -> Process:
            return stack.enter_context(Process(variables, *command))

        names = {"a bare node of rclpy": False, "the policy node": True}
        trips = {name: measure_loopback(start, Path(folder), options.cycles, policy) for name, policy in names.items()}
        rows = []
        for id in IDS if options.episodes else ():
            theirs = frobs("evaluate", id, "--pretrained", "--episodes", options.episodes)
            rows.append((id, lockstep(stack, id, options.episodes), theirs))
    page = report(trips, rows, options.episodes)
    sys.stdout.write(page)
    if rows and not is_shared():
        PAGE.write_text(page, "utf-8")


if __name__ == "__main__":
    main()
