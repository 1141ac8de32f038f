"""Measure the speeds in the documentation: ``make benchmark`` writes ``docs/explanation/performance-measured.md``.

Requires an idle machine. All figures except ratios are times on the machine that the page names.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from argparse import ArgumentParser
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from statistics import median
from typing import Any

from common import ROOT, current_commit, frobs

PAGE = ROOT / "docs" / "explanation" / "performance-measured.md"
ID = "frobs/Irb120Reach-v0"
CONTROLLERS = ("joint_delta_position", "tcp_delta_position")
STEPS = {1: 4000, 1024: 100, 4096: 30}
"""Number of measured steps, by the number of environments."""
BUDGETS: dict[tuple[str, str], dict[int, float]] = {
    (ID, "joint_delta_position"): {1: 1.3, 1024: 1.08, 4096: 1.08},
    (ID, "tcp_delta_position"): {1: 1.5, 1024: 1.08, 4096: 1.08},
    ("arm, gripper and cube", "joint_delta_position, gripper_position"): {1: 1.5, 1024: 1.12},
    ("frobs/PandaPush-v0", "tcp_delta_pose"): {1: 1.5, 1024: 1.12},
    ("frobs/PandaPickAndPlace-v0", "tcp_delta_pose"): {1: 1.5, 1024: 1.12},
    ("frobs/KobukiMaze-v0", "differential_drive"): {1: 1.8, 1024: 1.10},
}
"""Maximum ratio to the bare engine's step time, by environment, controller and number of environments."""
PYBULLET_BUDGET, WORKERS_BUDGET = 1.3, 1.5
PYBULLET_STEPS = 2000
ALGORITHMS = ("ppo", "sbx_ppo", "sac", "sbx_sac", "td3", "sbx_td3")
"""Algorithms whose training run is split into its parts."""
TRAINING_BUDGETS = {"joint_delta_position": 30, "tcp_delta_position": 5}  # [s], median over the seeds

_IMPORT = """
import sys, time
import gymnasium
start = time.perf_counter()
import frobs_core
print(time.perf_counter() - start)
"""
_MEMORY = """
import resource
import gymnasium as gym
gym.make_vec("frobs_core:{id}", {n}, vectorization_mode="vector_entry_point").reset(seed=0)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
"""
_ARM_AND_GRIPPER = """
import json, sys
from dataclasses import asdict
sys.path.insert(0, sys.argv[1])
from arm_and_gripper import ARM, CUBE_TASK, FINGERS
from frobs_devkit.bench import bench
robot = ARM.attach("flange", FINGERS, name="hand")
keywords = dict(task=CUBE_TASK, robot=robot, controller=dict(arm="joint_delta_position"), simulator="mujoco")
print(json.dumps(asdict(bench("frobs/Env-v0", num_envs=int(sys.argv[2]), steps=int(sys.argv[3]), **keywords))))
"""
_WORKERS = """
import sys, time
from statistics import median
import gymnasium as gym
import numpy as np

rounds, num_envs = int(sys.argv[1]), 8
sizes = (1, 2)
envs = [
    gym.make_vec("frobs_core:{id}", num_envs, vectorization_mode="vector_entry_point", simulator="pybullet", num_threads=n)
    for n in sizes
]
for env in envs:
    env.reset(seed=0)
actions = np.random.default_rng(0).uniform(-1.0, 1.0, (10, *envs[0].action_space.shape))
times = dict((n, []) for n in sizes)
for k in range(rounds + 1):  # they take turns; the first warms up
    for n, env in zip(sizes, envs):
        start = time.perf_counter()
        for action in actions:
            env.step(action)
        if k:
            times[n].append((time.perf_counter() - start) / len(actions))
for env in envs:
    env.close()
print(*(median(times[n]) for n in sizes))
"""


def step_costs() -> list[dict[str, Any]]:
    """Return one benchmark for each environment, controller and size, with its budget."""
    rows = []
    for (environment, controller), budgets in BUDGETS.items():
        for n, budget in budgets.items():
            if environment.startswith("frobs/"):
                found = frobs("bench", environment, "--controller", controller, "--num-envs", n, "--steps", STEPS[n])
            else:
                found = json.loads(_python(_ARM_AND_GRIPPER, ROOT / "tests" / "contracts", n, STEPS[n]))
            rows.append({**found, "environment": environment, "controller": controller, "budget": budget})
    return rows


def pybullet_cost() -> dict[str, Any]:
    """Return the benchmark of one environment on PyBullet, next to the bare engine with the same drive law."""
    return frobs("bench", ID, "--simulator", "pybullet", "--steps", PYBULLET_STEPS)


def worker_times(rounds: int = 20) -> tuple[float, float]:
    """Return the step times of eight PyBullet environments [s]: in one process, and in two workers."""
    one, two = _python(_WORKERS.format(id=ID), rounds).split()
    return float(one), float(two)


def trainings(seeds: int) -> list[dict[str, Any]]:
    """Train and evaluate with each controller and seed, each in separate processes."""
    rows = []
    for controller in CONTROLLERS:
        for seed in range(seeds):
            with tempfile.TemporaryDirectory() as folder:
                run = Path(folder) / "run"
                trained = frobs("train", ID, "--controller", controller, "--seed", seed, "--run-dir", run)
                rows.append({"controller": controller, **trained, **frobs("evaluate", run, "--episodes", 1000)})
    return rows


def training_parts(algorithms: Sequence[str] = ALGORITHMS) -> list[dict[str, Any]]:
    """Return the time of each part of a training run, by algorithm."""
    return [frobs("bench", ID, "--training", "--algorithm", name) for name in algorithms]


def import_seconds(repeats: int = 5) -> float:
    """Return the time that ``import frobs_core`` adds to ``import gymnasium`` [s], the median of fresh processes."""
    return median(float(_python(_IMPORT)) for _ in range(repeats))


def memory_bytes() -> float:
    """Return the memory that 4,096 environments need in addition to that of one [bytes]."""
    many, one = (float(_python(_MEMORY.format(id=ID, n=n))) for n in (4096, 1))
    return many - one


def report(
    steps: list[dict[str, Any]],
    trained: list[dict[str, Any]],
    training: list[dict[str, Any]],
    import_time: float,
    memory: float,
    pybullet: dict[str, Any],
    workers: tuple[float, float],
) -> str:
    """Return the page."""
    lines = [
        "# Benchmarks: speed",
        "",
        f"Measured by `make benchmark` on {date.today():%d %B %Y}. Machine: {steps[0]['machine']}. Commit: "
        f"{current_commit()}.",
        "",
        "## A step",
        "",
        'All times are medians. In the "bare engine" measurements, the engine replays the same states with the same controls '
        "and casts the same rays. A "
        "control step of an arm has 20 physics steps of 2 ms, and a control step of the Kobuki has 10 physics steps of 20 ms.",
        "",
        "| environment | controllers | number | step | bare engine | ratio | at most | engine / controller / task / loop / "
        "wrappers |",
        "|---|---|---:|---:|---:|---:|---:|---|",
    ]
    for row in steps:
        parts = " / ".join(_time(seconds) for seconds in row["parts"].values())
        cells = (_time(row["step_seconds"]), _time(row["bare_seconds"]), f"{row['ratio']:.2f}", f"{row['budget']:.2f}")
        names = f"{row['environment']} | {row['controller']}"
        lines.append(f"| {names} | {row['num_envs']:,} | {' | '.join(cells)} | {parts} |")
    lines += [
        "",
        f"`import frobs_core` takes {import_time:.2f} s longer than `import gymnasium` (limit: 0.1 s). 4,096 environments need "
        f"{memory / 1e6:.0f} MB more than one environment (limit: 25 MB).",
        "",
        "## A step on PyBullet",
        "",
        f"A step of one environment takes {_time(pybullet['step_seconds'])}, which is {pybullet['ratio']:.2f} times the "
        f"{_time(pybullet['bare_seconds'])} of a minimal loop over the bare engine with the same drive law (limit: "
        f"{PYBULLET_BUDGET:g}).",
        "",
        f"Eight environments take {_time(workers[0])} in one process and {_time(workers[1])} in two worker processes, which is "
        f"{workers[0] / workers[1]:.2f} times as fast (goal: at least {WORKERS_BUDGET:g}).",
        "",
        "## A training run",
        "",
        "PPO is trained with the tuned settings, in a new process for each seed. The training time excludes imports and "
        "evaluation. Success is the share of 1,000 new goals that the deterministic policy reaches to within 5 cm and holds until "
        "the end of the episode. The worst octant is the octant of the goal box with the lowest success rate.",
        "",
        "| controller | seed | steps | training | success | 95 % interval | worst octant |",
        "|---|---:|---:|---:|---:|---|---:|",
    ]
    for row in trained:
        low, high = row["success_interval"]
        worst = min(octant["success_rate"] for octant in row["success_by_octant"].values())
        lines.append(
            f"| `{row['controller']}` | {row['seed']} | {row['steps']:,} | {row['seconds']:.1f} s | "
            f"{row['success_rate']:.1%} | {low:.1%} to {high:.1%} | {worst:.1%} |"
        )
    lines.append("")
    for controller, budget in TRAINING_BUDGETS.items():
        seconds = median(row["seconds"] for row in trained if row["controller"] == controller)
        lines.append(f"- `{controller}`: median {seconds:.1f} s (at most {budget} s).")
    parts = list(dict.fromkeys(part for row in training for part in row["parts"]))
    lines += [
        "",
        "## The parts of a training run",
        "",
        f"The table shows the time that each part of training takes per 1,000 environment steps, with the tuned settings and "
        f"without compilation, as reported by `frobs bench {ID} --training --algorithm NAME`. The `sbx_` algorithms use JAX; the others use PyTorch.",
        "",
        f"| algorithm | {' | '.join(parts)} | steps per second |",
        f"|---|{'---:|' * (len(parts) + 1)}",
    ]
    for row in training:
        cells = " | ".join(_time(row["parts"][part]) for part in parts)
        lines.append(f"| `{row['algorithm']}` | {cells} | {row['steps_per_second']:,.0f} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5, help="training runs per controller")
    seeds = parser.parse_args().seeds
    trained, training = trainings(seeds), training_parts()
    page = report(step_costs(), trained, training, import_seconds(), memory_bytes(), pybullet_cost(), worker_times())
    PAGE.write_text(page, "utf-8")
    sys.stdout.write(page)


def _python(code: str, *arguments: object) -> str:
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)], check=True, text=True, stdout=subprocess.PIPE
    ).stdout


def _time(seconds: float) -> str:
    if seconds >= 1.0:
        return f"{seconds:.2f} s"
    return f"{1e6 * seconds:.0f} µs" if seconds < 1e-3 else f"{1e3 * seconds:.1f} ms"


if __name__ == "__main__":
    main()
