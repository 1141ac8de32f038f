"""Registration of the Gymnasium IDs of all plugins. No implementation is imported.

If two distributions provide the same ID, requesting this ID raises an error that names both distributions. Each of the
two environments remains available with its distribution as the namespace
(``"frobs-tasks-reach/frobs.Irb120Reach-v0"``).
"""

from __future__ import annotations

import copy
import importlib.util
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

import gymnasium as gym
from gymnasium.envs.registration import EnvSpec, get_env_id, parse_env_id

from frobs_core import plugins
from frobs_core.plugins.collection import Plugins, warn
from frobs_core.plugins.discovery import normalize
from frobs_core.plugins.records import ControllerDefaults, EnvironmentRecord, TaskRecord
from frobs_core.plugins.report import PluginReport
from frobs_core.util.errors import (
    AmbiguousNameError,
    ConfigurationError,
    PluginError,
    RunError,
    UnknownNameError,
    nearest,
)
from frobs_core.util.plain import is_plain

COMPOSITIONAL_ID = "frobs/Env-v0"
"""ID of an environment whose robot, task, controller and simulator are passed as keywords."""

_SINGLE = "frobs_core.kernel.env:RobotEnv"
_VECTOR = "frobs_core.kernel.mixed_vector_env:make_vector_env"
_CLASH = "frobs_core.plugins.registry:raise_clash"

_registered: dict[str, EnvSpec] = {}  # FRobs IDs, recognized even if a user has changed, for example, max_episode_steps


@dataclass
class _Table:
    """Environment IDs of a plugin collection, with conflicts resolved."""

    environments: dict[str, tuple[TaskRecord, EnvironmentRecord]] = field(default_factory=dict)
    specs: dict[str, EnvSpec] = field(default_factory=dict)
    clashes: dict[str, list[str]] = field(default_factory=dict)
    problems: dict[str, str] = field(default_factory=dict)


def register_environments() -> None:
    """Register every environment record and ``frobs/Env-v0``. Repeated calls have no effect.

    If an ID cannot be registered, a warning is logged and :func:`problems` lists the ID. All other IDs are still
    registered.

    Raises:
        PluginLoadError: A plugin is broken, and ``FROBS_STRICT_PLUGINS`` is set.
    """
    table = _table(plugins.active())
    for spec in table.specs.values():
        if spec.id not in gym.registry:
            try:
                gym.register(
                    id=spec.id,
                    entry_point=spec.entry_point,
                    vector_entry_point=spec.vector_entry_point,
                    max_episode_steps=spec.max_episode_steps,
                    kwargs=spec.kwargs,
                )
                _registered[spec.id] = gym.registry[spec.id]
            except gym.error.Error as error:
                table.problems[spec.id] = f"environment ID '{spec.id}' is not registered: {error}"
    for line in table.problems.values():
        _warn_once(line)


def environments() -> Mapping[str, tuple[TaskRecord, EnvironmentRecord]]:
    """Return the task record and environment record of each available ID."""
    return dict(sorted(_table(plugins.active()).environments.items()))


def problems() -> Mapping[str, str]:
    """Return a one-line reason for each ID that is not available."""
    return dict(_table(plugins.active()).problems)


def find_environment(id: str) -> tuple[TaskRecord, EnvironmentRecord]:
    """Return the task record and environment record of an ID. The form ``frobs_core:frobs/…`` is also accepted.

    Raises:
        UnknownNameError: No plugin provides the ID.
        AmbiguousNameError: Two distributions provide the ID.
    """
    collection = plugins.active()
    table = _table(collection)
    bare = bare_id(id)
    if bare in table.clashes:
        raise_clash(bare, table.clashes[bare])
    if bare not in table.environments:
        why_not = [*collection.failures(), *table.problems.values()]
        hint = collection.install_hint("environment", bare)
        raise UnknownNameError("environment ID", bare, table.environments, why_not, hint)
    return table.environments[bare]


def bare_id(id: str) -> str:
    """Return an ID without its module prefix: ``"frobs_core:frobs/…"`` becomes ``"frobs/…"``."""
    return id.rpartition(":")[2]


def find_spec(id: str) -> EnvSpec:
    """Return Gymnasium's spec of an ID from FRobs or from another package.

    Args:
        id: The ID. The form ``"module:ID"`` imports the module first.

    Raises:
        UnknownNameError: The ID does not exist. The message suggests the closest match.
        AmbiguousNameError: Two distributions provide the ID.
        ConfigurationError: The module cannot be imported.
    """
    module, _, name = id.rpartition(":")
    if name in problems():
        find_environment(name)
    if module:
        try:
            import_module(module)
        except ImportError as error:
            raise ConfigurationError(f"environment '{id}': module '{module}' cannot be imported: {error}.") from error
    spec = gym.registry.get(name)
    if spec is None:
        similar = nearest(name, gym.registry)
        ours = [known for known in gym.registry if known.startswith("frobs/")]
        why_not = [*plugins.active().failures(), *problems().values()]
        hint = plugins.active().install_hint("environment", name)
        raise UnknownNameError("environment ID", name, {*ours, *([similar] if similar else [])}, why_not, hint)
    return spec


def pretrained_ids() -> list[str]:
    """Return a sorted list of the IDs that have a trained policy."""
    return [id for id, (_, record) in environments().items() if record.pretrained]


def pretrained_path(id: str) -> Path:
    """Return the path of an ID's trained policy.

    Args:
        id: The ID. The form ``frobs_core:frobs/…`` is also accepted.

    Raises:
        UnknownNameError: The ID does not exist.
        RunError: The ID has no trained policy.
        PluginError: The record names a file in a package that is not installed.
    """
    name = bare_id(id)
    known = environments()
    if name not in known and name not in gym.registry:
        find_environment(name)  # raises an error that lists the existing IDs
    if name not in known or not known[name][1].pretrained:
        others = pretrained_ids()
        raise RunError(
            f"{name} has no trained policy; train one with 'frobs train {name}'. "
            + (f"IDs with one: {', '.join(others)}." if others else "No installed ID has one.")
        )
    package, _, path = known[name][1].pretrained.partition(":")
    try:
        spec = importlib.util.find_spec(package)
    except (ImportError, ValueError):  # not a module name
        spec = None
    folders = [Path(folder) for folder in (spec.submodule_search_locations or [])] if spec else []
    if not folders or not path:
        raise PluginError(
            f"the record of {name} has pretrained='{known[name][1].pretrained}', which is not a file in an installed "
            "package; use the form 'package:path.frobs'."
        )
    return next((folder / path for folder in folders if (folder / path).is_file()), folders[0] / path)


def raise_clash(id: str, distributions: Sequence[str], **_: Any) -> NoReturn:
    """Raise the error for an ID that two distributions provide.

    Raises:
        AmbiguousNameError: Always.
    """
    ways = [_qualified(id, distribution.split()[0]) for distribution in distributions]
    raise AmbiguousNameError("environment ID", id, distributions, ways)


def _table(collection: Plugins) -> _Table:
    table = _Table(specs={COMPOSITIONAL_ID: _spec(COMPOSITIONAL_ID, 100, {})})
    task_names = set(collection.records("task"))
    offers: dict[str, list[tuple[PluginReport, TaskRecord, EnvironmentRecord]]] = {}
    for report in collection.reports():
        for task in report.records["task"]:
            assert isinstance(task, TaskRecord)
            for environment in task.environments:
                offers.setdefault(environment.id, []).append((report, task, environment))
    for id, offered in offers.items():
        if len(offered) > 1:
            table.clashes[id] = [report.origin for report, _, _ in offered]
            ways = [_qualified(id, report.distribution) for report, _, _ in offered]
            table.problems[id] = (
                f"environment ID '{id}' is provided by {' and by '.join(table.clashes[id])}; "
                f"it is registered as {' and as '.join(repr(way) for way in ways)}"
            )
        for report, task, environment in offered:
            if len(offered) > 1:
                environment = replace(environment, id=_qualified(id, report.distribution))
            name = task.name if task.name in task_names else f"{report.distribution}:{task.name}"
            _add(table, report, name, task, environment)
    for id, distributions in table.clashes.items():
        if id not in gym.registry:
            table.specs[id] = EnvSpec(
                id, _CLASH, vector_entry_point=_CLASH, kwargs={"id": id, "distributions": distributions}
            )
    return table


def _add(table: _Table, report: PluginReport, task_name: str, task: TaskRecord, environment: EnvironmentRecord) -> None:
    problem = _problem(environment)
    if not problem:
        kwargs: dict[str, Any] = {
            "task": task_name,
            "robot": environment.robot,
            "controller": environment.controller,
            "simulator": environment.simulator,
            **copy.deepcopy(dict(environment.parameters)),
        }
        if isinstance(kwargs.get("controller_kwargs"), Mapping):
            kwargs["controller_kwargs"] = ControllerDefaults(environment.controller, kwargs["controller_kwargs"])
        spec = _spec(environment.id, environment.max_episode_steps, kwargs)
        there = gym.registry.get(spec.id)
        if spec.id in table.specs:
            problem = "another FRobs environment uses this ID"
        elif there is not None and there is not _registered.get(spec.id) and there != spec:
            problem = "another package has already registered this ID"
    if problem:
        origin = f"plugin '{report.name}' of {report.origin}"
        line = f"environment ID '{environment.id}' of {origin} is not registered: {problem}"
        table.problems[environment.id] = line
    else:
        table.specs[spec.id] = spec
        table.environments[spec.id] = (task, environment)


def _spec(id: str, max_episode_steps: int, kwargs: dict[str, Any]) -> EnvSpec:
    return EnvSpec(id, _SINGLE, max_episode_steps=max_episode_steps, kwargs=kwargs, vector_entry_point=_VECTOR)


def _problem(environment: EnvironmentRecord) -> str:
    """Return the reason why Gymnasium cannot use an environment record, or an empty string."""
    try:
        parsed = parse_env_id(environment.id)
    except (gym.error.Error, TypeError):
        return "an ID must have the form 'namespace/Name-v0'"
    if parsed[2] is None or get_env_id(*parsed) != environment.id or ":" in environment.id:
        return "an ID must have the form 'namespace/Name-v0', with a version and without a colon"
    if type(environment.max_episode_steps) is not int or environment.max_episode_steps < 1:
        return f"max_episode_steps is {environment.max_episode_steps!r}; it must be a whole number of at least 1"
    for name in ("robot", "controller", "simulator", "algorithm"):
        if not isinstance(getattr(environment, name), str):
            return f"{name} is {getattr(environment, name)!r}, not a name"
    if not isinstance(environment.pretrained, str):
        return f"pretrained is {environment.pretrained!r}; it must have the form 'package:path.frobs'"
    if not isinstance(environment.parameters, Mapping):
        return "its parameters are not a mapping"
    for name, value in environment.parameters.items():
        if not is_plain(value):
            return (
                f"parameter '{name}' has the unsupported type {type(value).__name__}; "
                "use numbers, strings, lists and dictionaries"
            )
        if name in ("task", "robot", "controller", "simulator"):
            return f"parameter '{name}' must be set as a field of the record"
    return ""


def _qualified(id: str, distribution: str) -> str:
    namespace = re.sub(r"[^\w-]", "-", normalize(distribution))
    return f"{namespace}/{id.replace('/', '.')}"


@cache
def _warn_once(line: str) -> None:
    warn(line)
