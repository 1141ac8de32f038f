"""``frobs list``, ``show`` and ``check`` with what plugins add to the contracts, and with commands."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import Result

from frobs_cli.catalogue import EXTENSIONS, listed, plural
from frobs_core.plugins.capabilities import CAPABILITIES

Frobs = Callable[..., Result]
Facts = Callable[..., Any]
ACME = Path(__file__).parents[1] / "external_plugins" / "acme-sim-ideal" / "src"


@pytest.fixture
def acme(installed: Callable[[str, str], None], monkeypatch: pytest.MonkeyPatch) -> None:
    """A plugin with a simulator, a capability, a sensor type and a parameter of its own."""
    monkeypatch.syspath_prepend(ACME)
    monkeypatch.delenv("FROBS_DEPRECATIONS")  # it was written for version 0.2
    installed("acme-sim-ideal", (ACME / "acme_sim_ideal" / "plugin.py").read_text())


def test_extensions_of_the_core_and_of_plugins_are_listed_with_their_distribution(facts: Facts, acme: None) -> None:
    found = facts("list")
    rows = {kind: {row["name"]: row["distribution"] for row in found[plural(kind)]} for kind in EXTENSIONS}
    assert rows["capability"] == {**dict.fromkeys(CAPABILITIES, "frobs-core"), "wind": "acme-sim-ideal"}
    assert rows["sensor_type"]["lidar"] == "frobs-core"
    assert rows["sensor_type"]["anemometer"] == "acme-sim-ideal"
    assert rows["parameter"]["mass"] == "frobs-core"
    assert rows["parameter"]["wind_speed"] == "acme-sim-ideal"
    assert rows["command"]["doctor robot"] == "frobs-devkit"


@pytest.mark.parametrize("word", ["capability", "capabilities", "sensor-types", "parameters", "commands"])
def test_each_kind_of_extension_can_be_listed_alone(frobs: Frobs, word: str) -> None:
    result = frobs("list", word)
    assert result.exit_code == 0
    assert len(result.stdout.splitlines()) > 3


@pytest.mark.parametrize("kind", EXTENSIONS)
def test_every_extension_can_be_shown(facts: Facts, acme: None, kind: str) -> None:
    for item in listed(kind):
        [found] = facts("show", f"{kind}:{item.name}")
        assert (found["kind"], found["name"], found["summary"]) == (kind, item.name, item.record.summary)
        assert "error" not in found or not found["error"]


def test_an_extension_of_a_plugin_shows_what_it_needs(facts: Facts, acme: None) -> None:
    simulators = [{"simulator": "ideal", "level": "exact"}]
    [sensor] = facts("show", "anemometer")
    assert (sensor["capability"], sensor["unit"], sensor["simulators"]) == ("wind", "m/s", simulators)
    assert [row["name"] for row in sensor["parameters"] if row["required"]] == ["frame"]
    [parameter] = facts("show", "wind_speed")
    assert (parameter["capability"], parameter["simulators"]) == ("wind", simulators)
    [capability] = facts("show", "wind")
    assert (capability["methods"], capability["simulators"]) == (["wind_velocity"], simulators)


@pytest.mark.parametrize("kind", EXTENSIONS)
def test_an_unknown_extension_names_the_nearest(frobs: Frobs, kind: str) -> None:
    known = listed(kind)[0].name
    for command in ("show", "check"):
        result = frobs(command, f"{kind}:{known}x")
        assert result.exit_code == 2
        assert f"no {kind.replace('_', ' ')} is named '{known}x'. Did you mean '{known}'?" in result.stderr


@pytest.mark.parametrize(
    "word", ["capability:wind", "sensor_type:anemometer", "wind_speed", "command:doctor robot", "capability:rays"]
)
def test_extensions_pass_their_checks(facts: Facts, acme: None, word: str) -> None:
    report = facts("check", word)
    assert {check["status"] for check in report["checks"]} == {"passed"}


def test_a_lidar_is_checked_with_the_fields_that_are_set(frobs: Frobs) -> None:
    fields = ("rays=4", "range_min=0.1", "range_max=5.0")
    result = frobs(
        "check",
        "sensor_type:lidar",
        *(word for field in fields for word in ("--set", f"environment_kwargs.sensors.lidar.{field}")),
    )
    assert result.exit_code == 0, result.stdout
    assert "4 passed" in result.stdout


def test_wrong_extensions_fail_their_checks(frobs: Frobs, installed: Callable[[str, str], None]) -> None:
    installed("acme-wrong", WRONG)
    for word, says in (
        ("capability:tide", "does not implement tide_height()"),
        ("sensor_type:gauge", "type_name of Gauge is 'gage'; it must be 'gauge'"),
        ("parameter:tide_speed", "'moon', which is not a capability: frobs list capabilities"),
    ):
        result = frobs("check", word)
        assert result.exit_code == 1
        assert says in " ".join(result.stdout.split())


def test_a_robot_shows_its_groups_default_controllers_and_end_effectors(facts: Facts) -> None:
    [panda] = facts("show", "panda")
    assert [row["group"] for row in panda["groups"]] == ["arm", "gripper"]
    assert [row["default_controller"] for row in panda["groups"]] == [None, "gripper_delta"]
    [tool] = panda["end_effectors"]
    assert (tool["arm"], tool["fingers"]) == ("arm", "gripper")
    assert set(tool["open"]) == set(tool["closed"]) == {"gripper_finger_joint"}
    [arm] = facts("show", "irb120")
    assert [(row["group"], row["joints"]) for row in arm["groups"]] == [("all", [f"joint_{i}" for i in range(1, 7)])]
    [kobuki] = facts("show", "kobuki")
    assert kobuki["differential_drive"]["wheel_radius"] == 0.035


WRONG = """
from dataclasses import dataclass
from typing import ClassVar

from frobs_core.plugins.records import Level
from frobs_core.plugins.hooks import hookimpl
from frobs_core.description import Sensor
from frobs_core.plugins.records import CapabilityRecord, ParameterRecord, SensorTypeRecord, SimulatorRecord


@dataclass(frozen=True, kw_only=True)
class Gauge(Sensor):
    type_name: ClassVar[str] = "gage"
    instrument: ClassVar[str] = "frobs_core.sensing.sensors.instruments:LidarInstrument"


@hookimpl
def frobs_simulators():
    return [SimulatorRecord(name="sea", summary="a sea", entry_point="frobs_sim_mujoco.simulation:MujocoSimulation",
                            capabilities={"tide": Level.EXACT})]


@hookimpl
def frobs_extensions():
    return [
        CapabilityRecord(name="tide", summary="a tide", methods=("tide_height",)),
        SensorTypeRecord(name="gauge", summary="the height of the sea", entry_point=f"{__name__}:Gauge"),
        ParameterRecord(name="tide_speed", summary="the speed of the tide [m/s]", capability="moon"),
    ]
"""
