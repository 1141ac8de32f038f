"""Record the behavior of every environment ID, and compare another version of FRobs with the record, bit for bit.

Record with the old version and compare with the new one, on the same machine with the same versions of the engines::

    python tests/benchmarks/behavior.py record behavior.json
    python tests/benchmarks/behavior.py compare behavior.json

Each case is an ID on a simulator, as a single environment and as a vector of three with same-step autoreset. It takes
300 random actions. After every 50 steps, the record contains a SHA-256 digest of all observations, rewards, ends and
infos so far. The script uses only Gymnasium's interface, so that it works with any version.
"""

from __future__ import annotations

import hashlib
import json
import sys
from argparse import ArgumentParser
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from time import perf_counter
from typing import Any

import gymnasium as gym
import numpy as np

import frobs_core  # noqa: F401 - registers the IDs

STEPS = 300
EVERY = 50
NUM_ENVS = 3
SEED = 7
SIMULATORS = ("mujoco", "pybullet")
LIBRARIES = ("numpy", "gymnasium", "mujoco", "pybullet")


def environment_ids() -> list[str]:
    """Return the IDs of FRobs that have a robot, in alphabetical order."""
    return sorted(id for id, spec in gym.registry.items() if id.startswith("frobs/") and spec.kwargs.get("robot"))


def update(digest: Any, value: Any) -> None:
    """Add a value to a digest: its types, shapes, bytes and dictionary keys."""
    if isinstance(value, Mapping):
        for key in sorted(value):
            digest.update(key.encode())
            update(digest, value[key])
    elif isinstance(value, list | tuple) or (isinstance(value, np.ndarray) and value.dtype == object):
        for item in value:
            update(digest, item)
    else:
        array = np.asarray(value)
        digest.update(f"{array.dtype}{array.shape}".encode())
        digest.update(str(value).encode() if value is None else array.tobytes())


def digests(env: Any, steps: int, autoresets: bool) -> list[str]:
    """Return the digest after every ``EVERY`` of ``steps`` random actions.

    Args:
        env: A single or a vector environment.
        steps: Number of steps, a multiple of ``EVERY``.
        autoresets: Whether the environment starts the next episode itself.
    """
    digest, found = hashlib.sha256(), []
    env.action_space.seed(SEED)
    update(digest, env.reset(seed=SEED))
    for step in range(1, steps + 1):
        observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
        update(digest, (observation, reward, terminated, truncated, info))
        if not autoresets and (terminated or truncated):
            update(digest, env.reset())
        if step % EVERY == 0:
            found.append(digest.hexdigest())
    return found


def record(ids: Sequence[str], simulators: Sequence[str], steps: int = STEPS) -> Iterator[tuple[str, list[str]]]:
    """Yield the name and the digests of each case."""
    for simulator in simulators:
        for id in ids:
            single = gym.make(id, simulator=simulator, disable_env_checker=True)
            vector = gym.make_vec(
                id, NUM_ENVS, vectorization_mode="vector_entry_point", simulator=simulator, num_threads=1
            )
            for kind, env in (("single", single), ("vector", vector)):
                yield f"{id} {simulator} {kind}", digests(env, steps, kind == "vector")
                env.close()


def compare(recorded: Mapping[str, Sequence[str]], found: Mapping[str, Sequence[str]]) -> list[str]:
    """Return a line for each recorded case that is missing or differs.

    Args:
        recorded: Digests by case.
        found: Digests by case; cases that are not recorded are ignored.
    """
    lines = []
    for case, old in recorded.items():
        new = found.get(case)
        if new is None:
            lines.append(f"{case}: missing")
        elif new != old:
            first = next((i for i, pair in enumerate(zip(old, new, strict=False)) if pair[0] != pair[1]), len(new))
            lines.append(f"{case}: differs within steps {first * EVERY + 1} to {(first + 1) * EVERY}")
    return lines


def main(arguments: Sequence[str] | None = None) -> None:
    """Record or compare, and exit with status 1 if anything differs."""
    parser = ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("command", choices=["record", "compare"])
    parser.add_argument("file", type=Path, help="JSON file to write or to compare with")
    parser.add_argument("--only", default="", metavar="TEXT", help="only IDs that contain this text")
    parser.add_argument("--simulator", action="append", choices=SIMULATORS, help="only this simulator")
    options = parser.parse_args(arguments)
    simulators = options.simulator or SIMULATORS
    expected = json.loads(options.file.read_text("utf-8")) if options.command == "compare" else {}
    found: dict[str, list[str]] = {}
    start = perf_counter()
    for case, values in record([id for id in environment_ids() if options.only in id], simulators):
        found[case] = values
        sys.stderr.write(f"{perf_counter() - start:6.0f} s  {case}\n")
    versions = {library: version(library) for library in LIBRARIES}
    if options.command == "record":
        options.file.write_text(json.dumps({"versions": versions, "digests": found}, indent=1) + "\n", "utf-8")
        sys.stdout.write(f"{len(found)} cases of {STEPS} steps are recorded in {options.file}.\n")
        return
    recorded = {
        case: values
        for case, values in expected["digests"].items()
        if options.only in case.split()[0] and case.split()[1] in simulators
    }
    lines = compare(recorded, found)
    if versions != expected["versions"]:
        lines.append(f"recorded with {expected['versions']}, compared with {versions}")
    sys.stdout.write("".join(f"{line}\n" for line in lines))
    sys.stdout.write(f"{len(recorded)} cases of {STEPS} steps: {'different' if lines else 'identical'}.\n")
    sys.exit(bool(lines))


if __name__ == "__main__":
    main()
