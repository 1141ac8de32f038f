"""Measure the time of an observed image of 84 x 84 pixels on each simulator: ``python tests/benchmarks/images.py``."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from time import perf_counter, process_time
from typing import Any

import gymnasium as gym

from frobs_core import plugins
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.plugins.records import Level

SIZE = (84, 84)
BUDGET = 5.0
"""Maximum time of an RGB image with software OpenGL [ms]."""


def measure(env: RobotVectorEnv, repetitions: int, **options: Any) -> tuple[float, float]:
    """Return wall time and processor time per image [ms], if each call draws all environments."""
    draw, images = env.simulation.render, repetitions * env.num_envs
    draw(size=SIZE, **options)  # creates the OpenGL context
    wall, processor = perf_counter(), process_time()
    for _ in range(repetitions):
        draw(size=SIZE, **options)
    return 1e3 * (perf_counter() - wall) / images, 1e3 * (process_time() - processor) / images


def main() -> None:
    """Measure, and print a table."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--id", default="frobs/Irb120Reach-v0", help="environment ID")
    parser.add_argument("--num-envs", type=int, default=8, help="environments per call")
    parser.add_argument("--repetitions", type=int, default=20, help="number of timed calls")
    options = parser.parse_args()
    sys.stdout.write("| simulator | image | wall time [ms] | processor time [ms] |\n|---|---|---|---|\n")
    for name, record in plugins.records("simulator").items():
        if record.capabilities.get("cameras", Level.UNSUPPORTED) == Level.UNSUPPORTED:
            continue
        env = gym.make_vec(f"frobs_core:{options.id}", num_envs=options.num_envs, simulator=name).unwrapped
        env.reset(seed=0)
        for image, keywords in (
            ("RGB", {"fast": True}),
            ("RGB, full quality", {}),
            ("depth", {"modality": "depth", "fast": True}),
        ):
            wall, processor = measure(env, options.repetitions, **keywords)
            sys.stdout.write(f"| {name} | {image} | {wall:.1f} | {processor:.1f} |\n")
        env.close()


if __name__ == "__main__":
    main()
