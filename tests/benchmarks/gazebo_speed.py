"""Steps per second on a real Gazebo, one environment, 10 physics steps each: ``python tests/benchmarks/gazebo_speed.py``.

Beside the time on the clock stands the processor time of the two threads that take turns, Gazebo's physics and this one's:
on a machine that is busy with other things that is what a step costs.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import gymnasium as gym
import numpy as np

import frobs_core  # noqa: F401 - registers the IDs

STEPS, WARM_UP = 1000, 100


def thread_seconds(pid: int) -> dict[str, float]:
    """Return the processor time of each thread of a process [s]."""
    tasks = Path(f"/proc/{pid}/task")
    return {task: int((tasks / task / "schedstat").read_text().split()[0]) * 1e-9 for task in os.listdir(tasks)}


def main() -> None:
    """Measure and print."""
    env = gym.make("frobs/Irb120Reach-v0", simulator="gazebo", physics_timestep=0.002, control_timestep=0.02)
    env.reset(seed=0)
    env.action_space.seed(0)
    pid = env.unwrapped.simulation.native[0].process.pid
    taken = []
    for k in range(WARM_UP + STEPS):
        if k == WARM_UP:
            theirs, mine = thread_seconds(pid), time.thread_time()
        action = env.action_space.sample()
        start = time.perf_counter()
        _, _, terminated, truncated, _ = env.step(action)
        taken.append(time.perf_counter() - start)
        if terminated or truncated:
            env.reset()
    after = thread_seconds(pid)
    physics = max(after[task] - theirs[task] for task in theirs) / STEPS
    here = (time.thread_time() - mine) / STEPS
    env.close()
    clock = np.array(taken[WARM_UP:])
    sys.stdout.write(
        f"on the clock: {1.0 / clock.mean():.0f} steps/s (95th percentile {1e3 * np.percentile(clock, 95):.1f} ms)\n"
        f"processor time of a step: physics thread {1e3 * physics:.2f} ms, Python {1e3 * here:.2f} ms, "
        f"so at most {1.0 / (physics + here):.0f} steps/s on an idle machine\n"
    )


if __name__ == "__main__":
    main()
