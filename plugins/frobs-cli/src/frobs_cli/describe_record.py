"""Collects the facts that ``frobs show`` prints about a record, from its declaration and its implementation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from frobs_cli.catalogue import source_of
from frobs_cli.describe_robot import describe_robot
from frobs_cli.parameters import parameters
from frobs_core.kernel.compose import simulator_defaults
from frobs_core.plugins.capabilities import known_capabilities
from frobs_core.plugins.records import AlgorithmRecord, ControllerRecord, Level, Record, SimulatorRecord, TaskRecord
from frobs_core.util.errors import PluginError


def describe_record(kind: str, record: Record) -> dict[str, Any]:
    """Return the facts about a record, including ``error`` if the record's implementation cannot be imported."""
    facts = {
        "kind": kind,
        "name": record.name,
        "summary": record.summary,
        "from": source_of(kind, record),
        "entry_point": record.entry_point,
    }
    declared, implemented = _DESCRIBERS[kind]
    facts |= declared(record)
    try:
        facts |= implemented(record.load())
    except PluginError as error:
        facts["error"] = str(error)
    return facts


def _levels(levels: Mapping[str, Level]) -> dict[str, str]:
    return {capability: str(level) for capability, level in levels.items()}


def _simulator(record: SimulatorRecord) -> dict[str, Any]:
    rows = [
        {"capability": name, "level": str(record.capabilities.get(name, Level.UNSUPPORTED)), "help": capability.summary}
        for name, capability in known_capabilities().items()
    ]
    return {"capabilities": rows}


def _controller(record: ControllerRecord) -> dict[str, Any]:
    return {"needs": _levels(record.needs)}


def _task(record: TaskRecord) -> dict[str, Any]:
    rows = [
        {"id": item.id, "robot": item.robot, "controller": item.controller, "summary": item.summary}
        for item in record.environments
    ]
    return {"arrays": list(record.arrays), "needs": _levels(record.needs), "environments": rows}


def _algorithm(record: AlgorithmRecord) -> dict[str, Any]:
    return {
        "action_spaces": list(record.action_spaces),
        "exact_resume": record.exact_resume,
        "reproducible": record.reproducible,
        "tuned_for": sorted(record.tuned),
    }


def simulator_facts(cls: Any) -> dict[str, Any]:
    """Return the facts about a simulator class, namely the parameters that ``simulator_kwargs`` may contain."""
    accepted = simulator_defaults(cls)
    return {"parameters": [row for row in parameters(cls) if row["name"] in accepted]}


def controller_facts(cls: Any) -> dict[str, Any]:
    """Return the facts about a controller class: its command mode and its parameters."""
    return {"command": str(getattr(cls, "command_mode", "")), "parameters": parameters(cls)}


def task_facts(cls: Any) -> dict[str, Any]:
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


def _algorithm_facts(cls: Any) -> dict[str, Any]:
    return {"defaults": cls.resolve_config({})}


def _nothing(_: Any) -> dict[str, Any]:
    return {}


_DESCRIBERS: Mapping[str, tuple[Callable[[Any], dict[str, Any]], Callable[[Any], dict[str, Any]]]] = {
    "simulator": (_simulator, simulator_facts),
    "robot": (_nothing, describe_robot),
    "controller": (_controller, controller_facts),
    "task": (_task, task_facts),
    "algorithm": (_algorithm, _algorithm_facts),
}
