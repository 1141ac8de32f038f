from collections.abc import Callable
from typing import Any

import pytest
from typer.testing import Result

from frobs_core import plugins
from frobs_core.specs import KINDS

Frobs = Callable[..., Result]
Facts = Callable[..., Any]


def test_everything_installed_is_listed(frobs: Frobs, facts: Facts) -> None:
    text = frobs("list").stdout
    found = facts("list")
    for kind in KINDS:
        assert [row["name"] for row in found[f"{kind}s"]] == list(plugins.records(kind))
        assert all(name in text for name in plugins.records(kind))
    assert "frobs/Irb120Reach-v0" in text


@pytest.mark.parametrize("word", ["robot", "robots", "Robots"])
def test_a_kind_may_be_singular_or_plural(facts: Facts, word: str) -> None:
    [row] = [row for row in facts("list", word)["robots"] if row["name"] == "irb120"]
    assert row == {
        "name": "irb120",
        "summary": plugins.get_record("robot", "irb120").summary,
        "distribution": "frobs-robots-abb",
        "version": plugins.get_report("robot", "irb120").version,
    }


@pytest.mark.parametrize("word", ["env", "envs", "environments"])
def test_environments_are_listed_with_their_parts(facts: Facts, word: str) -> None:
    [row] = [row for row in facts("list", word)["environments"] if row["id"] == "frobs/Irb120Reach-v0"]
    assert row["task"] == "reach"
    assert row["robot"] == "irb120"
    assert row["controller"] == "joint_delta_position"
    assert row["simulator"] == "mujoco"
    assert row["max_episode_steps"] == 50


def test_a_name_that_two_distributions_offer_is_listed_with_both(
    frobs: Frobs, installed: Callable[[str, str], None]
) -> None:
    installed("frobs-zz-other", ROBOT)
    names = [line.split()[0] for line in frobs("list", "robots").stdout.splitlines()[1:]]
    assert [name for name in names if name.endswith(":irb120")] == ["frobs-robots-abb:irb120", "frobs-zz-other:irb120"]


ROBOT = """
from frobs_core.hookspecs import hookimpl
from frobs_core.specs import RobotRecord

@hookimpl
def frobs_robots():
    return [RobotRecord(name="irb120", summary="another", entry_point="nowhere:ROBOT")]
"""
