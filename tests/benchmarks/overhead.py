"""Measure training speed relative to plain stable-baselines3, and with different numbers of environments.

Both train on the same environment object. Writes ``docs/explanation/training-speed-measured.md``; takes about half an
hour on an idle machine::

    python tests/benchmarks/overhead.py
"""

from __future__ import annotations

import sys
import tempfile
from argparse import ArgumentParser
from collections.abc import Callable, Mapping, Sequence
from datetime import date
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

from frobs_train import resolve_config, train
from frobs_train.configuration.config import algorithm_record
from frobs_train.environments import make_vector_env
from frobs_train.logs.recorder import EpisodeRecorder

sys.path.insert(0, str(Path(__file__).parent))

from common import ROOT, current_commit, machine

PAGE = ROOT / "docs" / "explanation" / "training-speed-measured.md"
ENVIRONMENT = "frobs/Irb120Reach-v0"
BUDGET = 0.97
"""Minimum ratio of FRobs's steps per second to those of stable-baselines3."""
COLLECTIONS = ((1, 1), (32, 16))
"""Environments, and gradient steps per step of all environments: one each, and the tuned numbers."""
MIXED = ({"mujoco": 48, "pybullet": 16}, {"mujoco": 6, "pybullet": 2})
"""Environments on several simulators."""
MIXED_BUDGET = 1.05
"""Maximum ratio of the time of a step to that of the same environments on each simulator alone."""
SUCCESS = 0.95
"""Success at which a race ends."""


class Monitor:
    """Requests progress as often as a run does, but no checkpoint.

    Args:
        steps: Number of training steps.
    """

    def __init__(self, steps: int) -> None:
        self._every = self._next = max(1, steps // 500)

    def is_due(self, steps: int) -> bool:
        """Return whether 1/500 of the training steps was taken since the last report."""
        return steps >= self._next

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Continue."""
        self._next = (steps // self._every + 1) * self._every
        return True

    def offer_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        """Decline the checkpoint."""


def measure(algorithm: str, num_envs: int, gradient_steps: int, steps: int, rounds: int) -> dict[str, Any]:
    """Train alternately without and with the framework, and compare the speeds.

    Args:
        algorithm: Name of the algorithm.
        num_envs: Number of environments.
        gradient_steps: Number of gradient steps per step of all environments.
        steps: Number of steps per training run, over all environments.
        rounds: Number of training runs of each kind.

    Returns:
        ``algorithm``, ``num_envs``, ``gradient_steps``, ``plain`` and ``ours`` [steps/s], and ``ratio``, the median of
        the rounds.
    """
    settings = [f"algorithm_config.gradient_steps={gradient_steps}"]
    config = resolve_config(ENVIRONMENT, flags={"algorithm": algorithm}, settings=settings)
    env = EpisodeRecorder(make_vector_env(ENVIRONMENT, num_envs, {}), lambda finished: None)
    rates: dict[str, list[float]] = {"plain": [], "ours": []}
    try:
        for _ in range(rounds):
            for kind, seen in rates.items():
                env.reset(seed=0)
                trained = algorithm_record(algorithm).load()(env, config.algorithm_config, 0)
                start = perf_counter()
                if kind == "plain":
                    trained.model.learn(steps, log_interval=None)
                else:
                    trained.train(steps, Monitor(steps))
                seen.append(steps / (perf_counter() - start))
    finally:
        env.close()
    ratio = median(ours / plain for ours, plain in zip(rates["ours"], rates["plain"], strict=True))
    rows = {kind: median(seen) for kind, seen in rates.items()}
    return {"algorithm": algorithm, "num_envs": num_envs, "gradient_steps": gradient_steps, **rows, "ratio": ratio}


def measure_mixed(num_envs: Mapping[str, int], steps: int, rounds: int) -> dict[str, Any]:
    """Compare a step of environments on several simulators with the steps of the same environments on each of them.

    Args:
        num_envs: Number of environments on each simulator.
        steps: Number of steps per round, which alternate between both ways.
        rounds: Number of rounds.

    Returns:
        ``num_envs``, ``together`` and ``parts``, the median times per step [s], and ``ratio``, the median over the
        rounds of the first divided by the second.
    """
    mixed = make_vector_env(ENVIRONMENT, num_envs, {})
    parts = [make_vector_env(ENVIRONMENT, count, {"simulator": name}) for name, count in num_envs.items()]
    times: dict[str, list[float]] = {"together": [], "parts": []}
    try:
        for env in (mixed, *parts):
            env.reset(seed=0)
            env.action_space.seed(0)
        for _ in range(rounds):
            for kind, envs in (("together", [mixed]), ("parts", parts)):
                taken = 0.0
                for _ in range(steps):
                    for env in envs:
                        actions = env.action_space.sample()
                        start = perf_counter()
                        env.step(actions)
                        taken += perf_counter() - start
                times[kind].append(taken / steps)
    finally:
        for env in (mixed, *parts):
            env.close()
    ratio = median(ours / alone for ours, alone in zip(times["together"], times["parts"], strict=True))
    return {"num_envs": dict(num_envs), **{kind: median(seen) for kind, seen in times.items()}, "ratio": ratio}


def race(num_envs: int, gradient_steps: int, seed: int, steps: int | None = None) -> dict[str, Any]:
    """Train SAC with tool actions until the policy is good, evaluated at every 2,000 steps on 100 new goals.

    Args:
        num_envs: Number of environments.
        gradient_steps: Number of gradient steps per step of all environments.
        seed: Seed of training.
        steps: Maximum number of training steps; None: the tuned number.

    Returns:
        ``num_envs``, ``gradient_steps``, ``steps`` and ``seconds`` of training, which include the evaluations.
    """
    settings = [
        f"num_envs={num_envs}",
        f"algorithm_config.gradient_steps={gradient_steps}",
        "evaluate_every=2000",
        f"stop_at_success={SUCCESS}",
    ]
    flags = {"algorithm": "sac", "controller": "tcp_delta_position", "seed": seed, "steps": steps}
    with tempfile.TemporaryDirectory() as folder:
        start = perf_counter()
        run = train(resolve_config(ENVIRONMENT, flags=flags, settings=settings), Path(folder) / "run")
        seconds = perf_counter() - start
        steps = run.checkpoints[-1].steps
    return {"num_envs": num_envs, "gradient_steps": gradient_steps, "steps": steps, "seconds": seconds}


def report(
    overheads: Sequence[Mapping[str, Any]],
    races: Sequence[Sequence[Mapping[str, Any]]],
    mixed: Sequence[Mapping[str, Any]] = (),
) -> str:
    """Return the page.

    Args:
        overheads: Results of :func:`measure`.
        races: Results of :func:`race`: one row per way to collect, with one entry per seed.
        mixed: Results of :func:`measure_mixed`.
    """
    lines = [
        "# Benchmarks: overhead of training",
        "",
        f"Measured by `tests/benchmarks/overhead.py` on {date.today():%d %B %Y}, on {machine()}, at commit {current_commit()}.",
        "",
        "## Overhead of the framework",
        "",
        f"Steps per second of `{ENVIRONMENT}` with `learn` of stable-baselines3, and with the call that `frobs train` uses. Both "
        f"alternate on the same environment. The goal is a median ratio of at least {BUDGET:g}.",
        "",
        "| algorithm | environments | gradient steps | stable-baselines3 | FRobs | ratio |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    for row in overheads:
        missed = "" if row["ratio"] >= BUDGET else " (missed)"
        lines.append(
            f"| `{row['algorithm']}` | {row['num_envs']} | {row['gradient_steps']} | {row['plain']:.0f} /s | "
            f"{row['ours']:.0f} /s | {row['ratio']:.3f}{missed} |"
        )
    lines += [
        "",
        "## Many environments with an off-policy algorithm",
        "",
        f"SAC with tool actions, until the policy reaches {SUCCESS:.0%} of 100 new goals. The policy is evaluated every 2,000 steps; "
        "the times include the evaluations. The table shows medians over the seeds.",
        "",
        "| environments | gradient steps | seeds | steps | seconds |",
        "|---:|---:|---:|---:|---:|",
    ]
    for found in races:
        lines.append(
            f"| {found[0]['num_envs']} | {found[0]['gradient_steps']} | {len(found)} | "
            f"{median(row['steps'] for row in found):,.0f} | {median(row['seconds'] for row in found):.0f} |"
        )
    lines += [
        "",
        "## Several simulators",
        "",
        f"Time of a step of `{ENVIRONMENT}` with environments on several simulators, and of the same environments on each "
        f"simulator alone, added up. Both alternate. The goal is a median ratio of at most {MIXED_BUDGET:g}.",
        "",
        "| environments | together | added up | ratio |",
        "|---|---:|---:|---:|",
    ]
    for row in mixed:
        counts = ", ".join(f"{count} on {name}" for name, count in row["num_envs"].items())
        missed = "" if row["ratio"] <= MIXED_BUDGET else " (missed)"
        times = f"{1e3 * row['together']:.2f} ms | {1e3 * row['parts']:.2f} ms"
        lines.append(f"| {counts} | {times} | {row['ratio']:.3f}{missed} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=6_000, help="training steps per run in the first table")
    parser.add_argument("--rounds", type=int, default=5, help="training runs with and without the framework")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2], help="seeds of the second table")
    parser.add_argument("--mixed", action="store_true", help="print only the measurement of several simulators")
    given = parser.parse_args()
    mixed = [measure_mixed(num_envs, 100, 2 * given.rounds) for num_envs in MIXED]
    if given.mixed:
        sys.stdout.write("\n".join(map(str, mixed)) + "\n")
        return
    overheads = [
        measure(*case, given.steps, given.rounds)
        for case in (("sac", 1, 1), ("td3", 1, 1), ("td3", 1, 0), ("sac", 32, 16))
    ]
    races = [[race(*collection, seed) for seed in given.seeds] for collection in COLLECTIONS]
    PAGE.write_text(report(overheads, races, mixed), "utf-8")


if __name__ == "__main__":
    main()
