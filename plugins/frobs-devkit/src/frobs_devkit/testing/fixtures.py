"""A pytest fixture for tests of plugins.

To use the fixture, add this line to ``conftest.py``::

    pytest_plugins = ["frobs_devkit.testing.fixtures"]
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from importlib.metadata import Distribution, distributions
from os import PathLike
from typing import Protocol

import pytest

from frobs_core import plugins
from frobs_core.plugins import Plugins


class Isolate(Protocol):
    """Type of the function that the ``isolated_plugins`` fixture returns."""

    def __call__(self, *, installed: bool = False, **entry_points: str) -> Plugins:
        """Replace the installed plugins with the given entry points until the test ends.

        Args:
            installed: Whether the installed plugins remain available.
            **entry_points: Module of each entry point by name, such as ``mine="my_package.plugin"``.

        Returns:
            The plugin collection that is now used, in which a broken plugin raises an error.
        """


class _MadeDistribution(Distribution):
    """A distribution for tests, which is not installed but has entry points that refer to importable modules."""

    def __init__(self, entry_points: Mapping[str, str]) -> None:
        lines = "".join(f"{name} = {module}\n" for name, module in entry_points.items())
        self._texts = {
            "METADATA": "Metadata-Version: 2.1\nName: isolated-plugins\nVersion: 0\n",
            "entry_points.txt": f"[frobs]\n{lines}",
        }

    def read_text(self, filename: str) -> str | None:
        return self._texts.get(filename)

    def locate_file(self, path: str | PathLike[str]) -> PathLike[str]:  # type: ignore[override]
        raise FileNotFoundError(path)


@pytest.fixture
def isolated_plugins() -> Iterator[Isolate]:
    """Return a function that replaces the installed plugins with an isolated collection.

    Example::

        def test_my_robot_is_listed(isolated_plugins):
            isolated_plugins(mine="my_package.plugin")
            assert "my_robot" in frobs_core.plugins.records("robot")
    """
    with ExitStack() as stack:

        def isolate(*, installed: bool = False, **entry_points: str) -> Plugins:
            parts = [_MadeDistribution(entry_points), *(distributions() if installed else ())]
            return stack.enter_context(plugins.isolated(Plugins(parts, strict=True, disabled=())))

        yield isolate
