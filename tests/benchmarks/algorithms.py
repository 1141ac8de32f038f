"""Measure how the algorithms learn to reach, with what is tuned for each: steps, time of training, success over seeds.

Writes ``docs/explanation/algorithms-measured.md``; an hour or so on an idle machine with two cores::

    python tests/benchmarks/algorithms.py
    python tests/benchmarks/algorithms.py --only sac td3 --seeds 0
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from argparse import ArgumentParser
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

from frobs_core.runs import evaluate, resolve_config, train

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "explanation" / "algorithms-measured.md"
REACH, GOAL = "frobs/Irb120Reach-v0", "frobs/Irb120ReachGoal-v0"
CASES = (
    ("ppo", REACH, "joint_delta_position"),
    ("ppo", REACH, "tcp_delta_position"),
    ("td3", REACH, "joint_delta_position"),
    ("td3", REACH, "tcp_delta_position"),
    ("sac", REACH, "joint_delta_position"),
    ("sac", REACH, "tcp_delta_position"),
    ("dqn", REACH, "discrete"),
    ("sac", GOAL, "joint_delta_position"),
)
"""Algorithm, ID and controller; with a goal-conditioned ID the reward is sparse, and hindsight replay helps."""

SUCCESS = 0.95
"""What the worst seed must reach."""


def measure(
    algorithm: str, environment: str, controller: str, seed: int, episodes: int, steps: int | None = None
) -> dict[str, Any]:
    """Train with one seed, and evaluate.

    Args:
        algorithm: Its name.
        environment: Gymnasium ID.
        controller: Of the environment.
        seed: Of the training.
        episodes: Of the evaluation.
        steps: Of the training; None: as tuned.

    Returns:
        ``num_envs``, ``steps``, ``seconds`` of the training and ``success``.
    """
    flags = {"algorithm": algorithm, "controller": controller, "seed": seed, "steps": steps}
    config = resolve_config(environment, flags=flags)
    with tempfile.TemporaryDirectory() as folder:
        start = perf_counter()
        run = train(config, Path(folder) / "run")
        seconds = perf_counter() - start
        found = evaluate(run, episodes)
    told = f"{algorithm}, {environment}, {controller}, seed {seed}: {found.success_rate:.1%} after {seconds:.0f} s\n"
    sys.stderr.write(told)
    return {"num_envs": config.num_envs, "steps": found.steps, "seconds": seconds, "success": found.success_rate}


def report(
    rows: Mapping[tuple[str, str, str], Sequence[Mapping[str, Any]]], seeds: Sequence[int], episodes: int
) -> str:
    """Return the page.

    Args:
        rows: What :func:`measure` found for each seed, by algorithm, ID and controller.
        seeds: Of the trainings.
        episodes: Of each evaluation.
    """
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, text=True, capture_output=True).stdout
    lines = [
        "# Algorithms, measured",
        "",
        f"By `tests/benchmarks/algorithms.py`, {date.today():%d %B %Y}, at commit {commit.strip() or 'unknown'}: each "
        "algorithm with what is tuned for the ID, `frobs train ID --algorithm NAME --controller NAME --seed S`, seeds "
        f"{', '.join(map(str, seeds))}. Success is that of the deterministic policy on {episodes:,} new goals, 5 cm, held at "
        f"the end; the worst seed is to reach {SUCCESS:.0%}. The time is the median of the training, checkpoints included, "
        "on two cores. `frobs/Irb120ReachGoal-v0` has a sparse reward, with hindsight replay.",
        "",
        "| algorithm | ID | controller | environments | steps | training | success, worst | median | best |",
        "|---|---|---|---:|---:|---:|---:|---:|---:|",
    ]
    for (algorithm, environment, controller), found in rows.items():
        success = [row["success"] for row in found]
        worst = f"{min(success):.1%}" + ("" if min(success) >= SUCCESS else " (missed)")
        lines.append(
            f"| `{algorithm}` | `{environment}` | `{controller}` | {found[0]['num_envs']} | {found[0]['steps']:,} | "
            f"{median(row['seconds'] for row in found):.0f} s | {worst} | {median(success):.1%} | {max(success):.1%} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=sorted({case[0] for case in CASES}), help="algorithms")
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--episodes", type=int, default=1000, help="of each evaluation")
    given = parser.parse_args()
    cases = [case for case in CASES if not given.only or case[0] in given.only]
    rows = {case: [measure(*case, seed, given.episodes) for seed in given.seeds] for case in cases}
    page = report(rows, given.seeds, given.episodes)
    if given.only:  # a part is no page
        sys.stdout.write(page)
    else:
        PAGE.write_text(page, "utf-8")


if __name__ == "__main__":
    main()
