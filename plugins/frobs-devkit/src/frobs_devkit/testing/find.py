"""Finds the ID, record, plugin or distribution that a command-line argument refers to, and its checks."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym

from frobs_cli import catalogue
from frobs_cli.errors import CommandLineError
from frobs_core import plugins
from frobs_core.kernel.robot_config import find_record
from frobs_core.plugins import PluginReport, normalize, registry
from frobs_core.plugins.records import KINDS, SimulatorRecord, TaskRecord
from frobs_core.util.errors import AmbiguousNameError, UnknownNameError, nearest
from frobs_devkit.testing.algorithm import check_algorithm
from frobs_devkit.testing.checks import Check, Inconclusive, only
from frobs_devkit.testing.controller import check_controller
from frobs_devkit.testing.environment import CHECKS as ENVIRONMENT_CHECKS
from frobs_devkit.testing.environment import check_env
from frobs_devkit.testing.extension import check_extension
from frobs_devkit.testing.plugin import check_plugin
from frobs_devkit.testing.robot import check_robot
from frobs_devkit.testing.simulator import check_simulator
from frobs_devkit.testing.task import check_task

_VERSION = re.compile(r"-v\d+$")  # pattern for the end of most environment IDs


@dataclass(frozen=True)
class Subject:
    """An object to check, as returned by :func:`find_subject`.

    Attributes:
        kind: ``"environment"``, a record kind, ``"capability"``, ``"sensor_type"``, ``"parameter"``, ``"policy"``,
            ``"viewer"``, ``"command"``, ``"plugin"`` or ``"distribution"``.
        name: Full name, such as ``"irb120"`` or ``"frobs/Irb120Reach-v0"``.
    """

    kind: str
    name: str

    @property
    def word(self) -> str:
        """Command-line argument that identifies the object: an environment ID, or a name such as ``"robot:irb120"``."""
        return self.name if self.kind == "environment" else f"{self.kind}:{self.name}"

    @property
    def claims(self) -> Mapping[str, str]:
        """Level of each capability that a simulator claims, by name. The dictionary is empty for other objects."""
        if self.kind != "simulator":
            return {}
        record = find_record(SimulatorRecord, self.name)
        return {name: str(level) for name, level in record.capabilities.items() if level}

    def checks(
        self,
        robot: str | None = None,
        simulator: str | None = None,
        settings: Mapping[str, Any] | None = None,
        steps: int | None = None,
    ) -> list[Check]:
        """Return the checks for the object, without creating any environment or simulation.

        Args:
            robot: Robot for checks of controllers, tasks and environments. Defaults to the robot of the task or
                environment, or to one of the kit's robots for a controller.
            simulator: Simulator for the checks. Defaults to the object's own, or to all simulators for a robot.
            settings: Settings of an algorithm, keywords of an environment, task or controller, or fields of a sensor.
            steps: Number of environment steps in an algorithm's training run.

        Raises:
            ConfigurationError: Objects of this kind do not support ``settings`` or ``steps``.
        """
        if settings and self.kind not in ("environment", "task", "controller", "algorithm", "sensor_type", "policy"):
            raise CommandLineError(
                "--set",
                f"checks of a {self.kind} have no settings; use --set only with an environment ID, task, controller, "
                "algorithm, sensor type or policy.",
            )
        if steps is not None and self.kind not in ("algorithm", "plugin", "distribution"):
            raise CommandLineError(
                "--steps",
                f"{self.kind} checks do not train; use --steps only with an algorithm, plugin or distribution.",
            )
        options: dict[str, Any] = {"robot": robot, "simulator": simulator, "settings": settings or {}, "steps": steps}
        if self.kind == "plugin":
            (report,) = (report for report in plugins.reports() if _key(report) == self.name)
            return _of_plugin(report, **options)
        if self.kind == "distribution":
            own = normalize(self.name)
            reports = [report for report in plugins.reports() if normalize(report.distribution) == own]
            checks = [check.under(report.name) for report in reports for check in _of_plugin(report, **options)]
            for item in catalogue.listed("command"):
                if normalize(item.distribution) == own:
                    checks += [check.under(f"command:{item.name}") for check in check_extension("command", item.name)]
            return checks
        return _of(self.kind, self.name, **options)


def find_subject(word: str) -> Subject:
    """Return the object to check that a command-line argument refers to.

    Args:
        word: A Gymnasium ID (``"frobs/Irb120Reach-v0"`` or ``"module:Id-v0"``), a record (``"robot:irb120"``, or
            ``"irb120"`` if the name is unique), an extension (``"sensor_type:lidar"``), or the name of a plugin or
            distribution.

    Raises:
        UnknownNameError: No object has this name. The message suggests the most similar name.
        AmbiguousNameError: Several objects have this name. The message lists unambiguous arguments.
    """
    kind, colon, rest = word.partition(":")
    known = {
        **{kind: list(plugins.records(kind)) for kind in KINDS},
        "plugin": [name for report in plugins.reports() for name in (report.name, _key(report))],
        "distribution": [report.distribution for report in plugins.reports()],
    }
    if colon and kind in catalogue.EXTENSIONS:
        check_extension(kind, rest)  # raises an error that lists the existing names
        return Subject(kind, rest)
    if colon and kind in known:
        return _named(kind, rest, known[kind])
    if "/" in word or word in gym.registry or word.rpartition(":")[2] in gym.registry:
        return Subject("environment", word)
    subjects = [_named(kind, word, names) for kind, names in known.items() if _spelt(kind, word, names)]
    if not subjects and colon and (_VERSION.search(rest) or nearest(kind, known) is None):
        return Subject("environment", word)  # the module, which registers the ID, has not been imported yet
    if not subjects:
        extensions = {other: [item.name for item in catalogue.listed(other)] for other in catalogue.EXTENSIONS}
        subjects = [Subject(other, word) for other, names in extensions.items() if word in names]
    if not subjects:
        failed = plugins.active().failures()
        names = {name for names in known.values() for name in names if ":" not in name}
        raise UnknownNameError("part, plugin or ID", word, [*names, *registry.environments()], failed)
    if len(subjects) > 1:
        raise AmbiguousNameError("name", word, [f"the {one.kind}" for one in subjects], [one.word for one in subjects])
    return subjects[0]


def _named(kind: str, name: str, names: Iterable[str]) -> Subject:
    if kind in KINDS:
        # for an unknown name, this raises an error that lists the existing names and the failed plugins
        plugins.get_record(kind, name)
        return Subject(kind, name)
    if not _spelt(kind, name, names):
        raise UnknownNameError(kind, name, set(names))
    if kind == "distribution":
        return Subject(kind, name)
    meant = [report for report in plugins.reports() if name in (report.name, _key(report))]
    if len(meant) > 1:
        ways = [f"plugin:{_key(report)}" for report in meant]
        raise AmbiguousNameError("plugin", name, [report.origin for report in meant], ways)
    return Subject(kind, _key(meant[0]))


def _spelt(kind: str, word: str, names: Iterable[str]) -> bool:
    if kind == "distribution":
        return normalize(word) in map(normalize, names)
    return word in names


def _key(report: PluginReport) -> str:
    return f"{report.distribution}:{report.name}"


def _of(
    kind: str, name: str, robot: str | None, simulator: str | None, settings: Mapping[str, Any], steps: int | None
) -> list[Check]:
    keywords: dict[str, Any] = {"robot": robot, "simulator": simulator}
    given = {**settings, **{key: value for key, value in keywords.items() if value is not None}}
    if kind == "environment":
        entry = registry.environments().get(name.rpartition(":")[2])
        if entry is not None and not entry[1].robot and robot is None:
            reason = "the environment ID requires a robot; pass --robot to 'frobs check', or robot= to check_env"
            return only("robot_is_given", "A robot is given.", Inconclusive(reason))
        return check_env(name, **given)
    if kind in catalogue.EXTENSIONS:
        return check_extension(kind, name, settings)
    if kind == "robot":
        return check_robot(name, None if simulator is None else [simulator])
    if kind == "simulator":
        return check_simulator(name)
    if kind == "algorithm":
        training: dict[str, Any] = {} if steps is None else {"steps": steps}
        return check_algorithm(name, settings, **training)
    if kind == "controller":
        return check_controller(name, **given)
    record = find_record(TaskRecord, name)
    if not record.environments and not {"robot", "controller"} <= given.keys():
        reason = (
            "the task does not register an environment ID; choose a robot with --robot, and a controller with --set "
            "environment_kwargs.controller=NAME"
        )
        return only("robot_is_given", "A robot is given.", Inconclusive(reason))
    return check_task(name, **given)


def _of_plugin(report: PluginReport, **options: Any) -> list[Check]:
    """Return the checks for a plugin, then for its records, and finally for its environment IDs."""
    checks = check_plugin(_key(report))
    of_environments = {function.__name__ for function in ENVIRONMENT_CHECKS}
    for kind in KINDS:
        for record in report.records[kind]:
            name = record.name if record.name in plugins.records(kind) else f"{report.distribution}:{record.name}"
            own = _of(kind, name, **options)
            # if the task has environment IDs, checks that also apply to environments run only for these IDs
            if isinstance(record, TaskRecord):
                own = [check for check in own if not record.environments or check.name not in of_environments]
            checks += [check.under(f"{kind}:{record.name}") for check in own]
    for kind, record_kind in catalogue.EXTENSIONS.items():
        own_records = report.records.get(record_kind, ())
        for item in catalogue.listed(kind) if own_records else ():
            if any(item.record is record for record in own_records):
                checks += [check.under(f"{kind}:{item.record.name}") for check in check_extension(kind, item.name)]
    for id in report.environment_ids:
        if id in registry.environments():
            checks += [check.under(id) for check in _of("environment", id, **options)]
    return checks
