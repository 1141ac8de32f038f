"""Measure what recording costs: ``docs/explanation/recording-measured.md``.

The same episodes are evaluated and recorded in turn, in one process. Run the script on an idle machine::

    python tests/benchmarks/recording.py
    python tests/benchmarks/recording.py --rounds 1 --quick

Exits with status 1 if recording is slower than it must be.
"""

from __future__ import annotations

import sys
import tempfile
import time
from argparse import ArgumentParser
from collections.abc import Callable, Mapping, Sequence
from datetime import date
from pathlib import Path
from statistics import median
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from common import ROOT, current_commit, is_shared, machine

from frobs_data import record
from frobs_train import evaluate, open_policy

PAGE = ROOT / "docs" / "explanation" / "recording-measured.md"
ID = "frobs/PandaPickAndPlace-v0"
VECTORS = {64: 512, 1: 40}
"""Number of episodes without pictures, by number of environments."""
PICTURES = 16
"""Number of episodes with pictures."""
WRIST = {"link": "panda_link8", "pos": [0.0, 0.05, 0.0], "target": [0.0, 0.0, 0.2], "fov_y": 60.0}
CAMERAS: Mapping[str, Any] = {"overview": None, "wrist": WRIST}
MOST_RATIO, LEAST_RATE = 1.15, 40.0


def seconds(function: Callable[[], object]) -> float:
    """Return the duration of a call [s]."""
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def ratio(num_envs: int, episodes: int, rounds: int) -> tuple[float, float, float]:
    """Return the median times [s] of an evaluation and of a recording, and the median of their ratios."""
    run = open_policy(ID, "expert")
    pairs = []
    for _ in range(rounds + 1):  # the first round warms up
        with tempfile.TemporaryDirectory() as folder:
            plain = seconds(lambda: evaluate(run, episodes, num_envs=num_envs))
            out = Path(folder) / "set"
            recorded = seconds(lambda out=out: record(ID, episodes=episodes, num_envs=num_envs, out=out))  # type: ignore[misc]
        pairs.append((plain, recorded))
    del pairs[0]
    plains, recordings = zip(*pairs, strict=True)
    return median(plains), median(recordings), median(recorded / plain for plain, recorded in pairs)


def rate(episodes: int, rounds: int) -> float:
    """Return the median number of frames per second with two cameras of 96 × 96 pixels."""
    rates = []
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as folder:
            start = time.perf_counter()
            dataset = record(ID, episodes=episodes, out=Path(folder) / "set", cameras=CAMERAS)
            rates.append(len(dataset) / (time.perf_counter() - start))
    return median(rates)


def report(rows: Sequence[tuple[int, int, tuple[float, float, float]]], frames: float, shared: bool) -> str:
    """Return the page.

    Args:
        rows: Number of environments, number of episodes and result of :func:`ratio`.
        frames: Result of :func:`rate`.
        shared: Whether other programs kept the machine busy.
    """
    busy = " **Other programs kept the machine busy, so these figures are too high.**" if shared else ""
    lines = [
        "# Benchmarks: recording",
        "",
        f"Written by `tests/benchmarks/recording.py` on {date.today():%d %B %Y}. Commit: {current_commit()}. Machine: "
        f"{machine()}.{busy} The scripted expert of `{ID}` plays the same episodes in an evaluation and in a recording, "
        "in turn. The times include building the environment and joining the files.",
        "",
        "| environments | episodes | evaluated | recorded | ratio | at most |",
        "|---:|---:|---:|---:|---:|---:|",
    ]
    for num_envs, episodes, (plain, recorded, cost) in rows:
        missed = " (missed)" if cost > MOST_RATIO else ""
        lines.append(
            f"| {num_envs} | {episodes} | {plain:.1f} s | {recorded:.1f} s | {cost:.2f}{missed} | {MOST_RATIO:.2f} |"
        )
    missed = " (missed)" if frames < LEAST_RATE else ""
    lines += [
        "",
        f"With two cameras of 96 × 96 pixels, {frames:.0f} frames per second are recorded{missed}; at least "
        f"{LEAST_RATE:.0f} are required.",
    ]
    return "\n".join(lines) + "\n"


def main() -> int:
    """Measure, write the page, and return 1 if recording is too slow."""
    parser = ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=5, help="number of measured rounds")
    parser.add_argument("--quick", action="store_true", help="record an eighth of the episodes")
    given = parser.parse_args()
    part = 8 if given.quick else 1
    rows = [(n, max(n, count // part), ratio(n, max(n, count // part), given.rounds)) for n, count in VECTORS.items()]
    frames = rate(max(2, PICTURES // part), given.rounds)
    PAGE.write_text(report(rows, frames, is_shared()), "utf-8")
    return int(frames < LEAST_RATE or any(found[2] > MOST_RATIO for _, _, found in rows))


if __name__ == "__main__":
    sys.exit(main())
