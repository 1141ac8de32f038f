"""Measure how often the scripted experts succeed: ``docs/explanation/experts-measured.md``.

The expert of each manipulation ID controls the robot in 200 episodes on MuJoCo and on PyBullet. Other programs on the
machine do not affect the results, which are stored in ``results/experts``, so several processes can share the IDs, and
an interrupted measurement continues where it stopped::

    python tests/benchmarks/experts.py
    python tests/benchmarks/experts.py --only frobs/PandaStack-v0 --fresh
    python tests/benchmarks/experts.py --kept

Exits with status 1 if an expert succeeds less often than it must.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Mapping
from datetime import date
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from common import RESULTS, ROOT, frobs, manipulation_ids, slug, stored

PAGE = ROOT / "docs" / "explanation" / "experts-measured.md"
KEPT = RESULTS / "experts"
EPISODES = 200
WANTED = {"mujoco": 0.98, "pybullet": 0.90}
"""Minimum success rate, by simulator."""
NAMES = {"mujoco": "MuJoCo", "pybullet": "PyBullet"}


def measure(id: str, simulator: str, episodes: int = EPISODES, kept: Path = KEPT) -> dict[str, Any]:
    """Evaluate the expert of an ID, or return the stored results.

    Args:
        id: Gymnasium ID.
        simulator: Name of the simulator.
        episodes: Number of episodes, which begin in random states.
        kept: Folder of stored results.

    Returns:
        ``success_rate`` and ``success_interval``, and the keys of :func:`common.stored`.
    """

    def evaluate() -> dict[str, Any]:
        found = frobs("evaluate", id, "--expert", "--episodes", episodes, "--simulator", simulator)
        sys.stderr.write(f"{id} on {NAMES[simulator]}: {found['success_rate']:.1%}\n")
        return {key: found[key] for key in ("success_rate", "success_interval")}

    return stored(_file(id, simulator, kept), evaluate)


def _file(id: str, simulator: str, kept: Path = KEPT) -> Path:
    return kept / f"{slug(id)}-{simulator}.json"


def fails(simulator: str, found: Mapping[str, Any]) -> bool:
    """Return whether the success rate on a simulator is too low."""
    return bool(found["success_rate"] < WANTED[simulator])


def report(rows: Mapping[str, Mapping[str, Mapping[str, Any]]], episodes: int) -> str:
    """Return the page.

    Args:
        rows: Results of :func:`measure`, by ID and simulator.
        episodes: Number of episodes per result.
    """
    commits = sorted({found["commit"] for results in rows.values() for found in results.values()})
    wanted = " and ".join(f"at least {share:.0%} on {NAMES[name]}" for name, share in WANTED.items())
    lines = [
        "# Benchmarks: scripted experts",
        "",
        f"Written by `tests/benchmarks/experts.py` on {date.today():%d %B %Y}. Commit: {', '.join(commits)}. Each manipulation task "
        "has a scripted expert, which proves that the task can be solved. The table shows the expert's success rate with "
        f"its 95 % confidence interval in {episodes} episodes that begin in random states "
        f"(`frobs evaluate ID --expert --episodes {episodes} --simulator NAME`). Wanted: {wanted}.",
        "",
        "| ID | " + " | ".join(f"on {name} | 95 % interval" for name in NAMES.values()) + " |",
        "|---|" + "---:|---|" * len(NAMES),
    ]
    for id, results in rows.items():
        cells = []
        for simulator in NAMES:
            found = results.get(simulator)
            if found is None:
                cells += ["not measured", ""]
                continue
            low, high = found["success_interval"]
            missed = " (missed)" if fails(simulator, found) else ""
            cells += [f"{found['success_rate']:.1%}{missed}", f"{low:.1%} to {high:.1%}"]
        lines.append(f"| `{id}` | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main() -> int:
    """Measure, write the page, and return 1 if an expert succeeds too rarely."""
    parser = ArgumentParser(description=__doc__.partition("\n")[0])
    known = manipulation_ids()
    parser.add_argument("--only", nargs="+", choices=known, default=known, metavar="ID", help="measure only these IDs")
    parser.add_argument("--fresh", action="store_true", help="discard the stored results of these IDs")
    parser.add_argument("--kept", action="store_true", help="measure nothing: write the page from the stored results")
    given = parser.parse_args()
    wanted = [(id, simulator) for id in given.only for simulator in NAMES]
    if given.fresh:
        for each in wanted:
            _file(*each).unlink(missing_ok=True)
    if not given.kept:
        for each in wanted:
            measure(*each)
    rows = {
        id: {simulator: measure(id, simulator) for simulator in NAMES if _file(id, simulator).is_file()} for id in known
    }
    PAGE.write_text(report(rows, EPISODES), "utf-8")
    return int(any(fails(simulator, found) for results in rows.values() for simulator, found in results.items()))


if __name__ == "__main__":
    sys.exit(main())
