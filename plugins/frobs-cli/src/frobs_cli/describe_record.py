"""Collects the facts that ``frobs show`` prints about a record, from its declaration and its implementation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from frobs_cli.catalogue import Listed, source_of
from frobs_cli.commands import installed_commands
from frobs_cli.describe_robot import describe_robot
from frobs_cli.parameters import parameters
from frobs_core import plugins
from frobs_core.kernel.compose import simulator_defaults
from frobs_core.plugins.capabilities import known_capabilities
from frobs_core.plugins.records import (
    AlgorithmRecord,
    CapabilityRecord,
    ControllerRecord,
    Level,
    ParameterRecord,
    PolicyRecord,
    Record,
    SimulatorRecord,
    TaskRecord,
)
from frobs_core.util.errors import PluginError
from frobs_core.util.validation import plain_settings

Facts = dict[str, Any]


def describe_record(kind: str, record: Record) -> Facts:
    """Return the facts about a record, including ``error`` if the record's implementation cannot be imported."""
    return _describe(kind, record, record.name, source_of(kind, record))


def describe_extension(kind: str, item: Listed) -> Facts:
    """Return the facts about an extension or a command, as for a record."""
    return _describe(kind, item.record, item.name, item.source)


def _describe(kind: str, record: Record, name: str, source: str) -> Facts:
    facts: Facts = {"kind": kind, "name": name, "summary": record.summary, "from": source}
    if record.entry_point:
        facts["entry_point"] = record.entry_point
    declared, implemented = _DESCRIBERS[kind]
    if declared is not None:
        facts |= declared(record, name)
    if implemented is not None:
        try:
            facts |= implemented(record.load())
        except PluginError as error:
            facts["error"] = str(error)
    return facts


def _levels(levels: Mapping[str, Level]) -> dict[str, str]:
    return {capability: str(level) for capability, level in levels.items()}


def _simulator(record: SimulatorRecord, name: str) -> Facts:
    rows = [
        {"capability": name, "level": str(record.capabilities.get(name, Level.UNSUPPORTED)), "help": capability.summary}
        for name, capability in known_capabilities().items()
    ]
    return {"capabilities": rows}


def _controller(record: ControllerRecord, name: str) -> Facts:
    return {"needs": _levels(record.needs)}


def _task(record: TaskRecord, name: str) -> Facts:
    rows = [
        {"id": item.id, "robot": item.robot, "controller": item.controller, "summary": item.summary}
        for item in record.environments
    ]
    return {"arrays": list(record.arrays), "needs": _levels(record.needs), "environments": rows}


def _algorithm(record: AlgorithmRecord, name: str) -> Facts:
    return {
        "action_spaces": list(record.action_spaces),
        "exact_resume": record.exact_resume,
        "reproducible": record.reproducible,
        "tuned_for": sorted(record.tuned),
    }


def simulator_facts(cls: Any) -> Facts:
    """Return the facts about a simulator class, namely the parameters that ``simulator_kwargs`` may contain."""
    accepted = simulator_defaults(cls)
    return {"parameters": [row for row in parameters(cls) if row["name"] in accepted]}


def controller_facts(cls: Any) -> Facts:
    """Return the facts about a controller class: its command mode and its parameters."""
    return {"command": str(getattr(cls, "command_mode", "")), "parameters": parameters(cls)}


def task_facts(cls: Any) -> Facts:
    """Return the facts about a task class: its rewards, reset options, timesteps, instruction, success rule and parameters."""
    return {
        "reward_types": list(cls.reward_types),
        "reset_options": list(cls.reset_options),
        "control_timestep": f"{cls.control_timestep:g} s",
        "physics_timestep": f"{cls.physics_timestep:g} s",
        "instruction": cls.instruction,
        "success": cls.success_rule,
        "reward_terms": [{"name": name, "help": meaning} for name, meaning in cls.reward_meanings.items()],
        "parameters": parameters(cls),
    }


def _algorithm_facts(cls: Any) -> Facts:
    return {"defaults": plain_settings(cls.resolve_config({}))}


def _capability(record: CapabilityRecord, name: str) -> Facts:
    needing = [
        {"kind": kind, "name": other, "level": str(each.needs[name])}
        for kind in ("controller", "task")
        for other, each in plugins.records(kind).items()
        if isinstance(each, ControllerRecord | TaskRecord) and name in each.needs
    ]
    return {"methods": list(record.methods), "simulators": _simulators_with(name), "required_by": needing}


def _parameter(record: ParameterRecord, name: str) -> Facts:
    capability = record.capability
    known = "" if capability in known_capabilities() else f"no installed plugin provides the capability '{capability}'"
    return {"capability": capability, "error": known, "simulators": _simulators_with(capability)}


def _policy(record: PolicyRecord, name: str) -> Facts:
    names = {"/": "folders", "": "all other paths"}
    return {"opens": [names.get(suffix, suffix) for suffix in record.suffixes]} if record.suffixes else {}


def _command(record: Record, name: str) -> Facts:
    return {"heading": installed_commands()[0][name].heading, "usage": f"frobs {name} --help"}


def _sensor_facts(cls: Any) -> Facts:
    return {
        "unit": cls.unit,
        "capability": cls.needs,
        "instrument": cls.instrument,
        "simulators": _simulators_with(cls.needs) if cls.needs else [],
        "parameters": parameters(cls),
    }


def _policy_facts(cls: Any) -> Facts:
    return {"parameters": parameters(cls)}


def _simulators_with(capability: str) -> list[Facts]:
    return [
        {"simulator": name, "level": str(record.capabilities[capability])}
        for name, record in plugins.records("simulator").items()
        if isinstance(record, SimulatorRecord) and record.capabilities.get(capability)
    ]


_Describer = tuple[Callable[[Any, str], Facts] | None, Callable[[Any], Facts] | None]

_DESCRIBERS: Mapping[str, _Describer] = {
    "simulator": (_simulator, simulator_facts),
    "robot": (None, describe_robot),
    "controller": (_controller, controller_facts),
    "task": (_task, task_facts),
    "algorithm": (_algorithm, _algorithm_facts),
    "capability": (_capability, None),
    "sensor_type": (None, _sensor_facts),
    "parameter": (_parameter, None),
    "policy": (_policy, _policy_facts),
    "viewer": (lambda record, name: {"usage": f"render_mode='{name}'"}, None),
    "command": (_command, None),
}
"""Functions that return the facts from the declaration of a record, and those from its implementation, by kind."""
