"""Measure the benefit of randomization: evaluate policies trained with and without it on models with known errors.

Writes ``docs/explanation/robustness-measured.md``. Requires an otherwise idle machine. Each seed takes about a minute
with tool actions, and several with joint actions::

    python tests/benchmarks/robustness.py --controllers tcp_delta_position --seeds 1
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
from statistics import mean
from time import perf_counter
from typing import Any

from frobs_core.util.yaml import dump_yaml
from frobs_train import Run, evaluate, resolve_config, train

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "explanation" / "robustness-measured.md"
ID = "frobs/Irb120Reach-v0"
CONTROLLERS = ("tcp_delta_position", "joint_delta_position")
RANDOMIZE: dict[str, Any] = {
    "mass": {"scale": [0.75, 1.25]},
    "stiffness": {"scale": [0.75, 1.25]},
    "damping": {"scale": [0.75, 1.25]},
    "action_delay": {"steps": [0, 2]},
    "observation_noise": {
        "joint_positions": {"normal": 0.005},
        "tcp_position": {"normal": 0.005},
        "goal_offset": {"normal": 0.005},
        "goal_from_shoulder": {"normal": 0.005},
    },
}
"""Randomization in training: slightly larger than the errors in :data:`GRID`."""

TRAININGS: Mapping[str, Mapping[str, Any]] = {"without": {}, "with": RANDOMIZE}
SUCCESS = 0.9
"""Minimum success of a randomized policy on models with errors of 20 % in mass and gains."""


def model_error(mass: float, gains: float) -> dict[str, Any]:
    """Return the error of a model whose masses and drive gains are scaled by constant factors."""
    return {"mass": {"scale": mass}, "stiffness": {"scale": gains}, "damping": {"scale": gains}}


GRID = {(mass, gains): model_error(mass, gains) for mass, gains in product((0.8, 1.0, 1.2), repeat=2)}
"""Models with errors of up to 20 %, by the factors of mass and gains."""

HARDER: Mapping[str, dict[str, Any]] = {
    "masses × 1.5": model_error(1.5, 1.0),
    "gains × 0.5": model_error(1.0, 0.5),
    "actions delayed by 1 step": {"action_delay": {"steps": 1}},
    "actions delayed by 2 steps": {"action_delay": {"steps": 2}},
    "actions delayed by 3 steps": {"action_delay": {"steps": 3}},
    "observations delayed by 2 steps": {"observation_delay": {"steps": 2}},
    "noise of 5 mm and 5 mrad": {"observation_noise": RANDOMIZE["observation_noise"]},
    "all errors of the training": RANDOMIZE,
}
"""Other errors: larger ones, delays and noise."""


def measure(controller: str, seeds: Sequence[int], episodes: int, steps: int | None = None) -> list[dict[str, Any]]:
    """Train with and without randomization, and evaluate on every model.

    Args:
        controller: Controller of the environment.
        seeds: Seeds, one per training run of each kind.
        episodes: Number of episodes per evaluation.
        steps: Number of steps per training run; None: the tuned number.

    Returns:
        One row per training run: its settings, its duration [s], and its success on each model by the model's name.
    """
    rows = []
    for (name, randomize), seed in product(TRAININGS.items(), seeds):
        flags = {"controller": controller, "seed": seed, "steps": steps, "randomize": randomize or None}
        with tempfile.TemporaryDirectory() as folder:
            start = perf_counter()
            run: Run = train(resolve_config(ID, flags=flags), Path(folder) / "run")
            row = {"controller": controller, "training": name, "seed": seed, "seconds": perf_counter() - start}
            models = {**{_cell(*factors): model for factors, model in GRID.items()}, **HARDER}
            for model_name, model in models.items():
                row[model_name] = evaluate(run, episodes, randomize=model).success_rate
        rows.append(row)
        _say(f"{controller}, {name} randomization, seed {seed}: worst of the grid {_worst(row):.1%}")
    return rows


def report(rows: Sequence[Mapping[str, Any]], episodes: int) -> str:
    """Return the page."""
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, text=True, capture_output=True).stdout
    seeds = sorted({row["seed"] for row in rows})
    lines = [
        "# Benchmarks: robustness",
        "",
        f"Measured by `tests/benchmarks/robustness.py` on {date.today():%d %B %Y}, at commit {commit.strip() or 'unknown'}. PPO "
        f"was trained on `{ID}` with and without [randomization](../how-to/randomize.md) and evaluated on models with known "
        f"errors. Each success rate is the share of {episodes:,} episodes, each with a new goal, that end with the tool within "
        f"5 cm of the goal. Training seeds: {', '.join(map(str, seeds))}"
        f"{'; the tables show their mean, and the worst in brackets' if len(seeds) > 1 else ''}.",
        "",
    ]
    for controller in dict.fromkeys(row["controller"] for row in rows):
        those = [row for row in rows if row["controller"] == controller]
        lines += _section(controller, {name: [r for r in those if r["training"] == name] for name in TRAININGS})
    return "\n".join([*lines, "## What was randomized", "", "```yaml", dump_yaml({"randomize": RANDOMIZE}) + "```", ""])


def _section(controller: str, trained: Mapping[str, Sequence[Mapping[str, Any]]]) -> list[str]:
    seconds = {name: mean(row["seconds"] for row in rows) for name, rows in trained.items()}
    worst = min(_worst(row) for row in trained["with"])
    lines = [
        f"## `{controller}`",
        "",
        f"Training takes {seconds['without']:.1f} s without randomization and {seconds['with']:.1f} s with "
        "randomization. On "
        f"models with errors of 20 % in masses and gains, the lowest success rate with randomization is {worst:.1%} (target: at "
        f"least {SUCCESS:.0%}).",
        "",
        "| model | without | with |",
        "|---|---:|---:|",
    ]
    for model in (*(_cell(*factors) for factors in GRID), *HARDER):
        cells = []
        for rows in trained.values():
            found = [row[model] for row in rows]
            cells.append(f"{mean(found):.1%}" + (f" ({min(found):.1%})" if len(found) > 1 else ""))
        lines.append(f"| {model} | {' | '.join(cells)} |")
    return [*lines, ""]


def _cell(mass: float, gains: float) -> str:
    return "nominal" if mass == gains == 1.0 else f"masses × {mass:g}, gains × {gains:g}"


def _worst(row: Mapping[str, Any]) -> float:
    return min(float(row[_cell(*factors)]) for factors in GRID)


def _say(text: str) -> None:
    sys.stderr.write(f"{text}\n")
    sys.stderr.flush()


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--controllers", nargs="+", default=list(CONTROLLERS), choices=CONTROLLERS)
    parser.add_argument("--seeds", type=int, default=3, help="training runs of each kind")
    parser.add_argument("--episodes", type=int, default=500, help="evaluation episodes per model")
    given = parser.parse_args()
    rows = [row for name in given.controllers for row in measure(name, range(given.seeds), given.episodes)]
    PAGE.write_text(report(rows, given.episodes), "utf-8")
    _say(f"written: {PAGE.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
