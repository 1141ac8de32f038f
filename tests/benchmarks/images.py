"""Measure how long a picture takes, on each simulator and next to bare OpenGL: ``docs/explanation/images-measured.md``.

Run the script on an idle machine, for about two minutes::

    python tests/benchmarks/images.py

Exits with status 1 if a goal is missed.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import date
from functools import partial
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from common import ROOT, current_commit, is_shared, machine

from frobs_core import plugins
from frobs_core.plugins.records import Level
from frobs_sim_mujoco.rendering import _flatten_planes

PAGE = ROOT / "docs" / "explanation" / "images-measured.md"
ID, CAMERAS, SIZE = "frobs/PandaPickAndPlace-v0", ("overview", "wrist"), (64, 64)
NUM_ENVS, REPETITIONS = (1, 4, 16, 32, 64), 45
MOST = 1.05
"""Maximum time of a picture, relative to the OpenGL calls for the same scene."""


def started(num_envs: int, simulator: str = "mujoco") -> Any:
    """Return environments in which the arms have moved."""
    env: Any = gym.make_vec(f"frobs_core:{ID}", num_envs=num_envs, simulator=simulator)
    env.reset(seed=0)
    env.action_space.seed(0)
    for _ in range(20):
        env.step(env.action_space.sample())
    return env


def drawn(simulation: Any, **quality: Any) -> float:
    """Return the time of a picture [ms], if each call draws all environments."""
    start = perf_counter()
    for camera in CAMERAS:
        simulation.render(None, camera, SIZE, **quality)
    return 1e3 * (perf_counter() - start) / (len(CAMERAS) * simulation.num_envs)


def bare(simulation: Any) -> float:
    """Return the time of the OpenGL calls for a picture [ms]: drawing a finished scene, and reading its pixels."""
    renderer = simulation._renderer._first
    target = renderer._renderer(SIZE, True)
    pixels, total = np.empty((*SIZE, 3), np.uint8), 0.0
    for env in range(simulation.num_envs):
        renderer._drawn.show(env)
        renderer._model.geom_group[:] = renderer._groups
        for camera in CAMERAS:
            target.update_scene(renderer._drawn.data, camera, renderer._option)
            _flatten_planes(target.scene, renderer._planes)
            target._gl_context.make_current()
            start = perf_counter()
            mujoco.mjr_render(target._rect, target.scene, target._mjr_context)
            mujoco.mjr_readPixels(pixels, None, target._rect, target._mjr_context)
            total += perf_counter() - start
    return 1e3 * total / (len(CAMERAS) * simulation.num_envs)


def medians(*measures: Callable[[], float]) -> list[float]:
    """Return the median of each measure. They alternate, so that a busy moment concerns all of them."""
    for measure in measures:
        measure()  # creates the OpenGL contexts
    return [median(times) for times in zip(*([each() for each in measures] for _ in range(REPETITIONS)), strict=True)]


def rows() -> Iterator[tuple[int, float, float]]:
    """Yield the number of environments, the time of a picture and the time of bare OpenGL [ms]."""
    for num_envs in NUM_ENVS:
        with closing(started(num_envs)) as env:
            simulation = env.unwrapped.simulation
            ours, opengl = medians(partial(drawn, simulation, fast=True), partial(bare, simulation))
            yield num_envs, ours, opengl


def main() -> int:
    """Measure, write the page, and return 1 if a goal is missed."""
    lines = [
        "# Benchmarks: pictures",
        "",
        f"Written by `tests/benchmarks/images.py` on {date.today():%d %B %Y}. Commit: {current_commit()}. Machine: "
        f"{machine()}, without a GPU.{' **Other programs kept the machine busy.**' if is_shared() else ''} Pictures of "
        f"`{ID}` with {' × '.join(map(str, SIZE))} pixels; times are medians of {REPETITIONS} calls that draw both "
        f"cameras, {' and '.join(CAMERAS)}, of all environments.",
        "",
        "On MuJoCo, next to the OpenGL calls alone, which draw the whole scene on one thread, with the "
        f"floor as a box, and read the pixels. At most "
        f"{MOST} times these are wanted:",
        "",
        "| environments | a picture | pictures per second | OpenGL alone | ratio |",
        "|---:|---:|---:|---:|---:|",
    ]
    missed = False
    for num_envs, ours, opengl in rows():
        missed |= ours > MOST * opengl
        note = " (missed)" if ours > MOST * opengl else ""
        lines.append(
            f"| {num_envs} | {ours:.2f} ms | {1e3 / ours:,.0f} | {opengl:.2f} ms | {ours / opengl:.2f}{note} |"
        )
    lines += [
        "",
        "FRobs leaves out shapes that are not in view, and draws many environments on one thread per processor.",
        "",
        "Eight environments, on each simulator:",
        "",
        "| simulator | color | depth | color in full quality |",
        "|---|---:|---:|---:|",
    ]
    for name, record in plugins.records("simulator").items():
        if not record.is_paced and record.capabilities.get("cameras", Level.UNSUPPORTED) != Level.UNSUPPORTED:
            with closing(started(8, name)) as env:
                qualities: tuple[dict[str, Any], ...] = ({"fast": True}, {"fast": True, "modality": "depth"}, {})
                simulation = env.unwrapped.simulation
                times = medians(*(partial(drawn, simulation, **quality) for quality in qualities))
                lines.append(f"| {name} | {' | '.join(f'{each:.1f} ms' for each in times)} |")
    PAGE.write_text("\n".join(lines) + "\n", "utf-8")
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
