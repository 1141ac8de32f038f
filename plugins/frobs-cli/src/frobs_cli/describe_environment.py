"""Collects the facts that ``frobs show`` prints about an environment ID of FRobs or of another package."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec

from frobs_cli import catalogue
from frobs_cli.describe_fit import CHANGE, fit_rows
from frobs_cli.describe_record import task_facts
from frobs_cli.parameters import parameters
from frobs_cli.providers import providers
from frobs_core import plugins
from frobs_core.kernel.compose import build, needs_of_task
from frobs_core.kernel.config import EnvConfig
from frobs_core.kernel.fitting import fixed_keywords
from frobs_core.plugins import registry
from frobs_core.plugins.capabilities import check_capabilities
from frobs_core.plugins.records import (
    AlgorithmRecord,
    ControllerRecord,
    EnvironmentRecord,
    Level,
    SimulatorRecord,
    TaskRecord,
)
from frobs_core.util.errors import CapabilityError, FrobsError

_YOURS = "any: choose one with robot=…"
_DEPENDS = "the shape depends on the chosen robot"


def describe_environment(spec: EnvSpec, chosen: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return the facts about an environment ID, including ``error`` if the environment cannot be built.

    Args:
        spec: Specification of the ID.
        chosen: Keywords that select another robot. The facts then include how the task is fitted to the robot.
    """
    facts: dict[str, Any] = {"kind": catalogue.ENVIRONMENT, "name": spec.id}
    ours = registry.environments().get(spec.id)
    if ours is None:
        facts["entry_point"] = str(spec.entry_point)
        facts["max_episode_steps"] = spec.max_episode_steps
        facts |= _spaces(spec, {})
        facts["keywords"] = dict(spec.kwargs)
        return facts
    task, environment = ours
    robot = (chosen or {}).get("robot") or environment.robot
    fixed = fixed_keywords({**spec.kwargs, **chosen}) if chosen else {}
    facts |= {
        "summary": environment.summary,
        "from": catalogue.source_of("task", task),
        "task": task.name,
        "robot": robot or _YOURS,
        "controller": environment.controller,
        "simulator": environment.simulator,
        "max_episode_steps": environment.max_episode_steps,
        **(
            _spaces(spec, {**(chosen or {}), **fixed})
            if robot
            else dict.fromkeys(("action_space", "observation_space"), _DEPENDS)
        ),
    }
    if chosen and fixed:
        facts["to_change"] = CHANGE
        facts["found_and_fitted"] = fit_rows({**spec.kwargs, **chosen}, fixed)
    with contextlib.suppress(FrobsError):  # _spaces already reports parts that cannot be imported
        facts |= _task(task, environment)
        facts["controller_parameters"] = _controller(environment)
    facts["tuned_algorithms"] = [
        item.name
        for item in catalogue.listed("algorithm")
        if isinstance(item.record, AlgorithmRecord) and spec.id in item.record.tuned
    ]
    facts["simulators"] = _simulators(task, environment)
    for provider in providers():
        facts |= provider.environment(spec.id, environment)
    return facts


def readable_environment(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Convert the facts from :func:`describe_environment` to human-readable form."""
    shown = dict(facts)
    for provider in providers():
        shown |= provider.readable_environment(shown)
    return shown


def _spaces(spec: EnvSpec, keywords: Mapping[str, Any]) -> dict[str, Any]:
    try:
        env = gym.make(spec, disable_env_checker=True, **keywords)
    except (FrobsError, gym.error.Error) as error:
        return {"error": str(error)}
    spaces = {"action_space": space_text(env.action_space), "observation_space": space_text(env.observation_space)}
    env.close()
    return spaces


def space_text(space: gym.Space[Any]) -> str:
    """Return a one-line description of a space, such as ``"Box (3,) float32 in [-1, 1]"``."""
    if isinstance(space, gym.spaces.Box):
        return f"Box {space.shape} {space.dtype} in [{np.min(space.low):.6g}, {np.max(space.high):.6g}]"
    if isinstance(space, gym.spaces.Dict):
        return "; ".join(f"{key}: {space_text(member)}" for key, member in space.items())
    return str(space)


def _task(record: TaskRecord, environment: EnvironmentRecord) -> dict[str, Any]:
    facts = task_facts(record.load())
    chosen = environment.parameters
    for key in ("control_timestep", "physics_timestep"):
        if key in chosen:
            facts[key] = f"{chosen[key]:g} s"
    facts["task_parameters"] = _with_defaults(facts.pop("parameters"), chosen)
    return facts


def _controller(environment: EnvironmentRecord) -> list[dict[str, Any]]:
    chosen: Mapping[str, Any] = environment.parameters.get("controller_kwargs", {})
    return _with_defaults(parameters(plugins.get_record("controller", environment.controller).load()), chosen)


def _with_defaults(rows: list[dict[str, Any]], chosen: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return parameter rows in which the values set by an environment replace the defaults."""
    return [row | {"default": chosen[row["name"]], "required": False} if row["name"] in chosen else row for row in rows]


def _simulators(task: TaskRecord, environment: EnvironmentRecord) -> list[dict[str, Any]]:
    """Return whether each simulator can run the environment, and which capabilities or packages are missing."""
    needs: dict[str, Mapping[str, Level]] = {f"task '{task.name}'": task.needs}
    with contextlib.suppress(FrobsError):
        config = EnvConfig.from_dict({"task": task.name, "robot": environment.robot, **environment.parameters})
        needs = needs_of_task(task, build(f"task '{task.name}'", task.load(), config.task_parameters))
    with contextlib.suppress(FrobsError):
        controller = plugins.get_record("controller", environment.controller)
        if isinstance(controller, ControllerRecord):
            needs[f"controller '{controller.name}'"] = controller.needs
    rows = []
    for item in catalogue.listed("simulator"):
        if isinstance(item.record, SimulatorRecord):
            missing: list[str] = []
            try:
                check_capabilities(item.name, item.record.capabilities, needs)
            except CapabilityError as error:
                missing = [f"{capability} ({level}; has {has})" for _, capability, level, has in error.missing]
            if problem := catalogue.why_unusable(item.record):
                missing.append(problem)
            rows.append({"simulator": item.name, "can_run_it": not missing, "lacks": ", ".join(missing)})
    return rows
