from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

import pytest

from frobs_core import plugins
from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import RobotRecord
from frobs_core.util.errors import PluginLoadError


@pytest.fixture
def mine(monkeypatch: pytest.MonkeyPatch) -> str:
    module = ModuleType("kit_mine")

    @hookimpl
    def frobs_robots() -> list[RobotRecord]:
        return [RobotRecord(name="mine", summary="my robot", entry_point="kit_mine:ROBOT")]

    frobs_robots.__module__ = "kit_mine"
    module.frobs_robots = frobs_robots  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "kit_mine", module)
    return "kit_mine"


def test_only_the_given_plugins_are_there(isolated_plugins: Any, mine: str) -> None:
    isolated_plugins(kit=mine)
    assert list(plugins.records("robot")) == ["mine"]
    assert not plugins.records("simulator")


def test_the_installed_ones_may_stay(isolated_plugins: Any, mine: str) -> None:
    isolated_plugins(installed=True, kit=mine)
    assert {"mine", "irb120"} <= plugins.records("robot").keys()


def test_a_broken_plugin_raises(isolated_plugins: Any) -> None:
    isolated_plugins(kit="no_such_module_of_the_kit")
    with pytest.raises(PluginLoadError, match="no_such_module_of_the_kit"):
        plugins.reports()


def test_afterwards_everything_is_as_before() -> None:
    assert "irb120" in plugins.records("robot")
