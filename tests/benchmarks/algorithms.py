"""Measure how the algorithms learn to reach, with what is tuned for each: steps, time of training, success over seeds.

Writes ``docs/explanation/algorithms-measured.md``; an hour or so on an idle machine with two cores. As with ``tasks.py``,
what is done is kept, and ``--kept`` writes the page of it::

    python tests/benchmarks/algorithms.py
    python tests/benchmarks/algorithms.py --only sac td3 --seeds 0
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from statistics import median
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from tasks import EPISODES, ROOT, SEEDS, Case, kept_row, measure

PAGE = ROOT / "docs" / "explanation" / "algorithms-measured.md"
REACH, GOAL = "frobs/Irb120Reach-v0", "frobs/Irb120ReachGoal-v0"
CASES = (
    Case(REACH, "ppo"),
    Case(REACH, "ppo", controller="tcp_delta_position"),
    Case(REACH, "td3"),
    Case(REACH, "td3", controller="tcp_delta_position"),
    Case(REACH, "sac"),
    Case(REACH, "sac", controller="tcp_delta_position"),
    Case(REACH, "dqn", controller="discrete"),
    Case(GOAL, "sac"),
)
"""With a goal-conditioned ID the reward is sparse, and hindsight replay helps."""

SUCCESS = 0.95
"""What the worst seed must reach."""


def report(rows: Mapping[Case, Sequence[Mapping[str, Any]]], episodes: int) -> str:
    """Return the page.

    Args:
        rows: What :func:`tasks.measure` found for each seed.
        episodes: Of each evaluation.
    """
    machines = sorted({row["machine"] for found in rows.values() for row in found})
    commits = sorted({row["commit"] for found in rows.values() for row in found})
    lines = [
        "# Algorithms, measured",
        "",
        f"By `tests/benchmarks/algorithms.py`, {date.today():%d %B %Y}, on {'; '.join(machines)}, at commit "
        f"{', '.join(commits)}: each algorithm with what is tuned for the ID, `frobs train ID --algorithm NAME "
        f"--controller NAME --seed S`. Success is that of the deterministic policy on {episodes:,} new goals, 5 cm, held at "
        f"the end; the worst seed is to reach {SUCCESS:.0%}. The time is the median of the training, checkpoints included. "
        "`frobs/Irb120ReachGoal-v0` has a sparse reward, with hindsight replay.",
        "",
        "| algorithm | ID | controller | seeds | steps | training | success, worst | median | best |",
        "|---|---|---|---:|---:|---:|---:|---:|---:|",
    ]
    for case, found in rows.items():
        success = [row["mujoco"]["success_rate"] for row in found]
        worst = f"{min(success):.1%}" + ("" if min(success) >= SUCCESS else " (missed)")
        lines.append(
            f"| `{case.algorithm}` | `{case.id}` | `{case.controller or 'joint_delta_position'}` | {len(found)} | "
            f"{found[0]['steps']:,} | {median(row['seconds'] for row in found):.0f} s | {worst} | {median(success):.1%} | "
            f"{max(success):.1%} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=sorted({case.algorithm for case in CASES}), help="algorithms")
    parser.add_argument("--seeds", nargs="+", type=int, default=list(SEEDS))
    parser.add_argument("--kept", action="store_true", help="train nothing; write the page of what was kept")
    given = parser.parse_args()
    cases = [case for case in CASES if not given.only or case.algorithm in given.only]
    if given.kept:
        rows = {
            case: found for case in cases if (found := [row for seed in given.seeds if (row := kept_row(case, seed))])
        }
    else:
        rows = {case: [measure(case, seed, other_simulator=None) for seed in given.seeds] for case in cases}
    page = report(rows, EPISODES)
    if given.only:  # a part is no page
        sys.stdout.write(page)
    else:
        PAGE.write_text(page, "utf-8")


if __name__ == "__main__":
    main()
