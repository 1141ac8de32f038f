"""What all tests share: a real Gazebo, or the reason why there is none; and of many alike the usual runs take a fourth."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

import pytest

pytest_plugins = ["frobs_devkit.testing.fixtures"]

_EVERY = 4


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that takes all."""
    parser.addoption("--exhaustive", action="store_true", help="run all tests that are marked exhaustive, not a sample")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out three of four of each test function's cases that are marked exhaustive."""
    if config.getoption("--exhaustive"):
        return
    seen: Counter[str] = Counter()
    kept, left = [], []
    for item in items:
        if item.get_closest_marker("exhaustive") is None:
            kept.append(item)
            continue
        function = item.nodeid.partition("[")[0]
        (left if seen[function] % _EVERY else kept).append(item)
        seen[function] += 1
    if left:
        config.hook.pytest_deselected(items=left)
        items[:] = kept


@pytest.fixture(scope="session")
def real_gazebo() -> Any:
    """Return a real Gazebo 11; skip without one, and fail where FROBS_REQUIRE_GAZEBO=1 says that one must be here."""
    from frobs_core.errors import SimulationError

    installation = pytest.importorskip("frobs_sim_gazebo.installation", reason="frobs-sim-gazebo is not installed")
    try:
        return installation.find_gazebo()
    except SimulationError as error:
        if os.environ.get("FROBS_REQUIRE_GAZEBO") == "1":
            pytest.fail(f"FROBS_REQUIRE_GAZEBO=1, and {error}", pytrace=False)
        pytest.skip(str(error))


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
