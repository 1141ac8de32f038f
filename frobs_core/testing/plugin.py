"""Checks of a plugin as a whole: what it costs to import, and whether its records say what is true."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import dataclass
from typing import Any

from frobs_core import plugins
from frobs_core.errors import ModelFileError, PluginError, UnknownNameError
from frobs_core.interfaces import Algorithm, Controller, Robot, Simulation, Task
from frobs_core.models.resources import resolve_path
from frobs_core.plugins import PluginReport
from frobs_core.specs import AlgorithmRecord, Record, TaskRecord
from frobs_core.testing.checks import Check, CheckFailure, Outcome, collect, expect

_HEAVY = (
    "mujoco",
    "pybullet",
    "torch",
    "stable_baselines3",
    "matplotlib",
    "rospy",
    "rclpy",
    "tensorflow",
    "jax",
    "pandas",
)
_BASES: dict[str, type] = {"simulator": Simulation, "controller": Controller, "task": Task, "algorithm": Algorithm}
_ID = re.compile(r"[\w.-]+/[\w.-]+-v\d+")

_CHILD = """
import json, os, random, signal, sys, warnings
import numpy
import frobs_core.hookspecs, frobs_core.specs
def state():
    return {
        "random state": [repr(random.getstate()), repr(numpy.random.get_state())],
        "warning filters": repr(warnings.filters),
        "signal handlers": [repr(signal.getsignal(s)) for s in (signal.SIGINT, signal.SIGTERM)],
        "numpy error state": repr(numpy.geterr()),
    }
acts = {"os.chdir": "working directory", "os.putenv": "environment", "os.unsetenv": "environment"}
seen, done, importing = set(sys.modules), [], True
sys.addaudithook(lambda event, _: done.append(acts[event]) if importing and event in acts else None)
before = state()
__import__(sys.argv[1])
after, importing = state(), False
print("\\nfrobs-kit:" + json.dumps({
    "modules": sorted({name.partition(".")[0] for name in set(sys.modules) - seen}),
    "changed": sorted({*done, *(name for name in before if before[name] != after[name])}),
}))
"""


@dataclass(frozen=True)
class PluginUnderTest:
    """A plugin by the name of its entry point."""

    name: str

    @property
    def report(self) -> PluginReport:
        """What became of it."""
        for report in plugins.reports():
            if self.name in (report.name, f"{report.distribution}:{report.name}"):
                return report
        raise UnknownNameError("plugin", self.name, [report.name for report in plugins.reports()])

    @property
    def records(self) -> list[tuple[str, Record]]:
        """Its records, each with its kind."""
        return [(kind, record) for kind, records in self.report.records.items() for record in records]


def loads(subject: PluginUnderTest) -> Outcome:
    """It is loaded, and offers something."""
    report = subject.report
    expect(report.state == "loaded", f"plugin '{report.name}' of {report.origin} is {report.state}: {report.cause}")
    expect(subject.records, f"plugin '{report.name}' of {report.origin} offers no record; does a hook return them?")
    return None


def import_is_cheap(subject: PluginUnderTest) -> Outcome:
    """Importing the entry point's module loads no engine and no learning library, prints nothing, changes nothing."""
    module = subject.report.module.partition(":")[0]
    child = subprocess.run(
        [sys.executable, "-c", _CHILD, module], capture_output=True, text=True, timeout=60, check=False
    )
    printed, _, told = child.stdout.rpartition("\nfrobs-kit:")
    if child.returncode or not told:
        lines = child.stderr.strip().splitlines() or ["no output"]
        raise CheckFailure(f"importing '{module}' fails: {lines[-1]}")
    found: dict[str, Any] = json.loads(told)
    heavy = [name for name in _HEAVY if name in found["modules"]]
    expect(not heavy, f"importing '{module}' imports {', '.join(heavy)}; import it where an entry_point is used.")
    expect(not printed.strip(), f"importing '{module}' prints: {printed.strip()[:200]}")
    expect(not child.stderr.strip(), f"importing '{module}' prints to stderr: {child.stderr.strip()[:200]}")
    expect(not found["changed"], f"importing '{module}' changes the {' and the '.join(found['changed'])}.")
    return None


def entry_points_load(subject: PluginUnderTest) -> Outcome:
    """Every record's entry point can be imported, and is what its kind asks for."""
    for kind, record in subject.records:
        implementation = record.load()
        if kind == "robot":
            expect(isinstance(implementation, Robot), f"robot '{record.name}': {record.entry_point} is no Robot.")
            continue
        base = _BASES[kind]
        right = isinstance(implementation, type) and issubclass(implementation, base)
        expect(right, f"{kind} '{record.name}': {record.entry_point} is no subclass of {base.__name__}.")
        abstract = sorted(getattr(implementation, "__abstractmethods__", ()))
        expect(not abstract, f"{kind} '{record.name}': {record.entry_point} lacks {', '.join(abstract)}.")
    return None


def names_are_free(subject: PluginUnderTest) -> Outcome:
    """No other installed distribution offers one of its names."""
    for kind, record in subject.records:
        plugins.get_record(kind, record.name)
    return None


def summaries_are_one_line(subject: PluginUnderTest) -> Outcome:
    """Every record says in one line what it is, and how it is installed."""
    for kind, record in subject.records:
        environments = record.environments if isinstance(record, TaskRecord) else ()
        for name, summary in [(record.name, record.summary), *((e.id, e.summary) for e in environments)]:
            expect(summary.strip(), f"{kind} '{name}' has no summary.")
            expect(
                "\n" not in summary and len(summary) <= 120, f"the summary of {kind} '{name}' is not one short line."
            )
        expect(record.install_hint.strip(), f"{kind} '{record.name}' has no install_hint: 'pip install …'.")
    return None


def environments_are_complete(subject: PluginUnderTest) -> Outcome:
    """Every environment ID is ``namespace/Name-v0``, and its robot, controller and simulator exist."""
    for _, record in subject.records:
        for environment in record.environments if isinstance(record, TaskRecord) else ():
            expect(_ID.fullmatch(environment.id), f"the ID '{environment.id}' is not of the form namespace/Name-v0.")
            expect(environment.max_episode_steps >= 1, f"'{environment.id}' has max_episode_steps < 1.")
            for kind in ("robot", "controller", "simulator") if environment.robot else ("controller", "simulator"):
                try:
                    plugins.get_record(kind, getattr(environment, kind))
                except PluginError as error:
                    raise CheckFailure(f"'{environment.id}': {error}") from error
    return None


def tuned_settings_exist(subject: PluginUnderTest) -> Outcome:
    """Every file of tuned settings is there."""
    for _, record in subject.records:
        for id, resource in record.tuned.items() if isinstance(record, AlgorithmRecord) else ():
            try:
                there = resolve_path(resource).is_file()
            except ModelFileError as error:
                raise CheckFailure(f"algorithm '{record.name}', tuned for '{id}': {error}") from error
            expect(there, f"algorithm '{record.name}', tuned for '{id}': there is no file {resource}.")
    return None


CHECKS = (
    loads,
    import_is_cheap,
    entry_points_load,
    names_are_free,
    summaries_are_one_line,
    environments_are_complete,
    tuned_settings_exist,
)
"""Every check of a plugin, in the order in which they run."""


def check_plugin(plugin: str) -> list[Check]:
    """Return the checks of an installed plugin.

    Args:
        plugin: The name of its entry point in the group ``frobs``, or ``"distribution:name"``.
    """
    return collect(PluginUnderTest(plugin), CHECKS)
