"""Measure what the framework adds to a training: stable-baselines3 alone against ours, on the same environment object.

Prints a table; a minute for each algorithm on an idle machine::

    python tests/benchmarks/overhead.py
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Callable, Mapping
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

from frobs_core.runs import resolve_config
from frobs_core.runs.config import algorithm_record
from frobs_core.runs.environments import make_vector_env
from frobs_core.runs.recorder import EpisodeRecorder

ENVIRONMENT = "frobs/Irb120Reach-v0"
BUDGET = 0.97
"""Steps per second, ours by theirs: at least."""


class Monitor:
    """Wants a row as often as a run does, and no checkpoint.

    Args:
        steps: Of the training.
    """

    def __init__(self, steps: int) -> None:
        self._every = self._next = max(1, steps // 500)

    def is_due(self, steps: int) -> bool:
        """Return whether a five-hundredth of the training has passed."""
        return steps >= self._next

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Go on."""
        self._next = (steps // self._every + 1) * self._every
        return True

    def offer_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        """Want none."""


def measure(algorithm: str, num_envs: int, gradient_steps: int, steps: int, rounds: int) -> dict[str, Any]:
    """Train in turn without and with the framework, as often as asked for, and compare.

    Args:
        algorithm: Its name.
        num_envs: Environments.
        gradient_steps: In each step of all environments.
        steps: Of each training, over all environments.
        rounds: Trainings of each.

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


def main() -> None:
    """Measure, and print the table."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=6_000, help="of each training")
    parser.add_argument("--rounds", type=int, default=5, help="trainings with and without")
    given = parser.parse_args()
    sys.stdout.write(
        "| algorithm | environments | gradient steps | plain | ours | ratio |\n|---|---:|---:|---:|---:|---:|\n"
    )
    for algorithm, num_envs, gradient_steps in (("sac", 1, 1), ("td3", 1, 1), ("td3", 1, 0), ("sac", 32, 16)):
        row = measure(algorithm, num_envs, gradient_steps, given.steps, given.rounds)
        missed = "" if row["ratio"] >= BUDGET else " (missed)"
        sys.stdout.write(
            f"| `{algorithm}` | {num_envs} | {gradient_steps} | {row['plain']:.0f} /s | {row['ours']:.0f} /s | "
            f"{row['ratio']:.3f}{missed} |\n"
        )


if __name__ == "__main__":
    main()
