"""Measure how often the scripted experts succeed: ``docs/explanation/experts-measured.md``.

The expert of each manipulation ID controls the robot in 200 episodes on MuJoCo and on PyBullet. Other programs on the
machine do not affect the results, which stay in ``build/benchmarks/experts``, so an interrupted measurement continues
where it stopped::

    python tests/benchmarks/experts.py
    python tests/benchmarks/experts.py --only frobs/PandaStack-v0 --fresh

Exits with status 1 if an expert succeeds less often than it must.
"""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser
from collections.abc import Mapping
from datetime import date
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from tasks import ROOT, current_commit, frobs, manipulation_ids

PAGE = ROOT / "docs" / "explanation" / "experts-measured.md"
KEPT = ROOT / "build" / "benchmarks" / "experts"
EPISODES = 200
WANTED = {"mujoco": 0.98, "pybullet": 0.90}
"""Minimum success rate, by simulator."""
NAMES = {"mujoco": "MuJoCo", "pybullet": "PyBullet"}


def measure(id: str, simulator: str, episodes: int = EPISODES, kept: Path = KEPT) -> dict[str, Any]:
    """Evaluate the expert of an ID, or return the existing results.

    Args:
        id: Gymnasium ID.
        simulator: Name of the simulator.
        episodes: Number of episodes, which begin in random states.
        kept: Folder of existing results.

    Returns:
        The results of ``frobs evaluate``, and ``commit``.
    """
    file = kept / f"{id.rpartition('/')[2].lower()}-{simulator}.json"
    if file.is_file():
        return dict(json.loads(file.read_text("utf-8")))
    commit = current_commit()
    found = frobs("evaluate", id, "--expert", "--episodes", episodes, "--simulator", simulator)
    result = {**found, "commit": commit}
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(result, indent=1), "utf-8")
    sys.stderr.write(f"{id} on {NAMES[simulator]}: {found['success_rate']:.1%}\n")
    return result


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
        f"Measured by `tests/benchmarks/experts.py` on {date.today():%d %B %Y}. Commit: {', '.join(commits)}. Each manipulation task "
        "has a scripted expert, which proves that the task can be solved. The table shows the expert's success rate with "
        f"its 95 % confidence interval in {episodes} episodes that begin in random states "
        f"(`frobs evaluate ID --expert --episodes {episodes} --simulator NAME`). Wanted: {wanted}.",
        "",
        "| ID | " + " | ".join(f"on {name} | 95 % interval" for name in NAMES.values()) + " |",
        "|---|" + "---:|---|" * len(NAMES),
    ]
    for id, results in rows.items():
        cells = []
        for simulator, found in results.items():
            low, high = found["success_interval"]
            missed = " (missed)" if fails(simulator, found) else ""
            cells += [f"{found['success_rate']:.1%}{missed}", f"{low:.1%} to {high:.1%}"]
        lines.append(f"| `{id}` | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main() -> int:
    """Measure, write the page if every ID was measured, and return 1 if an expert succeeds too rarely."""
    parser = ArgumentParser(description=__doc__.partition("\n")[0])
    known = manipulation_ids()
    parser.add_argument("--only", nargs="+", choices=known, metavar="ID", help="measure only these IDs; writes no page")
    parser.add_argument("--fresh", action="store_true", help="discard existing results")
    given = parser.parse_args()
    chosen = given.only or known
    if given.fresh:
        for id in chosen:
            for file in KEPT.glob(f"{id.rpartition('/')[2].lower()}-*.json"):
                file.unlink()
    rows = {id: {simulator: measure(id, simulator) for simulator in NAMES} for id in chosen}
    page = report(rows, EPISODES)
    if given.only:
        sys.stdout.write(page)
    else:
        PAGE.write_text(page, "utf-8")
    return int(any(fails(simulator, found) for results in rows.values() for simulator, found in results.items()))


if __name__ == "__main__":
    sys.exit(main())
