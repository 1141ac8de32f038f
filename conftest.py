"""What all tests share: of many alike, the usual runs take every fourth."""

from __future__ import annotations

from collections import Counter

import pytest

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
