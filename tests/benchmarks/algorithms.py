"""Measure how the algorithms in PyTorch and in JAX learn to reach with the tuned settings.

Writes steps, training time and success over seeds to ``docs/explanation/algorithms-measured.md``. Takes two hours on
an idle machine with two cores. As with ``tasks.py``, results of finished seeds are kept, and ``--kept`` writes the
page from them::

    python tests/benchmarks/algorithms.py
    python tests/benchmarks/algorithms.py --only sac td3 --seeds 0
    python tests/benchmarks/algorithms.py --runner ray
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

from common import ROOT
from fingerprints import footnotes, mark
from tasks import (
    EPISODES,
    LOCAL,
    SEEDS,
    Case,
    add_runner_options,
    kept_row,
    measure,
    measure_as_jobs,
    open_runner,
)

PAGE = ROOT / "docs" / "explanation" / "algorithms-measured.md"
KEPT = ROOT / "build" / "benchmarks" / "algorithms"
REACH, GOAL = "frobs/Irb120Reach-v0", "frobs/Irb120ReachGoal-v0"
CASES = (
    Case(REACH, "ppo"),
    Case(REACH, "sbx_ppo"),
    Case(REACH, "td3"),
    Case(REACH, "sbx_td3"),
    Case(REACH, "sac"),
    Case(REACH, "sbx_sac"),
    Case(GOAL, "sac"),
    Case(GOAL, "sbx_sac"),
    Case(REACH, "ppo", controller="tcp_delta_position"),
    Case(REACH, "td3", controller="tcp_delta_position"),
    Case(REACH, "sac", controller="tcp_delta_position"),
    Case(REACH, "sbx_sac", controller="tcp_delta_position"),
    Case(REACH, "dqn", controller="discrete"),
    Case(REACH, "sbx_dqn", controller="discrete"),
)
"""Cases of the table. Goal-conditioned IDs have sparse rewards, with which hindsight replay helps."""

SUCCESS = 0.95
"""Minimum success of the worst seed."""


def report(rows: Mapping[Case, Sequence[Mapping[str, Any]]], episodes: int) -> str:
    """Return the page.

    Args:
        rows: Results of :func:`tasks.measure`, one per seed.
        episodes: Number of episodes per evaluation.
    """
    machines = sorted({row["machine"] for found in rows.values() for row in found})
    commits = sorted({row["commit"] for found in rows.values() for row in found})
    lines = [
        "# Benchmarks: algorithms",
        "",
        f"Measured by `tests/benchmarks/algorithms.py` on {date.today():%d %B %Y}. Machine: {'; '.join(machines)}. Commit: "
        f"{', '.join(commits)}. Each run uses the settings that are tuned for the ID: `frobs train ID --algorithm NAME "
        "--controller NAME --seed S`. Algorithms whose names begin with `sbx_` use JAX; the others use PyTorch. "
        f"Success is the share of {episodes:,} new goals that the deterministic policy reaches to within 5 cm and holds "
        f"until the end of the episode; the target is {SUCCESS:.0%} for the worst seed. The training time is the median over the "
        "seeds and includes writing checkpoints and, with JAX, compiling. `frobs/Irb120ReachGoal-v0` has a sparse reward, so "
        "hindsight experience replay is used.",
        "",
        "| algorithm | ID | controller | seeds | steps | training | success, worst | median | best |",
        "|---|---|---|---:|---:|---:|---:|---:|---:|",
    ]
    for case, found in rows.items():
        success = [row["mujoco"]["success_rate"] for row in found]
        worst = f"{min(success):.1%}" + ("" if min(success) >= SUCCESS else " (missed)")
        lines.append(
            f"| {f'`{case.algorithm}` {mark(found, case.fingerprint)}'.rstrip()} | `{case.id}` | `{case.controller or 'joint_delta_position'}` | {len(found)} | "
            f"{found[0]['steps']:,} | {median(row['seconds'] for row in found):.0f} s | {worst} | {median(success):.1%} | "
            f"{max(success):.1%} |"
        )
    lines += footnotes(
        {
            f"`{case.algorithm}` on `{case.id}` {case.controller}".rstrip(): (found, case.fingerprint)
            for case, found in rows.items()
        }
    )
    missing = [
        f"`{case.algorithm}` on `{case.id}` ({case.controller or 'joint_delta_position'})"
        for case in CASES
        if not rows.get(case)
    ]
    if any(row["shared"] for found in rows.values() for row in found):
        lines += ["", "Other programs used the remaining cores during some of the runs, so the times are upper bounds."]
    if missing:
        lines += ["", f"Not part of this measurement: {', '.join(missing)}."]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument(
        "--only",
        nargs="+",
        choices=sorted({case.algorithm for case in CASES}),
        help="measure only these algorithms; writes no page",
    )
    parser.add_argument("--seeds", nargs="+", type=int, default=list(SEEDS))
    parser.add_argument("--kept", action="store_true", help="write the page from existing results")
    add_runner_options(parser)
    given = parser.parse_args()
    cases = [case for case in CASES if not given.only or case.algorithm in given.only]
    if given.kept:
        rows = {
            case: found
            for case in cases
            if (found := [row for seed in given.seeds if (row := kept_row(case, seed, KEPT))])
        }
    else:
        if given.runner != LOCAL:
            wanted = [(case, seed) for case in cases for seed in given.seeds]
            measure_as_jobs(open_runner(given), wanted, kept=KEPT, other_simulator=None)
        rows = {case: [measure(case, seed, kept=KEPT, other_simulator=None) for seed in given.seeds] for case in cases}
    page = report(rows, EPISODES)
    if given.only:  # write no page of a part of the results
        sys.stdout.write(page)
    else:
        PAGE.write_text(page, "utf-8")


if __name__ == "__main__":
    main()
