"""Study whether policies that were trained on two engines transfer better to a third setting than those trained on one.

Trains reach, push and slide on MuJoCo, on PyBullet, and on both at once with as many environments and steps in total.
Then it evaluates each policy on both engines, with the nominal models and with shifted physical parameters, which no
training run has seen. Writes ``docs/explanation/transfer-study-measured.md``::

    python tests/benchmarks/transfer_study.py
    python tests/benchmarks/transfer_study.py --only push --seeds 0 1

Takes some hours. Repeat the command to continue an interrupted study: training runs continue from their checkpoints in
``build/benchmarks/transfer_study``, and finished policies are stored in ``results/transfer_study`` next to this script.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from statistics import mean
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from common import RESULTS, ROOT, stored

from frobs_train import evaluate, resolve_config, train

PAGE = ROOT / "docs" / "explanation" / "transfer-study-measured.md"
KEPT = ROOT / "build" / "benchmarks" / "transfer_study"
ENGINES = ("mujoco", "pybullet")
TRAINED_ON = (*ENGINES, "both")
SEEDS, EPISODES = (0, 1, 2, 3, 4), 250
SHIFTED = "shifted"


@dataclass(frozen=True)
class Case:
    """A task of the study.

    Attributes:
        name: Name of the case.
        id: Gymnasium ID.
        algorithm: Name of the algorithm, which is tuned for the ID.
        shift: Randomization settings of the third setting, which have one value each.
    """

    name: str
    id: str
    algorithm: str
    shift: Mapping[str, Any]


CASES = (
    Case(
        "reach",
        "frobs/Irb120Reach-v0",
        "ppo",
        {"mass": {"scale": 1.3}, "stiffness": {"scale": 0.7}, "action_delay": {"steps": 1}},
    ),
    Case(
        "push",
        "frobs/PandaPush-v0",
        "dagger",
        {"friction": {"scale": 0.7}, "mass": {"target": "cube", "scale": 1.5}, "action_delay": {"steps": 1}},
    ),
    Case(
        "slide",
        "frobs/PandaSlide-v0",
        "dagger",
        {"friction": {"scale": 1.2}, "mass": {"target": "puck", "scale": 1.5}, "action_delay": {"steps": 1}},
    ),
)


def measure(
    case: Case, trained_on: str, seed: int, episodes: int, settings: Sequence[str] = (), kept: Path = KEPT
) -> dict[str, Any]:
    """Train a policy, and evaluate it in all settings.

    Args:
        case: The task.
        trained_on: An element of :data:`TRAINED_ON`.
        seed: Seed of training.
        episodes: Number of episodes per evaluation.
        settings: Settings that replace the tuned ones.
        kept: Folder of the training runs.

    Returns:
        ``steps`` and, under ``success``, the success rate by the name of the setting: an engine, or an engine and
        ``" shifted"``.
    """
    flags: dict[str, Any] = {"algorithm": case.algorithm, "seed": seed}
    total = resolve_config(case.id, flags=flags, settings=settings).total_envs
    flags["num_envs"] = {trained_on: total}
    if trained_on == "both":
        flags["num_envs"] = {ENGINES[0]: total - total // 2, ENGINES[1]: total // 2}
    config = resolve_config(case.id, flags=flags, settings=[each for each in settings if "num_envs" not in each])
    run = train(config, kept / f"{case.name}-{trained_on}-seed{seed}", on_existing="resume")
    success = {}
    for engine in ENGINES:
        for name, shift in ((engine, {}), (f"{engine} {SHIFTED}", case.shift)):
            success[name] = evaluate(run, episodes, simulator=engine, randomize=shift or False).success_rate
    sys.stderr.write(f"{case.name} trained on {trained_on}, seed {seed}: {success}\n")
    return {"steps": config.steps, "success": success}


def report(rows: Mapping[tuple[str, str], Sequence[Mapping[str, Any]]], episodes: int) -> str:
    """Return the page.

    Args:
        rows: Results of :func:`measure`, one per seed, by the name of the case and what the policies were trained on.
        episodes: Number of episodes per evaluation.
    """
    cases = {case.name: case for case in CASES}
    settings = [f"{engine}{suffix}" for suffix in ("", f" {SHIFTED}") for engine in ENGINES]
    shifts = "; ".join(f"{case.name}: `{dict(case.shift)}`" for case in CASES)
    places = sorted({f"{row['machine']}, at commit {row['commit']}" for found in rows.values() for row in found})
    lines = [
        "# Benchmarks: training on two engines",
        "",
        f"Written by `tests/benchmarks/transfer_study.py` on {date.today():%d %B %Y}. Measured on {'; '.join(places)}. Each policy "
        "was trained with the tuned settings on MuJoCo, on PyBullet, or on both, with half of the environments on each. The "
        f"policies were evaluated without changes in {episodes:,} new episodes, on both engines with the nominal models and with "
        f"shifted parameters, which no training run has seen ({shifts}). The table shows the mean success over the seeds and, in "
        "parentheses, the lowest.",
        "",
        f"| task | ID | trained on | seeds | {' | '.join(settings)} |",
        f"|---|---|---|---:|{'---:|' * len(settings)}",
    ]
    for (name, trained_on), found in rows.items():
        cells = [_cell([row["success"][setting] for row in found]) for setting in settings]
        lines.append(f"| {name} | `{cases[name].id}` | {trained_on} | {len(found)} | {' | '.join(cells)} |")
    lines += [
        "",
        "The next table shows how much better the policies of both engines are in the shifted settings: the difference of "
        "their mean success from that of the policies of each engine. If the seeds' rates do not overlap, the difference is bold.",
        "",
        "| task | setting | compared with mujoco | compared with pybullet |",
        "|---|---|---:|---:|",
    ]
    for name in cases:
        for setting in settings[len(ENGINES) :]:
            rates = {on: [row["success"][setting] for row in rows[name, on]] for on in TRAINED_ON if (name, on) in rows}
            if len(rates) == len(TRAINED_ON):
                cells = [_difference(rates["both"], rates[engine]) for engine in ENGINES]
                lines.append(f"| {name} | {setting} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _cell(rates: Sequence[float]) -> str:
    return f"{mean(rates):.1%} ({min(rates):.1%})"


def _difference(rates: Sequence[float], others: Sequence[float]) -> str:
    text = f"{100 * (mean(rates) - mean(others)):+.1f} points"
    apart = min(rates) > max(others) or max(rates) < min(others)
    return f"**{text}**" if apart else text


def main() -> None:
    """Measure what is missing, and write the page."""
    parser = ArgumentParser(description=__doc__)
    names = [case.name for case in CASES]
    parser.add_argument("--only", nargs="+", choices=names, help="measure only these tasks; writes no page")
    parser.add_argument("--seeds", nargs="+", type=int, default=list(SEEDS))
    parser.add_argument("--episodes", type=int, default=EPISODES, help="episodes per evaluation")
    given = parser.parse_args()
    rows = {
        (case.name, trained_on): [
            stored(
                RESULTS / "transfer_study" / f"{case.name}-{trained_on}-seed{seed}.json",
                measure,
                *(case, trained_on, seed, given.episodes),
            )
            for seed in given.seeds
        ]
        for case in CASES
        if case.name in (given.only or names)
        for trained_on in TRAINED_ON
    }
    page = report(rows, given.episodes)
    if given.only:  # write no page of a part of the results
        sys.stdout.write(page)
    else:
        PAGE.write_text(page, "utf-8")


if __name__ == "__main__":
    main()
