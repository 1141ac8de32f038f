"""Compare how fast FRobs and panda-gym learn to reach, on one machine: ``docs/explanation/neighbours-measured.md``.

panda-gym requires older versions of Gymnasium and NumPy than FRobs, so the script creates a separate virtual
environment for it in ``build/benchmarks/neighbours``. Requires an idle machine. Each seed takes some minutes::

    python tests/benchmarks/neighbours.py
"""

from __future__ import annotations

import csv
import json
import math
import shutil
import subprocess
import sys
import venv
from argparse import ArgumentParser
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from statistics import median
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from tasks import current_commit, machine

from frobs_train import evaluate, resolve_config, train

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "explanation" / "neighbours-measured.md"
KEPT = ROOT / "build" / "benchmarks" / "neighbours"
SCRIPT = Path(__file__).with_name("neighbour_panda_gym.py")
REQUIREMENTS = ("panda-gym==3.0.7", "gymnasium==0.29.1", "stable-baselines3==2.3.2", "numpy==1.26.4", "torch==2.13.0")
THRESHOLDS = (0.95, 0.98)
EPISODES = 300
"""Number of episodes per evaluation."""


@dataclass(frozen=True)
class Ours:
    """A training run of FRobs.

    Attributes:
        name: Name in the table.
        id: Gymnasium ID.
        flags: Flags of ``frobs train``.
        every: Environment steps between evaluations.
    """

    name: str
    id: str
    flags: Mapping[str, Any]
    every: int


OURS = (
    Ours("FRobs, IRB 120, tool actions", "frobs/Irb120Reach-v0", {"controller": "tcp_delta_position"}, 2_048),
    Ours("FRobs, IRB 120, joint actions", "frobs/Irb120Reach-v0", {"controller": "joint_delta_position"}, 10_240),
    Ours(
        "FRobs, IRB 120, joint actions, in JAX",
        "frobs/Irb120Reach-v0",
        {"controller": "joint_delta_position", "algorithm": "sbx_ppo"},
        10_240,
    ),
)
THEIRS = "panda-gym, PandaReach-v3"


def measure_ours(case: Ours, seed: int, episodes: int = EPISODES, steps: int | None = None) -> dict[str, Any]:
    """Train with a checkpoint at each evaluation point, and evaluate the checkpoints afterwards.

    Args:
        case: Training run.
        seed: Seed of training.
        episodes: Number of episodes per evaluation.
        steps: Number of training steps; None: the tuned number.

    Returns:
        ``name``, ``seed`` and ``moments``: for each checkpoint ``steps``, ``seconds`` of training and ``success``.
    """
    run_dir = KEPT / "run"
    shutil.rmtree(run_dir, ignore_errors=True)
    flags = {**case.flags, "seed": seed, "steps": steps}
    settings = [f"checkpoint_every={case.every}", "keep_checkpoints=1000", f"log_every={case.every}"]
    run = train(resolve_config(case.id, flags=flags, settings=settings), run_dir)
    with (run_dir / "progress.csv").open(newline="", encoding="utf-8") as file:
        elapsed = {int(float(row["train/steps"])): float(row["time/elapsed"]) for row in csv.DictReader(file)}
    moments: list[dict[str, float]] = []
    for checkpoint in run.checkpoints:
        found = evaluate(run, episodes, checkpoint=checkpoint.steps)
        seconds = next(at for steps_, at in sorted(elapsed.items()) if steps_ >= checkpoint.steps)
        moments.append({"steps": checkpoint.steps, "seconds": seconds, "success": float(found.success_rate or 0.0)})
        if moments[-1]["success"] >= max(THRESHOLDS):
            break
    return {"name": case.name, "seed": seed, "moments": moments}


def measure_theirs(
    seed: int, episodes: int = EPISODES, steps: int = 20_000, python: Path | None = None
) -> dict[str, Any]:
    """Train panda-gym's PandaReach-v3 with SAC and hindsight replay, in its own virtual environment.

    Args:
        seed: Seed of training.
        episodes: Number of episodes per evaluation.
        steps: Maximum number of training steps.
        python: Interpreter of that virtual environment; None: create the environment.

    Returns:
        The same keys as :func:`measure_ours`.
    """
    command = [python or neighbours_python(), SCRIPT, str(seed), str(steps), str(episodes), str(max(THRESHOLDS))]
    done = subprocess.run(command, check=True, text=True, stdout=subprocess.PIPE)
    return {"name": THEIRS, "seed": seed, "moments": json.loads(done.stdout.splitlines()[-1])}


def neighbours_python() -> Path:
    """Return the interpreter of panda-gym's virtual environment, which is created if it does not exist."""
    folder = KEPT / "venv"
    python = folder / "bin" / "python"
    ready = folder / "ready"
    if not ready.is_file() or ready.read_text("utf-8") != "\n".join(REQUIREMENTS):
        venv.create(folder, with_pip=True, clear=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", *REQUIREMENTS], check=True)
        ready.write_text("\n".join(REQUIREMENTS), "utf-8")
    return python


def reached(row: Mapping[str, Any], threshold: float) -> float:
    """Return the seconds of training until the first evaluation that reached the threshold, or infinity."""
    return next((moment["seconds"] for moment in row["moments"] if moment["success"] >= threshold), math.inf)


def report(rows: Sequence[Mapping[str, Any]], episodes: int) -> str:
    """Return the page."""
    names = list(dict.fromkeys(row["name"] for row in rows))
    seeds = sorted({row["seed"] for row in rows})
    lines = [
        "# Benchmarks: comparison with panda-gym",
        "",
        f"Measured by `tests/benchmarks/neighbours.py` on {date.today():%d %B %Y}. Machine: {machine()}. Commit: "
        f"{current_commit()}. The candidates in the table were trained one after another on the same machine. The tables show the training "
        f"time, including compilation, until an evaluation on {episodes} new goals first reaches the success rate. Imports "
        "and evaluations are not included.",
        "",
        "| | " + " | ".join(f"to {share:.0%}, median | all seeds" for share in THRESHOLDS) + " |",
        "|---|" + "---:|---|" * len(THRESHOLDS),
    ]
    for name in names:
        cells = []
        for share in THRESHOLDS:
            seconds = [reached(row, share) for row in rows if row["name"] == name]
            cells += [_time(median(seconds)), ", ".join(map(_time, seconds))]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    lines += [
        "",
        f"Seeds {', '.join(map(str, seeds))}. Both frameworks call their task *reach*, but the tasks differ in many ways:",
        "",
        "| | panda-gym | FRobs |",
        "|---|---|---|",
        "| robot, engine | Franka Panda, PyBullet, one environment | ABB IRB 120, MuJoCo, 64 or 128 environments |",
        "| goals | in a box of 30 cm around the initial tool position | everywhere within reach in a box of 1 m, also behind "
        "the arm and below its shoulder |",
        "| success | within 5 cm once, which ends the episode | within 5 cm when the episode ends, after 50 steps |",
        "| reward | sparse: −1 until the goal is reached | dense: −distance, and a bonus for the last centimeters |",
        "| actions | tool displacement | tool displacement, or joint displacements |",
        "| algorithm | SAC with hindsight experience replay (stable-baselines3) | PPO with the tuned settings "
        "(stable-baselines3; in JAX: sbx with FRobs's own update) |",
        "",
        "A sparse reward requires hindsight experience replay, and PPO benefits from many cheap environments. Each candidate "
        "uses the algorithm that suits its task. The times therefore show how long a user waits, not which algorithm is "
        "better.",
    ]
    return "\n".join(lines) + "\n"


def _time(seconds: float) -> str:
    return "never" if math.isinf(seconds) else f"{seconds:.1f} s" if seconds < 20 else f"{seconds:.0f} s"


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--episodes", type=int, default=EPISODES, help="episodes per evaluation")
    given = parser.parse_args()
    neighbours_python()
    rows = []
    for seed in given.seeds:
        rows.append(measure_theirs(seed, given.episodes))
        rows += [measure_ours(case, seed, given.episodes) for case in OURS]
        for row in rows[-1 - len(OURS) :]:
            sys.stderr.write(f"{row['name']}, seed {seed}: {_time(reached(row, max(THRESHOLDS)))}\n")
    PAGE.write_text(report(rows, given.episodes), "utf-8")


if __name__ == "__main__":
    main()
