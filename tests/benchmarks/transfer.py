"""Measure the success of a policy, trained on one simulator, on the other simulators without changes.

Writes ``docs/explanation/transfer-measured.md``; takes some minutes::

    python tests/benchmarks/transfer.py --controllers tcp_delta_position
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from argparse import ArgumentParser
from collections.abc import Mapping, Sequence
from datetime import date
from itertools import product
from pathlib import Path
from time import perf_counter
from typing import Any

from frobs_train import evaluate, resolve_config, train

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "explanation" / "transfer-measured.md"
ID = "frobs/Irb120Reach-v0"
CONTROLLERS = ("joint_delta_position", "tcp_delta_position")
SIMULATORS = ("mujoco", "pybullet")
KEPT = 0.95
"""Minimum ratio of the success to that on the simulator of training."""


def measure(
    controllers: Sequence[str], simulators: Sequence[str], episodes: int, steps: int | None = None
) -> list[dict[str, Any]]:
    """Train on each simulator, and evaluate on all.

    Args:
        controllers: Controllers; each is trained separately.
        simulators: Names of the simulators.
        episodes: Number of episodes per evaluation.
        steps: Number of steps per training run; None: the tuned number.

    Returns:
        One row per evaluation: ``controller``, ``trained_on``, ``seconds`` of training, ``evaluated_on``,
        ``success_rate`` and ``success_interval``.
    """
    rows = []
    for controller, learned in product(controllers, simulators):
        flags = {"controller": controller, "simulator": learned, "seed": 0, "steps": steps}
        with tempfile.TemporaryDirectory() as folder:
            start = perf_counter()
            run = train(resolve_config(ID, flags=flags), Path(folder) / "run")
            seconds = perf_counter() - start
            for simulator in simulators:
                found = evaluate(run, episodes, simulator=simulator)
                rows.append(
                    {
                        "controller": controller,
                        "trained_on": learned,
                        "seconds": seconds,
                        "evaluated_on": simulator,
                        "success_rate": found.success_rate,
                        "success_interval": found.success_interval,
                    }
                )
                sys.stderr.write(f"{controller}, {learned} → {simulator}: {found.success_rate:.1%}\n")
    return rows


def report(rows: Sequence[Mapping[str, Any]], episodes: int) -> str:
    """Return the page."""
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, text=True, capture_output=True).stdout
    lines = [
        "# Benchmarks: transfer to another simulator",
        "",
        f"Measured by `tests/benchmarks/transfer.py` on {date.today():%d %B %Y}, at commit {commit.strip() or 'unknown'}. PPO was "
        f"trained on `{ID}` on one simulator, and the policy was evaluated on each simulator without changes. Success is the "
        f"share of {episodes:,} episodes, each with a new goal, that end with the tool within 5 cm of the goal. The target "
        f"is at least {KEPT:.0%} of the success rate on the training simulator.",
        "",
        "| controller | trained on | training | evaluated on | success | 95 % interval | kept |",
        "|---|---|---:|---|---:|---|---:|",
    ]
    home = {(r["controller"], r["trained_on"]): r["success_rate"] for r in rows if r["trained_on"] == r["evaluated_on"]}
    for row in rows:
        low, high = row["success_interval"]
        at_home = home[row["controller"], row["trained_on"]]
        kept = f"{row['success_rate'] / at_home:.1%}" if at_home else "–"
        lines.append(
            f"| `{row['controller']}` | {row['trained_on']} | {row['seconds']:.0f} s | {row['evaluated_on']} | "
            f"{row['success_rate']:.1%} | {low:.1%} to {high:.1%} | {kept} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--controllers", nargs="+", default=list(CONTROLLERS), choices=CONTROLLERS)
    parser.add_argument("--episodes", type=int, default=1000, help="evaluation episodes per pair of simulators")
    given = parser.parse_args()
    PAGE.write_text(report(measure(given.controllers, SIMULATORS, given.episodes), given.episodes), "utf-8")


if __name__ == "__main__":
    main()
