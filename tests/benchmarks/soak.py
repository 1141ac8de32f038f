"""Measure long-term behavior: ``make soak`` writes ``docs/explanation/soak-measured.md``.

One environment takes a million steps, environments with pictures 100,000, and a thousand environments are created and
closed: memory and file descriptors must not grow. Each manipulation ID takes a million random steps: every divergence must be reported, and no object may
penetrate another by more than 5 mm. Exits with status 1 if a check fails. Other programs on the machine do not affect
the results, which are stored in ``results/soak``, so an interrupted measurement continues where it stopped. ``--fresh``
discards them::

    python tests/benchmarks/soak.py --fresh
    python tests/benchmarks/soak.py --only frobs/PandaStack-v0 --jobs 1
    python tests/benchmarks/soak.py --kept
"""

from __future__ import annotations

import ctypes
import gc
import os
import sys
import threading
from argparse import ArgumentParser
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from datetime import date
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from common import RESULTS, ROOT, manipulation_ids, slug, stored

PAGE = ROOT / "docs" / "explanation" / "soak-measured.md"
KEPT = RESULTS / "soak"
ENVIRONMENT = "frobs/Irb120Reach-v0"
SEEING, SEEING_ENVS = "frobs/PandaPickAndPlaceVision-v0", 50
"""ID with two cameras, and the number of its environments that are stepped together."""

TOTAL = 1_000_000
"""Number of steps of one environment, and number of random steps of each manipulation ID."""

SAMPLES = 20
"""Number of measurements of each part, evenly spaced."""

WARM_UP = 0.1
"""Share of a part during which caches fill; growth is measured afterwards."""

MAX_GROWTH = 4.0
"""Maximum growth after the warm-up [MiB]. Python's allocator alone varies by about one."""

MAX_DEPTH = 0.005
"""Maximum penetration depth of contacts [m]."""

NUM_ENVS = 500
"""Number of environments of a manipulation ID that are stepped together."""

FAR = 5.0
"""Distance from the origin that no object can reach [m]."""

EVERY, LOOKED_AT = 10, 50
"""Contacts are checked in every tenth step, in 50 of the environments."""


@dataclass(frozen=True)
class Sample:
    """State of this process after a number of steps or environments."""

    count: int
    memory: float  # resident [MiB]
    descriptors: int
    threads: int


@dataclass(frozen=True)
class Part:
    """A repeated action, and the measurements during it."""

    title: str
    unit: str
    samples: Sequence[Sample]
    machine: str = ""
    commit: str = ""

    @property
    def growth(self) -> float:
        """Growth of the memory after the warm-up [MiB]."""
        return self.samples[-1].memory - self._warm.memory

    @property
    def constant(self) -> bool:
        """Whether memory, file descriptors and threads are the same as after the warm-up."""
        last, warm = self.samples[-1], self._warm
        same = (last.descriptors, last.threads) == (warm.descriptors, warm.threads)
        return self.growth <= MAX_GROWTH and same

    @property
    def _warm(self) -> Sample:
        return next(item for item in self.samples if item.count >= WARM_UP * self.samples[-1].count)


@dataclass(frozen=True)
class Contacts:
    """Effects of random actions on the objects of an ID."""

    id: str
    steps: int
    reported: int  # number of divergences that info reported
    unreported: int  # number of unreported states that are not finite or far away
    depth: float  # depth of the deepest contact [m]
    bodies: str  # bodies of this contact
    machine: str = ""
    commit: str = ""

    @property
    def sound(self) -> bool:
        """Whether every divergence was reported and no contact was too deep."""
        return self.unreported == 0 and self.depth <= MAX_DEPTH


def sample(count: int) -> Sample:
    """Measure this process, after collecting garbage and returning unused memory to the operating system."""
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
    pages = int(Path("/proc/self/statm").read_text("ascii").split()[1])
    memory = pages * os.sysconf("SC_PAGE_SIZE") / 2**20
    return Sample(count, memory, len(os.listdir("/proc/self/fd")), threading.active_count())


def repeat(total: int, action: Callable[[], object]) -> list[Sample]:
    """Repeat an action ``total`` times, and measure at the start and :data:`SAMPLES` times."""
    found = [sample(0)]
    for number in range(1, total + 1):
        action()
        if number * SAMPLES // total > (number - 1) * SAMPLES // total:
            found.append(sample(number))
            sys.stderr.write(f"{found[-1]}\n")
    return found


def steps(simulator: str, total: int) -> Part:
    """Take random steps in one environment, and start a new episode whenever one ends."""
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


def pictures(total: int) -> Part:
    """Take random steps in environments that observe two cameras, with other looks in each episode."""
    looks = {
        "color": {"target": ["cube", "floor"], "set": [0, 1]},
        "texture": {"set": [0, 64]},
        "distractors": {"set": [0, 8]},
    }
    env = gym.make_vec(f"frobs_core:{SEEING}", num_envs=SEEING_ENVS, randomize=looks)
    env.action_space.seed(0)
    env.reset(seed=0)
    found = repeat(total // SEEING_ENVS, lambda: env.step(env.action_space.sample()))
    env.close()
    counted = [replace(item, count=item.count * SEEING_ENVS) for item in found]
    return Part(f"{total:,} steps of {SEEING_ENVS} environments with pictures on mujoco", "steps", counted)


def lifetimes(simulator: str, total: int) -> Part:
    """Repeatedly create an environment, take a step and close it."""

    def live() -> None:
        env = gym.make(ENVIRONMENT, simulator=simulator, disable_env_checker=True)
        env.reset(seed=0)
        env.step(env.action_space.sample())
        env.close()

    return Part(f"{total:,} environments made and closed on {simulator}", "environments", repeat(total, live))


def contacts(id: str, total: int) -> Contacts:
    """Take random steps with a manipulation ID on MuJoCo and check its contacts."""
    env = gym.make_vec(f"frobs_core:{id}", num_envs=NUM_ENVS, vectorization_mode="vector_entry_point", num_threads=1)
    base: Any = env.unwrapped
    model, batch = base.simulation.model, base.simulation.batch
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    env.reset(seed=0)
    reported, unreported, depth, bodies = 0, 0, 0.0, ""
    for step in range(1, total // NUM_ENVS + 1):
        info = env.step(rng.uniform(-1.0, 1.0, env.action_space.shape))[4]
        final = info.get("final_info", {})
        reported += int(final.get("frobs/diverged", np.zeros(1)).sum())
        lost = ~np.isfinite(batch.state).all(axis=1)
        for body in base.simulation.bodies.values():
            lost |= ~(np.abs(body.pose[0]) < FAR).all(axis=1)
        unreported += int(lost.sum())
        if step % EVERY == 0:
            for row in rng.choice(NUM_ENVS, LOOKED_AT, replace=False):
                mujoco.mj_setState(model, data, batch.state[row], mujoco.mjtState.mjSTATE_INTEGRATION)
                mujoco.mj_fwdPosition(model, data)
                for contact in data.contact:
                    if -contact.dist > depth:
                        names = [model.body(model.geom_bodyid[geom]).name for geom in contact.geom]
                        depth, bodies = -float(contact.dist), " in ".join(names)
    env.close()
    return Contacts(id, total, reported, unreported, depth, bodies)


def stored_contacts(id: str, total: int, kept: Path = KEPT) -> Contacts:
    """Return the stored result of :func:`contacts`, which is measured first if there is none."""
    return Contacts(**stored(kept / f"{slug(id)}.json", lambda: asdict(contacts(id, total))))


def stored_part(name: str, measure: Callable[[], Part], kept: Path = KEPT) -> Part:
    """Return the stored result of a part, which is measured first if there is none."""
    row = stored(kept / f"{name}.json", lambda: asdict(measure()))
    return Part(**{**row, "samples": [Sample(**item) for item in row["samples"]]})


def report(parts: Sequence[Part], touched: Sequence[Contacts] = ()) -> str:
    """Return the page."""
    rows = [*parts, *touched]
    machines, commits = (sorted({getattr(row, key) for row in rows}) for key in ("machine", "commit"))
    lines = [
        "# Benchmarks: memory, file descriptors and contacts",
        "",
        f"Written by `tests/benchmarks/soak.py` on {date.today():%d %B %Y}. Machines: {'; '.join(machines)}. Commits: {', '.join(commits)}. "
        f"The environment of the first parts is `{ENVIRONMENT}`, and `{SEEING}` with pictures, with random actions. Memory is the resident memory of the process, "
        "measured after `malloc_trim` has returned the memory that glibc keeps for later allocations.",
        "",
        f"Caches fill during the first {WARM_UP:.0%} of each part. After that, memory may grow by at most {MAX_GROWTH:g} MiB, and "
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
    if touched:
        lines += [
            "",
            "## Random steps of the manipulation tasks",
            "",
            f"On MuJoCo, {NUM_ENVS} environments together. Divergence is reported in `info`. Values that are not finite, or positions "
            f"farther away than {FAR:g} m, are errors if they are not reported. The contacts of {LOOKED_AT} environments are checked in "
            f"every {EVERY}th step: no body may penetrate another by more than {1000 * MAX_DEPTH:g} mm.",
            "",
            "| ID | steps | divergences, reported | unreported | deepest contact | of | commit |",
            "|---|---:|---:|---:|---:|---|---|",
        ]
        lines += [
            f"| `{item.id}` | {item.steps:,} | {item.reported} | {item.unreported} | {1000 * item.depth:.1f} mm"
            f"{'' if item.sound else ' (**too deep**)'} | `{item.bodies}` | {item.commit} |"
            for item in touched
        ]
        checked = {item.id for item in touched}
        if missing := [id for id in manipulation_ids() if id not in checked]:
            lines += ["", f"Not checked yet: {', '.join(f'`{id}`' for id in missing)}."]
    return "\n".join([*lines, ""])


PARTS = {
    "steps-mujoco": partial(steps, "mujoco", TOTAL),
    "pictures": partial(pictures, 100_000),
    "environments-mujoco": partial(lifetimes, "mujoco", 1_000),
    "environments-pybullet": partial(lifetimes, "pybullet", 1_000),
}
"""Functions that measure memory and file descriptors, by the name of the stored result."""


def main() -> int:
    """Measure, write the page, and return 1 if memory grows or a contact check fails."""
    parser = ArgumentParser(description=__doc__.partition("\n")[0])
    known = manipulation_ids()
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="number of IDs that are checked in parallel")
    parser.add_argument("--only", nargs="+", choices=known, metavar="ID", help="check only the contacts of these IDs")
    parser.add_argument("--fresh", action="store_true", help="discard the stored results")
    parser.add_argument("--kept", action="store_true", help="measure nothing: write the page from the stored results")
    given = parser.parse_args()
    names = [] if given.only else list(PARTS)
    chosen = given.only or known
    if given.fresh:
        for name in [*names, *map(slug, chosen)]:
            (KEPT / f"{name}.json").unlink(missing_ok=True)
    if not given.kept:
        with ProcessPoolExecutor(given.jobs, get_context("spawn")) as pool:
            list(pool.map(partial(stored_contacts, total=TOTAL), chosen))
        for name in names:
            stored_part(name, PARTS[name])
    parts = [stored_part(name, measure) for name, measure in PARTS.items() if (KEPT / f"{name}.json").is_file()]
    touched = [stored_contacts(id, TOTAL) for id in known if (KEPT / f"{slug(id)}.json").is_file()]
    PAGE.write_text(report(parts, touched), encoding="utf-8")
    return 0 if all(part.constant for part in parts) and all(item.sound for item in touched) else 1


if __name__ == "__main__":
    sys.exit(main())
