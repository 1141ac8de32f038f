"""What all tests share: the sample of slow tests, a real Gazebo, and environments that are closed at the end."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any
from zlib import crc32

import pytest
from hypothesis import HealthCheck, settings

sys.path.insert(0, str(Path(__file__).parent / "tests"))
pytest_plugins = ["frobs_devkit.testing.fixtures", "optional_parts", "ros_graph"]

# Threads of PyTorch and NumPy wait actively for each other: with other tests on the same cores, one is much faster. This is
# also for the processes that tests start.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# What version 0.3 deprecates is an error in our own tests, like every other warning.
os.environ.setdefault("FROBS_DEPRECATIONS", "error")

# JAX compiles the same networks in many tests and in the processes that tests start. With a limit of the size, the cache is
# locked, so that processes can share it.
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(Path(__file__).parent / ".pytest_cache" / "jax"))
os.environ.setdefault("JAX_COMPILATION_CACHE_MAX_SIZE", str(10**9))
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.1")

# On a loaded machine generating an example may take long.
settings.register_profile("frobs", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("frobs")

SAMPLES = 8
"""A sample contains one in this many slow cases of a test function, unless the mark ``slow`` has another ``every``."""

_SAMPLE = pytest.StashKey[int]()


def choose_sample(environment: Mapping[str, str], commit: str) -> int:
    """Return the number of the sample, in [0, 8).

    Args:
        environment: Environment variables; ``FROBS_SAMPLE`` has priority over the commit.
        commit: Hexadecimal hash of the checked-out commit; empty without Git.

    Raises:
        pytest.UsageError: ``FROBS_SAMPLE`` is not an integer in [0, 8).
    """
    value = environment.get("FROBS_SAMPLE", "")
    if not value:
        return int(commit[:8] or "0", 16) % SAMPLES
    if value not in map(str, range(SAMPLES)):
        raise pytest.UsageError(f"FROBS_SAMPLE is '{value}'; use an integer from 0 to {SAMPLES - 1}")
    return int(value)


def is_sampled(function: str, index: int, sample: int, every: int = SAMPLES) -> bool:
    """Return whether a sample contains the case ``index`` (0-based) of a test function: one in ``every``.

    The first cases of the test functions are distributed over the samples, because many functions have a single case.
    """
    return (crc32(function.encode()) + index + sample) % every == 0


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add ``--exhaustive``."""
    parser.addoption("--exhaustive", action="store_true", help="run all slow tests instead of a sample")


def pytest_configure(config: pytest.Config) -> None:
    """Choose the sample; workers of pytest-xdist use the sample of their controller."""
    workerinput = getattr(config, "workerinput", None)
    if workerinput is None:
        config.stash[_SAMPLE] = choose_sample(os.environ, _read_commit(config.rootpath))
    else:
        config.stash[_SAMPLE] = workerinput["frobs_sample"]


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Send the sample to a worker of pytest-xdist."""
    node.workerinput["frobs_sample"] = node.config.stash[_SAMPLE]


def pytest_report_header(config: pytest.Config) -> str | None:
    """Print the sample and how to repeat it."""
    if config.getoption("--exhaustive"):
        return None
    sample = config.stash[_SAMPLE]
    return f"sample {sample + 1} of {SAMPLES} of slow tests; FROBS_SAMPLE={sample} repeats it, --exhaustive runs all"


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect the slow cases of each test function that are not in the sample, unless tests are named one by one."""
    if config.getoption("--exhaustive") or any("::" in arg for arg in config.args):
        return
    seen: Counter[str] = Counter()
    selected, deselected = [], []
    for item in items:
        slow = item.get_closest_marker("slow")
        every = slow.kwargs.get("every", SAMPLES) if slow else 1
        function = item.nodeid.partition("[")[0]
        (selected if is_sampled(function, seen[function], config.stash[_SAMPLE], every) else deselected).append(item)
        seen[function] += 1
    if deselected:
        config.hook.pytest_deselected(items=deselected)
        items[:] = selected


def _read_commit(folder: Path) -> str:
    """Return the hash of the checked-out commit; empty outside a Git repository or without Git."""
    try:
        done = subprocess.run(["git", "rev-parse", "HEAD"], cwd=folder, text=True, capture_output=True)
    except OSError:
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


@pytest.fixture(scope="session")
def real_gazebo() -> Any:
    """Return a real Gazebo 11."""
    from frobs_sim_gazebo.installation import find_gazebo

    return find_gazebo()


@pytest.fixture
def make() -> Iterator[Callable[..., Any]]:
    """Make environments and close them at the end: with ``num_envs`` a native vector environment, else a single one."""
    import gymnasium as gym

    import frobs_core  # noqa: F401 - registers the IDs

    made: list[Any] = []

    def build(id: str, num_envs: int | None = None, **parameters: Any) -> Any:
        if num_envs is None:
            made.append(gym.make(id, **parameters))
        else:
            made.append(gym.make_vec(id, num_envs=num_envs, vectorization_mode="vector_entry_point", **parameters))
        return made[-1]

    yield build
    for env in made:
        env.close()
