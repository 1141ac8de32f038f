"""Collects the facts that ``frobs show`` prints about capabilities, sensor types, parameters, policies and commands."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, cast

from frobs_cli.catalogue import Listed
from frobs_cli.commands import installed_commands
from frobs_cli.parameters import parameters
from frobs_core import plugins
from frobs_core.description import Sensor
from frobs_core.plugins.capabilities import known_capabilities
from frobs_core.plugins.records import (
    CapabilityRecord,
    ControllerRecord,
    ParameterRecord,
    PolicyRecord,
    SimulatorRecord,
    TaskRecord,
)
from frobs_core.util.errors import PluginError


def describe_extension(kind: str, item: Listed) -> dict[str, Any]:
    """Return the facts about an extension, including ``error`` if its implementation cannot be imported."""
    facts = {"kind": kind, "name": item.name, "summary": item.record.summary, "from": item.source}
    if item.record.entry_point:
        facts["entry_point"] = item.record.entry_point
    return facts | _DESCRIBERS[kind](item)


def _capability(item: Listed) -> dict[str, Any]:
    needing = [
        {"kind": kind, "name": name, "level": str(record.needs[item.name])}
        for kind in ("controller", "task")
        for name, record in plugins.records(kind).items()
        if isinstance(record, ControllerRecord | TaskRecord) and item.name in record.needs
    ]
    methods = list(cast("CapabilityRecord", item.record).methods)
    return {"methods": methods, "simulators": _simulators_with(item.name), "required_by": needing}


def _sensor_type(item: Listed) -> dict[str, Any]:
    try:
        cls: type[Sensor] = item.record.load()
    except PluginError as error:
        return {"error": str(error)}
    return {
        "unit": cls.unit,
        "capability": cls.needs,
        "instrument": cls.instrument,
        "simulators": _simulators_with(cls.needs) if cls.needs else [],
        "parameters": parameters(cls),
    }


def _parameter(item: Listed) -> dict[str, Any]:
    capability = cast("ParameterRecord", item.record).capability
    known = "" if capability in known_capabilities() else f"no installed plugin provides the capability '{capability}'"
    return {"capability": capability, "error": known, "simulators": _simulators_with(capability)}


def _policy(item: Listed) -> dict[str, Any]:
    suffixes = cast("PolicyRecord", item.record).suffixes
    names = {"/": "folders", "": "all other paths"}
    facts: dict[str, Any] = {"opens": [names.get(suffix, suffix) for suffix in suffixes]} if suffixes else {}
    try:
        return facts | {"parameters": parameters(item.record.load())}
    except PluginError as error:
        return facts | {"error": str(error)}


def _command(item: Listed) -> dict[str, Any]:
    command = installed_commands()[0][item.name]
    return {"heading": command.heading, "usage": f"frobs {item.name} --help"}


def _simulators_with(capability: str) -> list[dict[str, Any]]:
    return [
        {"simulator": name, "level": str(record.capabilities[capability])}
        for name, record in plugins.records("simulator").items()
        if isinstance(record, SimulatorRecord) and record.capabilities.get(capability)
    ]


_DESCRIBERS: Mapping[str, Callable[[Listed], dict[str, Any]]] = {
    "capability": _capability,
    "sensor_type": _sensor_type,
    "parameter": _parameter,
    "policy": _policy,
    "command": _command,
}
