"""Measure policies that see through cameras, and prove that they do: ``docs/explanation/vision-measured.md``.

Each policy is trained from the command line and evaluated on 1,000 new episodes; then on 200 each in which it gets black
pictures, the first pictures of the episode, or the pictures of another episode. Results are stored, so an interrupted
measurement continues where it stopped::

    python tests/benchmarks/vision.py --only pick
    python tests/benchmarks/vision.py --kept

Exits with status 1 if a goal is missed.
"""

from __future__ import annotations

import subprocess
import sys
import time
from argparse import ArgumentParser
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from common import RESULTS, ROOT, is_shared, stored

from frobs_core import load_policy
from frobs_core.util.yaml import load_yaml
from frobs_train import Run
from frobs_train.evaluation.evaluate import wilson_interval

PAGE, KEPT = ROOT / "docs" / "explanation" / "vision-measured.md", RESULTS / "vision"
LOOKS = Path(__file__).with_name("looks.yaml")
EPISODES, BLIND_EPISODES, NUM_ENVS, SEED = 1_000, 200, 50, 5_000_000
CAMERAS = ("scene", "wrist")
UNSEEN = {"texture": {"set": [33, 64]}}
"""Patterns of the floor that are not part of training. Colors, cameras and distractors are drawn anew, too."""
BLIND = 0.2
"""Maximum success rate with black pictures."""


@dataclass(frozen=True)
class Case:
    """A policy to train and to measure.

    Attributes:
        id: Environment ID.
        seeds: Seeds of training.
        success: Minimum success rate.
        minutes: Maximum time of training.
        config: Configuration file, or None for the tuned settings.
    """

    id: str
    seeds: tuple[int, ...]
    success: float
    minutes: float
    config: Path | None = None


CASES: Mapping[str, Case] = {
    "pick": Case("frobs/PandaPickAndPlaceVision-v0", (0, 1, 2), 0.95, 20.0),
    "push": Case("frobs/PandaPushVision-v0", (0,), 0.93, 20.0),
    "stack": Case("frobs/PandaStackVision-v0", (0,), 0.80, 40.0),
    "drawer": Case("frobs/PandaOpenDrawerVision-v0", (0,), 0.80, 20.0),
    "looks": Case("frobs/PandaPickAndPlaceVision-v0", (0,), 0.85, 60.0, LOOKS),
}

View = Callable[[dict[str, Any], np.ndarray[Any, np.dtype[np.bool_]], dict[str, Any]], dict[str, Any]]


def black(observation: dict[str, Any], start: Any, kept: dict[str, Any]) -> dict[str, Any]:
    """Return the observation with black pictures."""
    return {**observation, **{name: np.zeros_like(observation[name]) for name in CAMERAS}}


def frozen(observation: dict[str, Any], start: Any, kept: dict[str, Any]) -> dict[str, Any]:
    """Return the observation with the first pictures of each episode."""
    for name in CAMERAS:
        first = kept.setdefault(name, observation[name].copy())
        first[start] = observation[name][start]
    return {**observation, **{name: kept[name] for name in CAMERAS}}


def others(observation: dict[str, Any], start: Any, kept: dict[str, Any]) -> dict[str, Any]:
    """Return the observation with the pictures of the next environment."""
    return {**observation, **{name: np.roll(observation[name], 1, axis=0) for name in CAMERAS}}


VIEWS: Mapping[str, View | None] = {"seen": None, "black": black, "frozen": frozen, "another's": others}


def successes(policy: Path | str, case: Case, view: View | None, episodes: int) -> int:
    """Return the number of successful episodes among ``episodes``, as many in each environment."""
    keywords: dict[str, Any] = {}
    if case.config is not None:
        keywords = {"randomize": {**load_yaml(case.config)["randomize"], **UNSEEN}}
    env = gym.make_vec(f"frobs_core:{case.id}", num_envs=NUM_ENVS, **keywords)
    kept: dict[str, Any] = {}
    left, count = np.full(NUM_ENVS, episodes // NUM_ENVS), 0
    with closing(env), closing(load_policy(policy, env)) as actor:
        observation, _ = env.reset(seed=SEED)
        start = np.ones(NUM_ENVS, np.bool_)
        while left.any():
            shown = observation if view is None else view(observation, start, kept)
            observation, _, terminated, truncated, info = env.step(actor.act(shown, start))
            start = terminated | truncated
            counted = start & (left > 0)
            if counted.any():
                count += int(np.asarray(info["final_info"]["is_success"])[counted].sum())
            left -= counted
    return count


def measure(case: Case, seed: int, run: Path) -> dict[str, Any]:
    """Train and evaluate."""
    begin = time.monotonic()
    command = ["train", case.id, "--algorithm", "dagger", "--seed", str(seed), "--run-dir", str(run)]
    command += [] if case.config is None else ["--config", str(case.config)]
    subprocess.run([sys.executable, "-m", "frobs_cli", *command], check=True, stdout=subprocess.DEVNULL)
    taken = time.monotonic() - begin
    size = sum(path.stat().st_size for path in Run.open(run).newest_checkpoint()[0].path.glob("algorithm/policy.pt"))
    rates = {}
    for name, view in VIEWS.items():
        episodes = EPISODES if view is None else BLIND_EPISODES
        rates[name] = successes(run, case, view, episodes) / episodes
    return {"minutes": taken / 60.0, "bytes": size, "shared": is_shared(), **rates}


def report(rows: Mapping[tuple[str, int], Mapping[str, Any]]) -> tuple[str, bool]:
    """Return the page, and whether all goals are met."""
    lines = [
        "# Benchmarks: policies that see",
        "",
        "Written by `tests/benchmarks/vision.py`. Each policy is trained by DAgger from the scripted expert, without a "
        "GPU. It sees two cameras of 64 × 64 pixels, the state of the tool, and the goal as a vector, but neither the "
        f"pose nor the velocity of an object. Success is that of {EPISODES:,} new episodes, with a 95 % interval, and of "
        f"{BLIND_EPISODES} each with black pictures, with the first pictures of each episode, and with the pictures of "
        "another episode. The times contain everything from the start of the command.",
        "",
        "| environment | seed | training | success | black | first | another's |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    all_met = True
    for (name, seed), row in rows.items():
        case = CASES[name]
        rate = row["seen"]
        low, high = wilson_interval(round(rate * EPISODES), EPISODES)
        met = rate >= case.success and row["minutes"] <= case.minutes and row["black"] < BLIND
        all_met &= met
        goal = "" if met else f" (missed: {case.success:.0%} in {case.minutes:.0f} min)"
        looks = ", looks never seen in training" if case.config else ""
        others = " | ".join(f"{row[view]:.1%}" for view in list(VIEWS)[1:])
        shared = "" if not row["shared"] else " (beside other programs)"
        lines.append(
            f"| `{case.id}`{looks} | {seed} | {row['minutes']:.1f} min{shared} | {rate:.1%} ({100 * low:.1f} to "
            f"{100 * high:.1f}){goal} | {others} |"
        )
    machines = sorted({f"{row['machine']} ({row['commit']})" for row in rows.values()})
    lines += ["", f"Machines and commits: {'; '.join(machines)}."]
    return "\n".join(lines) + "\n", all_met


def main() -> int:
    """Measure what is not stored yet, write the page, and return 1 if a goal is missed."""
    parser = ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--only", nargs="+", choices=CASES, metavar="CASE", help="default: all cases")
    parser.add_argument("--seed", type=int, nargs="+", metavar="N", help="default: the seeds of the case")
    parser.add_argument("--runs", type=Path, default=Path("runs/vision"), metavar="FOLDER", help="folder of the runs")
    parser.add_argument("--kept", action="store_true", help="only write the page of the stored results")
    given = parser.parse_args()
    rows = {}
    for name, case in CASES.items():
        for seed in case.seeds:
            file = KEPT / f"{name}_{seed}.json"
            chosen = name in (given.only or CASES) and seed in (given.seed or case.seeds) and not given.kept
            if chosen or file.is_file():
                rows[name, seed] = stored(file, measure, case, seed, given.runs / f"{name}_{seed}")
    page, all_met = report(rows)
    PAGE.write_text(page, "utf-8")
    return int(not all_met)


if __name__ == "__main__":
    sys.exit(main())
