"""Measure memory and file descriptors over a long time: ``make soak`` writes ``docs/explanation/soak-measured.md``.

One environment takes a million steps, and environments are made and closed a thousand times. Exits with status 1 if memory
or file descriptors grow. Other programs on the machine do not affect the result::

    python tests/benchmarks/soak.py
    python tests/benchmarks/soak.py --simulators mujoco pybullet --environments 200
"""

from __future__ import annotations

import ctypes
import gc
import os
import sys
import threading
from argparse import ArgumentParser
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import gymnasium as gym

import frobs_core  # noqa: F401  # registers the IDs

sys.path.insert(0, str(Path(__file__).parent))

from tasks import ROOT, current_commit, machine

PAGE = ROOT / "docs" / "explanation" / "soak-measured.md"
ENVIRONMENT = "frobs/Irb120Reach-v0"
SAMPLES = 20
"""Measurements of each part, evenly spaced."""

WARM_UP = 0.1
"""Share of a part in which caches fill; growth is counted after it."""

MAX_GROWTH = 4.0
"""[MiB] allowed after the warm-up. Python's allocator alone moves by about one."""


@dataclass(frozen=True)
class Sample:
    """State of this process after so many steps or environments."""

    count: int
    memory: float  # [MiB] resident
    descriptors: int
    threads: int


@dataclass(frozen=True)
class Part:
    """What was repeated, and what was measured meanwhile."""

    title: str
    unit: str
    samples: Sequence[Sample]

    @property
    def growth(self) -> float:
        """Growth of the memory after the warm-up [MiB]."""
        return self.samples[-1].memory - self._warm.memory

    @property
    def constant(self) -> bool:
        """Whether memory, file descriptors and threads are as after the warm-up."""
        last, warm = self.samples[-1], self._warm
        same = (last.descriptors, last.threads) == (warm.descriptors, warm.threads)
        return self.growth <= MAX_GROWTH and same

    @property
    def _warm(self) -> Sample:
        return next(item for item in self.samples if item.count >= WARM_UP * self.samples[-1].count)


def sample(count: int) -> Sample:
    """Measure this process, after garbage is collected and glibc has returned the memory that it keeps for later."""
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
    pages = int(Path("/proc/self/statm").read_text("ascii").split()[1])
    memory = pages * os.sysconf("SC_PAGE_SIZE") / 2**20
    return Sample(count, memory, len(os.listdir("/proc/self/fd")), threading.active_count())


def repeat(total: int, action: Callable[[], object]) -> list[Sample]:
    """Do something so many times, and measure at the start and :data:`SAMPLES` times."""
    found = [sample(0)]
    for number in range(1, total + 1):
        action()
        if number * SAMPLES // total > (number - 1) * SAMPLES // total:
            found.append(sample(number))
            sys.stderr.write(f"{found[-1]}\n")
    return found


def steps(simulator: str, total: int) -> Part:
    """Take steps with random actions in one environment, and begin a new episode whenever one ends."""
    env = gym.make(ENVIRONMENT, simulator=simulator, disable_env_checker=True)
    env.action_space.seed(0)
    env.reset(seed=0)

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        if terminated or truncated:
            env.reset()

    found = repeat(total, step)
    env.close()
    return Part(f"{total:,} steps of one environment on {simulator}", "steps", found)


def lifetimes(simulator: str, total: int) -> Part:
    """Make an environment, take a step and close it, again and again."""

    def live() -> None:
        env = gym.make(ENVIRONMENT, simulator=simulator, disable_env_checker=True)
        env.reset(seed=0)
        env.step(env.action_space.sample())
        env.close()

    return Part(f"{total:,} environments made and closed on {simulator}", "environments", repeat(total, live))


def report(parts: Sequence[Part]) -> str:
    """Return the page."""
    lines = [
        "# Memory and file descriptors, measured",
        "",
        f"Measured on {date.today():%d %B %Y} by `make soak` on {machine()}, at commit {current_commit()}. "
        f"The environment is `{ENVIRONMENT}` with random actions. Memory is the resident memory of the process, without the "
        "memory that glibc keeps for later allocations (`malloc_trim`).",
        "",
        f"The first {WARM_UP:.0%} of each part fill caches. After that, memory may grow by at most {MAX_GROWTH:g} MiB, and "
        "the numbers of file descriptors and threads must not change.",
    ]
    for part in parts:
        verdict = "constant" if part.constant else "**not constant**"
        lines += [
            "",
            f"## {part.title}",
            "",
            f"Growth after the first {WARM_UP:.0%}: {part.growth:+.2f} MiB ({verdict}).",
            "",
            f"| {part.unit} | memory | file descriptors | threads |",
            "|---:|---:|---:|---:|",
        ]
        lines += [
            f"| {item.count:,} | {item.memory:.1f} MiB | {item.descriptors} | {item.threads} |" for item in part.samples
        ]
    return "\n".join([*lines, ""])


def main() -> int:
    """Measure, write the page, and return 1 if something grows."""
    parser = ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--simulators", nargs="+", default=["mujoco", "pybullet"])
    parser.add_argument("--steps", type=int, default=1_000_000, help="steps of one environment on the first simulator")
    parser.add_argument(
        "--environments", type=int, default=1_000, help="environments made and closed on each simulator"
    )
    parser.add_argument("--out", type=Path, default=PAGE)
    arguments = parser.parse_args()
    parts = [steps(arguments.simulators[0], arguments.steps)]
    parts += [lifetimes(simulator, arguments.environments) for simulator in arguments.simulators]
    arguments.out.write_text(report(parts), encoding="utf-8")
    return 0 if all(part.constant for part in parts) else 1


if __name__ == "__main__":
    sys.exit(main())
