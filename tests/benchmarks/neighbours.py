"""Compare how fast FRobs and panda-gym learn, on one machine: ``docs/explanation/neighbours-measured.md``.

panda-gym requires older versions of Gymnasium and NumPy than FRobs, so the script creates a separate virtual
environment for it in ``build/benchmarks/neighbours``. Requires an idle machine. Reaching takes some minutes per seed,
and the tasks with a cube take up to two hours. The results of finished training runs are stored in
``results/neighbours``, so an interrupted measurement continues where it stopped::

    python tests/benchmarks/neighbours.py
    python tests/benchmarks/neighbours.py --only push --side panda-gym
"""

from __future__ import annotations

import csv
import json
import math
import shutil
import subprocess
import sys
import time
import venv
from argparse import ArgumentParser
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from statistics import median
from typing import Any

import gymnasium as gym
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from common import RESULTS, ROOT, stored

from frobs_train import evaluate, resolve_config, train

PAGE = ROOT / "docs" / "explanation" / "neighbours-measured.md"
BUILD = ROOT / "build" / "benchmarks" / "neighbours"
KEPT = RESULTS / "neighbours"
SCRIPT = Path(__file__).with_name("neighbour_panda_gym.py")
SPEED_SCRIPT = Path(__file__).with_name("neighbour_speed.py")
REQUIREMENTS = {
    "panda-gym": (
        "panda-gym==3.0.7",
        "gymnasium==0.29.1",
        "stable-baselines3==2.3.2",
        "sb3-contrib==2.3.0",
        "numpy==1.26.4",
        "torch==2.13.0",
    ),
    "Gymnasium-Robotics": ("gymnasium-robotics==1.4.2", "mujoco==3.3.7", "numpy==1.26.4"),
    "robosuite": ("robosuite==1.5.2", "mujoco==3.3.7", "numpy==1.26.4"),
}
"""Distributions to install, by framework."""
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


@dataclass(frozen=True)
class Pair:
    """A task with a cube and a sparse reward in both frameworks.

    Attributes:
        title: Name of the task on the page.
        theirs: ID in panda-gym.
        ours: Training run of FRobs.
    """

    title: str
    theirs: str
    ours: Ours


PAIRS = {
    "push": Pair(
        "Push",
        "PandaPush-v3",
        Ours("FRobs, PandaPushGoal-v0", "frobs/PandaPushGoal-v0", {"algorithm": "sbx_sac"}, 50_000),
    ),
    "pick_and_place": Pair(
        "Pick and place",
        "PandaPickAndPlace-v3",
        Ours("FRobs, PandaPickAndPlaceGoal-v0", "frobs/PandaPickAndPlaceGoal-v0", {"algorithm": "sbx_ppo"}, 75_000),
    ),
}
SIDES = ("panda-gym", "FRobs")
LONGEST = 1800.0
"""Longest training time of a task with a cube [s]."""
OUR_IDS = ("frobs/PandaPush-v0", "frobs/PandaLift-v0", "frobs/PandaPickAndPlace-v0")
MANY = 1024
"""IDs and number of environments whose steps per second are measured."""
MINUTES = (5, 10, 15, 20, 25, 30)
"""Training times at which the page shows the success of the last evaluation [min]."""


def measure_ours(
    case: Ours, seed: int, episodes: int = EPISODES, limit: float = LONGEST, steps: int | None = None
) -> dict[str, Any]:
    """Train with a checkpoint at each evaluation point, and evaluate the checkpoints afterwards.

    Args:
        case: Training run.
        seed: Seed of training.
        episodes: Number of episodes per evaluation.
        limit: Maximum training time [s].
        steps: Maximum number of training steps; None: the tuned number.

    Returns:
        ``name``, ``seed`` and ``moments``: for each checkpoint ``steps``, ``seconds`` of training and ``success``.
    """
    run_dir = BUILD / "run"
    shutil.rmtree(run_dir, ignore_errors=True)
    flags = {**case.flags, "seed": seed, "steps": steps}
    settings = [f"checkpoint_every={case.every}", "keep_checkpoints=1000", f"log_every={case.every}"]
    config = resolve_config(case.id, flags=flags, settings=settings)
    run = train(config, run_dir, on_progress=lambda progress: progress.elapsed < limit)
    with (run_dir / "progress.csv").open(newline="", encoding="utf-8") as file:
        elapsed = {int(float(row["train/steps"])): float(row["time/elapsed"]) for row in csv.DictReader(file)}
    moments = []
    for checkpoint in run.checkpoints:
        found = evaluate(run, episodes, checkpoint=checkpoint.steps)
        seconds = next(at for steps_, at in sorted(elapsed.items()) if steps_ >= checkpoint.steps)
        moments.append({"steps": checkpoint.steps, "seconds": seconds, "success": float(found.success_rate or 0.0)})
        if moments[-1]["success"] >= max(THRESHOLDS):
            break
    return {"name": case.name, "seed": seed, "moments": moments}


def measure_theirs(
    id: str, seed: int, episodes: int = EPISODES, limit: float = LONGEST, python: Path | None = None
) -> dict[str, Any]:
    """Train one of panda-gym's environments with hindsight replay, in panda-gym's own virtual environment.

    Args:
        id: ID in panda-gym.
        seed: Seed of training.
        episodes: Number of episodes per evaluation.
        limit: Maximum training time [s].
        python: Interpreter of that virtual environment; None: create the environment.

    Returns:
        The same keys as :func:`measure_ours`.
    """
    command = [python or neighbours_python(), SCRIPT, id, seed, episodes, max(THRESHOLDS), limit]
    done = subprocess.run([str(each) for each in command], check=True, text=True, stdout=subprocess.PIPE)
    return {"name": f"panda-gym, {id}", "seed": seed, "moments": json.loads(done.stdout.splitlines()[-1])}


def neighbours_python(framework: str = "panda-gym") -> Path:
    """Return the interpreter of a framework's virtual environment, which is created if it does not exist."""
    folder, requirements = BUILD / f"venv-{framework.lower()}", REQUIREMENTS[framework]
    python = folder / "bin" / "python"
    ready = folder / "ready"
    if not ready.is_file() or ready.read_text("utf-8") != "\n".join(requirements):
        venv.create(folder, with_pip=True, clear=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", *requirements], check=True)
        ready.write_text("\n".join(requirements), "utf-8")
    return python


def their_speeds(seconds: float = 10.0) -> dict[str, float]:
    """Return the control steps per second of other frameworks' environments, by ``"framework, ID"``."""
    found: dict[str, float] = {}
    for framework in REQUIREMENTS:
        command = [str(neighbours_python(framework)), str(SPEED_SCRIPT), framework, str(seconds)]
        done = subprocess.run(command, check=True, text=True, stdout=subprocess.PIPE)
        speeds = json.loads(done.stdout.splitlines()[-1])
        found |= {f"{framework}, {name}": speed for name, speed in speeds.items()}
    return found


def our_speeds(seconds: float = 10.0) -> dict[str, float]:
    """Return the control steps per second of FRobs's environments: one, and many together, with random actions."""
    found = {}
    for id in OUR_IDS:
        for num_envs in (1, MANY):
            env = gym.make_vec(f"frobs_core:{id}", num_envs=num_envs, vectorization_mode="vector_entry_point")
            rng, spent, steps = np.random.default_rng(0), 0.0, 0
            env.reset(seed=0)
            while spent < seconds:
                action = rng.uniform(-1.0, 1.0, env.action_space.shape or ())
                start = time.perf_counter()
                env.step(action)
                spent += time.perf_counter() - start
                steps += num_envs
            env.close()
            found[f"FRobs, {id}, {'one environment' if num_envs == 1 else f'{num_envs:,} environments'}"] = (
                steps / spent
            )
    return found


def reached(row: Mapping[str, Any], threshold: float) -> float:
    """Return the seconds of training until the first evaluation that reached the threshold, or infinity."""
    return next((moment["seconds"] for moment in row["moments"] if moment["success"] >= threshold), math.inf)


def by_minute(row: Mapping[str, Any], minute: float) -> float | None:
    """Return the success of the last evaluation after at most ``minute`` minutes of training, or None if none."""
    found = [moment["success"] for moment in row["moments"] if moment["seconds"] <= 60.0 * minute]
    return found[-1] if found else None


def report(
    rows: Sequence[Mapping[str, Any]],
    pairs: Mapping[str, Sequence[Mapping[str, Any]]],
    speeds: Mapping[str, float],
    episodes: int,
) -> str:
    """Return the page.

    Args:
        rows: Results of reaching.
        pairs: Results of both sides for each task in :data:`PAIRS`.
        speeds: Control steps per second, by candidate.
        episodes: Number of episodes per evaluation.
    """
    names = list(dict.fromkeys(row["name"] for row in rows))
    seeds = sorted({row["seed"] for row in rows})
    measured = [*rows, *(row for both in pairs.values() for row in both)]
    machines, commits = (sorted({row[key] for row in measured}) for key in ("machine", "commit"))
    lines = [
        "# Benchmarks: comparison with panda-gym",
        "",
        f"Written by `tests/benchmarks/neighbours.py` on {date.today():%d %B %Y}. Machine: {'; '.join(machines)}. Commit: "
        f"{', '.join(commits)}. The candidates were trained one after another. Training times include compilation, but neither "
        "imports nor evaluations.",
        "",
        "## Reach",
        "",
        f"The table shows the training time until an evaluation on {episodes} new goals first reaches the success rate.",
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
    for name, both in pairs.items():
        lines += ["", f"## {PAIRS[name].title}", "", *_curves(both)]
    if pairs:
        lines += ["", *_differences(episodes)]
    lines += [
        "",
        "## Steps per second",
        "",
        "Control steps per second with random actions and without cameras, one candidate after another. robosuite's control step "
        "is 50 ms, and that of all others is 40 ms. Resets of the other frameworks are not included, and those of FRobs are.",
        "",
        "| | steps per second |",
        "|---|---:|",
        *(f"| {name} | {speed:,.0f} |" for name, speed in speeds.items()),
    ]
    return "\n".join(lines) + "\n"


def _curves(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the table of the success rate over the training time of a task with a cube."""
    lines = [
        "| | " + " | ".join(f"{minute} min" for minute in MINUTES) + " | steps | trained for |",
        "|---|" + "---:|" * (len(MINUTES) + 2),
    ]
    for row in rows:
        last = row["moments"][-1]
        cells = ["–" if (found := by_minute(row, minute)) is None else f"{found:.0%}" for minute in MINUTES]
        lines.append(f"| {row['name']} | {' | '.join(cells)} | {last['steps']:,} | {last['seconds'] / 60:.0f} min |")
    return lines


def _differences(episodes: int) -> list[str]:
    """Return the text about the tasks with a cube."""
    algorithms = " and ".join(f"`{pair.ours.flags['algorithm']}` ({pair.title.lower()})" for pair in PAIRS.values())
    return [
        "## Conditions of pushing, picking and placing",
        "",
        f"The tables show the success rate of the last evaluation, of {episodes} new episodes, after at most the given training "
        f"time. A training run ends at {max(THRESHOLDS):.0%} success or after {LONGEST / 60:.0f} minutes. Each row is one seed.",
        "",
        "Both frameworks use the Panda, a 4 cm cube, tool actions of up to 5 cm, cubes and goals in a square of 30 cm, the "
        "tolerance of 5 cm and the sparse reward. When picking and placing, 70 % of the goals are up to 20 cm above the floor.",
        "",
        "| | panda-gym | FRobs |",
        "|---|---|---|",
        "| engine | PyBullet, one environment | MuJoCo, many environments |",
        "| success | within the tolerance once, which ends the episode | within the tolerance during the last 5 steps |",
        "| length of an episode | 50 steps | 100 steps (push), 50 steps (pick and place) |",
        f"| algorithm | TQC with rl-baselines3-zoo's settings (PyTorch) | {algorithms}, in JAX |",
        "| how sparse rewards are handled | hindsight experience replay | half of the training steps are in episodes that begin "
        "on the path of the task's scripted expert (`reset_from`); push: also hindsight experience replay |",
    ]


def _time(seconds: float) -> str:
    return "never" if math.isinf(seconds) else f"{seconds:.1f} s" if seconds < 20 else f"{seconds:.0f} s"


def main() -> None:
    """Measure, and write the page if everything was measured."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2], help="seeds of reaching")
    parser.add_argument("--episodes", type=int, default=EPISODES, help="episodes per evaluation")
    parser.add_argument("--only", choices=PAIRS, help="measure only this task with a cube; writes no page")
    parser.add_argument("--side", choices=SIDES, help="with --only: measure only this framework")
    given = parser.parse_args()
    python = neighbours_python()

    def pair(name: str, side: str) -> dict[str, Any]:
        task = PAIRS[name]
        if side == "FRobs":
            return stored(KEPT / f"{name}-frobs.json", measure_ours, task.ours, 0, given.episodes)
        return stored(KEPT / f"{name}-panda-gym.json", measure_theirs, task.theirs, 0, given.episodes, LONGEST, python)

    if given.only:
        for side in [given.side] if given.side else SIDES:
            sys.stdout.write(f"{json.dumps(pair(given.only, side))}\n")
        return
    rows = []
    for seed in given.seeds:
        theirs = (measure_theirs, "PandaReach-v3", seed, given.episodes, 600.0, python)
        rows.append(stored(KEPT / f"reach-panda-gym-{seed}.json", *theirs))
        for number, case in enumerate(OURS):
            rows.append(stored(KEPT / f"reach-frobs-{number}-{seed}.json", measure_ours, case, seed, given.episodes))
        for row in rows[-1 - len(OURS) :]:
            sys.stderr.write(f"{row['name']}, seed {seed}: {_time(reached(row, max(THRESHOLDS)))}\n")
    pairs = {name: [pair(name, side) for side in SIDES] for name in PAIRS}
    speeds = stored(KEPT / "speeds.json", lambda: {"speeds": {**their_speeds(), **our_speeds()}})["speeds"]
    PAGE.write_text(report(rows, pairs, speeds, given.episodes), "utf-8")


if __name__ == "__main__":
    main()
