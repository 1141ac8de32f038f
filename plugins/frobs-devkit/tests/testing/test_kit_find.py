"""What a word means to ``frobs check``."""

from __future__ import annotations

from typing import Any

import pytest

from frobs_core.util.errors import AmbiguousNameError, UnknownNameError
from frobs_devkit.testing import Inconclusive, find_subject


@pytest.mark.parametrize(
    ("word", "kind", "name"),
    [
        ("frobs/Irb120Reach-v0", "environment", "frobs/Irb120Reach-v0"),
        ("frobs_core:frobs/Irb120Reach-v0", "environment", "frobs_core:frobs/Irb120Reach-v0"),
        ("CartPole-v1", "environment", "CartPole-v1"),
        ("irb120", "robot", "irb120"),
        ("robot:irb120", "robot", "irb120"),
        ("robot:frobs-robots-abb:irb120", "robot", "frobs-robots-abb:irb120"),
        ("reach", "task", "reach"),
        ("mujoco", "simulator", "mujoco"),
        ("robots_abb", "plugin", "frobs-robots-abb:robots_abb"),
        ("plugin:frobs-robots-abb:robots_abb", "plugin", "frobs-robots-abb:robots_abb"),
        ("frobs_robots_ABB", "distribution", "frobs_robots_ABB"),
    ],
)
def test_a_word_means_one_thing(word: str, kind: str, name: str) -> None:
    found = find_subject(word)
    assert (found.kind, found.name) == (kind, name)
    assert find_subject(found.word) == found


def test_a_word_that_means_two_things_is_refused_with_the_ways(isolated_plugins: Any, monkeypatch: Any) -> None:
    import sys
    from types import ModuleType

    from frobs_core.plugins.hooks import hookimpl
    from frobs_core.plugins.records import RobotRecord

    module = ModuleType("kit_twofold")

    @hookimpl
    def frobs_robots() -> list[RobotRecord]:
        return [RobotRecord(name="reach", summary="s", entry_point="a:B")]

    module.frobs_robots = frobs_robots  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "kit_twofold", module)
    isolated_plugins(installed=True, kit="kit_twofold")
    with pytest.raises(AmbiguousNameError, match="request 'robot:reach' or 'task:reach'"):
        find_subject("reach")


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("irb_120", "Did you mean 'irb120'"),
        ("robot:irb12", "no robot is named 'irb12'. Did you mean 'irb120'"),
        ("plugin:robots", "no plugin is named"),
    ],
)
def test_a_word_that_means_nothing_gets_the_nearest(word: str, told: str) -> None:
    with pytest.raises(UnknownNameError) as raised:
        find_subject(word)
    assert told in str(raised.value)


def test_a_plugin_is_checked_with_its_parts_and_ids() -> None:
    names = [check.name for check in find_subject("tasks_reach").checks()]
    assert names[0] == "loads"
    assert "task:reach.record_is_sound" in names
    assert "task:reach.spaces_hold" not in names  # its ID has it
    assert "task:reach_together.robot_is_given" in names  # it has no ID, which would name a robot
    assert "frobs/Irb120Reach-v0.spaces_hold" in names
    assert len(names) == len(set(names))


def test_a_distribution_is_all_of_its_plugins() -> None:
    names = [check.name for check in find_subject("frobs-controllers").checks(simulator="mujoco")]
    assert "controllers.loads" in names
    assert "controllers.controller:joint_position.actions_matter" in names


def test_an_id_for_any_robot_wants_one() -> None:
    (check,) = find_subject("frobs/Reach-v0").checks()
    with pytest.raises(Inconclusive, match="--robot"):
        check.run()
    assert len(find_subject("frobs/Reach-v0").checks(robot="irb120")) > 20


def test_a_simulator_claims_its_capabilities() -> None:
    assert find_subject("mujoco").claims["drive"] == "exact"
    assert find_subject("irb120").claims == {}
