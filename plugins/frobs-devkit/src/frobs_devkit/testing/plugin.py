"""Checks of a whole plugin: the effects of importing it, its requirements and its records."""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from functools import lru_cache

from frobs_core import __version__, plugins
from frobs_core.contracts import Algorithm, Controller, ModelReader, Policy, Simulation, Task, Viewer
from frobs_core.description import Robot, Sensor
from frobs_core.plugins import Candidate, PluginReport, core_versions, is_made_for, registry
from frobs_core.plugins.records import AlgorithmRecord, Record, TaskRecord
from frobs_core.util.errors import FrobsError, ModelFileError, PluginError, UnknownNameError
from frobs_devkit.doctor.plugins import PluginFacts, examine_plugins
from frobs_devkit.doctor.requirements import missing
from frobs_devkit.testing.checks import Check, CheckFailure, Inconclusive, after, checks_of, collect, expect
from frobs_models import resolve_path

_BASES: dict[str, type] = {
    "sensor_type": Sensor,
    "model_format": ModelReader,
    "policy": Policy,
    "viewer": Viewer,
    "simulator": Simulation,
    "controller": Controller,
    "task": Task,
    "algorithm": Algorithm,
}
_PREVIOUS = "0.2.999"  # a version of the core before the installed one, for which plugins still work
_SLOWEST = 5.0  # [s], maximum duration of an import, even on a slow machine
_ID = re.compile(r"[\w.-]+/[\w.-]+-v\d+")


@dataclass(frozen=True)
class PluginUnderTest:
    """A plugin, identified by the name of its entry point."""

    name: str

    @property
    def report(self) -> PluginReport:
        """The report about loading the plugin."""
        for report in plugins.reports():
            if self.name in (report.name, f"{report.distribution}:{report.name}"):
                return report
        raise UnknownNameError("plugin", self.name, [report.name for report in plugins.reports()])

    @property
    def candidate(self) -> Candidate:
        """The plugin's entry point."""
        report = self.report
        return next(
            candidate
            for candidate in plugins.active().candidates()
            if (candidate.name, candidate.distribution) == (report.name, report.distribution)
        )

    def expect_no(self, *codes: str) -> None:
        """Examine the plugin in a separate process, and raise CheckFailure for findings with one of the given codes."""
        facts = _examine(self.candidate)
        lines = facts.traceback.strip().splitlines() or [facts.cause]
        expect(facts.state == "loaded", f"importing '{facts.module}' fails: {lines[-1]}")
        problems = [f"{one.about}: {one.problem}; {one.advice}" for one in facts.findings if one.code in codes]
        expect(not problems, f"{'; '.join(problems)}.")

    @property
    def is_made_for_previous_core(self) -> bool:
        """Whether the plugin was made for the version before the installed one, which still supports the plugin."""
        made_for = core_versions(self.candidate.requirements)
        return not is_made_for(made_for, __version__) and is_made_for(made_for, _PREVIOUS)

    def expect_nothing_old(self, *codes: str) -> None:
        """Like :meth:`expect_no`, but do not judge a plugin that was made for the previous version of the core."""
        try:
            self.expect_no(*codes)
        except CheckFailure as failure:
            if self.is_made_for_previous_core:
                raise Inconclusive(f"the plugin was made for frobs-core {_PREVIOUS[:3]}: {failure}") from None
            raise

    @property
    def records(self) -> list[tuple[str, Record]]:
        """The plugin's records, each with its kind."""
        return [(kind, record) for kind, records in self.report.records.items() for record in records]


def loads(subject: PluginUnderTest) -> None:
    """The plugin is loaded and provides at least one record."""
    report = subject.report
    expect(report.state == "loaded", f"plugin '{report.name}' of {report.origin} is {report.state}: {report.cause}")
    expect(
        subject.records,
        f"plugin '{report.name}' of {report.origin} provides no records; check that its hooks return records.",
    )


@after("loads")
def import_is_cheap(subject: PluginUnderTest) -> None:
    """Importing the entry point's module loads no physics engine or learning library and takes only a few seconds."""
    subject.expect_no("heavy-import")
    seconds = _examine(subject.candidate).import_seconds
    expect(
        seconds < _SLOWEST,
        f"importing '{subject.report.module}' takes {seconds:.1f} s, which slows down every command.",
    )


@after("loads")
def import_is_silent(subject: PluginUnderTest) -> None:
    """Importing the entry point's module prints nothing to stdout or stderr."""
    subject.expect_no("prints")


@after("loads")
def import_changes_nothing(subject: PluginUnderTest) -> None:
    """Importing the entry point's module changes no global state, such as the working directory or warning filters."""
    subject.expect_no("global-state")


@after("loads")
def nothing_deprecated_is_used(subject: PluginUnderTest) -> None:
    """Importing the entry point's module and calling its hooks causes no deprecation warnings."""
    subject.expect_nothing_old("deprecated")


def requirements_are_met(subject: PluginUnderTest) -> None:
    """All requirements of the distribution are installed in compatible versions."""
    lacking = missing(subject.candidate.requirements)
    if subject.is_made_for_previous_core:
        lacking = [one for one in lacking if not one.requirement.startswith("frobs-")]
    expect(not lacking, f"it has unmet requirements: {'; '.join(one.command for one in lacking)}.")


@after("loads")
def core_versions_are_stated(subject: PluginUnderTest) -> None:
    """The distribution requires frobs-core with an upper version bound, and the installed version is in the range."""
    if not subject.candidate.requirements and subject.candidate.version in ("0", "(no version)"):
        raise Inconclusive("the plugin has no metadata, because it was not installed with pip")
    subject.expect_nothing_old("other-core", "no-core-versions")


def entry_points_load(subject: PluginUnderTest) -> None:
    """Every record's entry point can be imported and has the type that the record's kind requires."""
    for kind, record in subject.records:
        if not record.entry_point:  # capabilities and parameters have no entry point, because simulators implement them
            continue
        implementation = record.load()
        if kind == "robot":
            expect(isinstance(implementation, Robot), f"robot '{record.name}': {record.entry_point} is not a Robot.")
            continue
        if (base := _BASES.get(kind)) is None:  # an extension that another distribution defines
            continue
        right = isinstance(implementation, type) and issubclass(implementation, base)
        expect(right, f"{kind} '{record.name}': {record.entry_point} is not a subclass of {base.__name__}.")
        abstract = sorted(getattr(implementation, "__abstractmethods__", ()))
        expect(not abstract, f"{kind} '{record.name}': {record.entry_point} does not define {', '.join(abstract)}.")


def names_are_free(subject: PluginUnderTest) -> None:
    """No other installed distribution provides a record with the same kind and name."""
    for kind, record in subject.records:
        plugins.get_record(kind, record.name)


def summaries_are_one_line(subject: PluginUnderTest) -> None:
    """Every record has a one-line summary and an install hint."""
    for kind, record in subject.records:
        environments = record.environments if isinstance(record, TaskRecord) else ()
        for name, summary in [(record.name, record.summary), *((e.id, e.summary) for e in environments)]:
            expect(summary.strip(), f"{kind} '{name}' has no summary.")
            expect(
                "\n" not in summary and len(summary) <= 120,
                f"the summary of {kind} '{name}' must be a single line of at most 120 characters.",
            )
        expect(
            record.install_hint.strip(),
            f"{kind} '{record.name}' has no install_hint; set a command such as 'pip install …'.",
        )


def environments_are_complete(subject: PluginUnderTest) -> None:
    """Every environment ID is unique and has the form ``namespace/Name-v0``, and the environment's parts exist."""
    for _, record in subject.records:
        for environment in record.environments if isinstance(record, TaskRecord) else ():
            expect(_ID.fullmatch(environment.id), f"the ID '{environment.id}' is not of the form namespace/Name-v0.")
            expect(environment.max_episode_steps >= 1, f"'{environment.id}' has max_episode_steps < 1.")
            for kind in ("robot", "controller", "simulator") if environment.robot else ("controller", "simulator"):
                try:
                    plugins.get_record(kind, getattr(environment, kind))
                except PluginError as error:
                    raise CheckFailure(f"'{environment.id}': {error}") from error
            problem = registry.problems().get(environment.id, "")
            expect(not problem, f"{problem}.")


def tuned_settings_exist(subject: PluginUnderTest) -> None:
    """All tuned settings files listed in algorithm records exist."""
    for _, record in subject.records:
        for id, resource in record.tuned.items() if isinstance(record, AlgorithmRecord) else ():
            try:
                there = resolve_path(resource).is_file()
            except ModelFileError as error:
                raise CheckFailure(
                    f"the settings of algorithm '{record.name}' for '{id}' cannot be found: {error}"
                ) from error
            expect(
                there, f"the file {resource} with the settings of algorithm '{record.name}' for '{id}' does not exist."
            )


def pretrained_policies_fit(subject: PluginUnderTest) -> None:
    """Every pretrained policy is intact and was trained in the current version of its environment."""
    from frobs_train import changes_since, open_pretrained

    for _, record in subject.records:
        for environment in record.environments if isinstance(record, TaskRecord) else ():
            if not environment.pretrained:
                continue
            try:
                changes = changes_since(open_pretrained(environment.id))
            except FrobsError as error:
                raise CheckFailure(f"the policy of '{environment.id}', {environment.pretrained}: {error}") from error
            expect(
                not changes,
                f"the environment '{environment.id}' has changed since its pretrained policy was trained: "
                f"{'; '.join(changes)}. Train the policy again.",
            )


CHECKS = checks_of(sys.modules[__name__])
"""All plugin checks, in the order in which they run."""


def check_plugin(plugin: str) -> list[Check]:
    """Return the conformance checks for an installed plugin.

    Args:
        plugin: Name of the plugin's entry point in the group ``frobs``, or ``"distribution:name"``.
    """
    return collect(PluginUnderTest(plugin), CHECKS)


@lru_cache(maxsize=1)
def _examine(candidate: Candidate) -> PluginFacts:
    return examine_plugins(only=[candidate.key])[0]
