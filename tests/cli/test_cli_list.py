from collections.abc import Callable
from typing import Any

import pytest
from typer.testing import Result

from frobs_core import plugins
from frobs_core.plugins.records import KINDS

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


def test_a_simulator_without_its_engine_is_marked(
    frobs: Frobs, facts: Facts, installed: Callable[[str, str], None]
) -> None:
    installed("frobs-zz-engine", SIMULATOR)
    assert (
        "an engine (the implementation cannot be imported; to install it: pip install zz)"
        in frobs("list", "simulators").stdout
    )
    missing = {row["name"]: row["missing"] for row in facts("list", "simulators")["simulators"]}
    assert missing["zz"] == "the implementation cannot be imported; to install it: pip install zz"
    assert missing["mujoco"] == ""
    [found] = facts("show", "frobs/Irb120Reach-v0")
    [row] = [row for row in found["simulators"] if row["simulator"] == "zz"]
    assert row == {"simulator": "zz", "can_run_it": False, "lacks": missing["zz"]}


SIMULATOR = """
from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.capabilities import CAPABILITIES
from frobs_core.plugins.records import Level
from frobs_core.plugins.records import SimulatorRecord

@hookimpl
def frobs_simulators():
    every = dict.fromkeys(CAPABILITIES, Level.EXACT)
    return [SimulatorRecord(name="zz", summary="an engine", entry_point="zz_engine:Zz", install_hint="pip install zz",
                            capabilities=every)]
"""

ROBOT = """
from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import RobotRecord

@hookimpl
def frobs_robots():
    return [RobotRecord(name="irb120", summary="another", entry_point="nowhere:ROBOT")]
"""
