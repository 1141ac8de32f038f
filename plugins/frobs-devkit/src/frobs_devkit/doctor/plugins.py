"""Examines every installed plugin in its own process, and returns facts and findings as data."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import PurePath

from frobs_core import __version__, plugins
from frobs_core.plugins import Candidate, core_versions, is_made_for
from frobs_devkit.doctor.requirements import has_upper_bound, missing
from frobs_devkit.doctor.robot_report import Finding, Severity, warning
from frobs_devkit.probe import Probe, probe

SLOW = 0.5
"""Import time above which a plugin is reported as slow [s], because slow plugins delay every ``import frobs_core``."""

HEAVY = (
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
"""Heavy modules that a plugin should not import at the top level, because listing plugins imports each plugin."""


@dataclass(frozen=True, kw_only=True)
class PluginFacts(Probe):
    """Facts about one plugin, in addition to what its import showed.

    Attributes:
        name: The entry point's name.
        distribution: The pip package that contains the plugin.
        version: Version of the distribution.
        module: Module that the entry point refers to.
        made_for: Versions of ``frobs-core`` that the distribution requires. Empty if not specified.
        disabled: Whether ``FROBS_DISABLE_PLUGINS`` lists the plugin.
        findings: Problems of the plugin, and how to fix them.
    """

    name: str
    distribution: str
    version: str
    module: str
    made_for: str
    disabled: bool
    findings: tuple[Finding, ...]

    @property
    def sound(self) -> bool:
        """Whether the plugin can be used."""
        return not any(finding.severity is Severity.ERROR for finding in self.findings)


def examine_plugins(
    seconds: float = 30.0, only: Iterable[str] = (), on_probe: Callable[[str], None] | None = None
) -> tuple[PluginFacts, ...]:
    """Import each installed plugin in its own process, and return facts and findings.

    Args:
        seconds: Time limit for the import of each plugin [s].
        only: Plugins to examine, each given as an entry point name, a distribution or ``distribution:name``. Defaults
            to all plugins. Name clashes are only detected among the examined plugins.
        on_probe: Function that is called with ``distribution:name`` after each plugin has been imported.
    """
    collection = plugins.active()
    words = set(only)
    candidates = [one for one in collection.candidates() if not words or words & {one.name, one.distribution, one.key}]

    def look(candidate: Candidate) -> Probe:
        outcome = probe(candidate, seconds)
        if on_probe is not None:
            on_probe(candidate.key)
        return outcome

    with ThreadPoolExecutor(max(1, (os.cpu_count() or 2) // 2)) as pool:  # each thread waits for its process
        probes = list(pool.map(look, candidates))
    offers: dict[tuple[str, str], list[Candidate]] = {}
    for candidate, seen in zip(candidates, probes, strict=True):
        for key in _names(seen):
            offers.setdefault(key, []).append(candidate)
    disabled = collection.disabled()
    return tuple(
        PluginFacts(
            name=candidate.name,
            distribution=candidate.distribution,
            version=candidate.version,
            module=candidate.value,
            made_for=core_versions(candidate.requirements),
            disabled=candidate.key in disabled,
            findings=tuple(_findings(candidate, seen, offers)),
            **vars(seen),
        )
        for candidate, seen in zip(candidates, probes, strict=True)
    )


def _names(seen: Probe) -> list[tuple[str, str]]:
    names = [(kind, name) for kind, offered in seen.records.items() for name in offered]
    return [*names, *(("environment ID", id) for id in seen.environment_ids)]


def _findings(
    candidate: Candidate, seen: Probe, offers: Mapping[tuple[str, str], Sequence[Candidate]]
) -> Iterable[Finding]:
    lacking = missing(candidate.requirements)
    if seen.state != "loaded":
        advice = _advice_for_failure(candidate, seen, lacking[0].command if lacking else "")
        yield Finding(seen.state, Severity.ERROR, "its import", seen.cause, advice)
    for one in lacking:
        there = f"version {one.installed} is installed" if one.installed else "the requirement is not installed"
        yield Finding("missing-requirement", Severity.ERROR, f"requirement '{one.requirement}'", there, one.command)
    made_for = core_versions(candidate.requirements)
    if not is_made_for(made_for, __version__):
        yield warning(
            "other-core",
            "versions",
            f"the plugin requires frobs-core {made_for}, but version {__version__} is installed",
            f"try to upgrade the plugin: pip install --upgrade {candidate.distribution}",
        )
    elif not made_for or not has_upper_bound(made_for):
        says = f"'frobs-core{made_for}'" if made_for else "any version of frobs-core"
        yield warning(
            "no-core-versions",
            "versions",
            f"the plugin's distribution requires {says}, without an upper bound",
            'the plugin\'s author should add an upper bound: dependencies = ["frobs-core>=0.3,<0.4"]',
        )
    yield from _clashes(candidate, seen, offers)
    yield from _import_effects(seen)


def _clashes(
    candidate: Candidate, seen: Probe, offers: Mapping[tuple[str, str], Sequence[Candidate]]
) -> Iterable[Finding]:
    for kind, name in _names(seen):
        others = [other for other in offers[kind, name] if other.key != candidate.key]
        if others:
            who = " and ".join(f"'{other.name}' of {other.distribution} {other.version}" for other in others)
            about, problem = f"{kind} '{name}'", f"another plugin also provides this name: {who}"
            if others[0].distribution == candidate.distribution:
                yield Finding("clash", Severity.ERROR, about, problem, "rename or remove one of the two records")
            else:
                advice = f"use the name '{candidate.distribution}:{name}', or uninstall one of the plugins"
                yield warning("clash", about, problem, advice)


def _import_effects(seen: Probe) -> Iterable[Finding]:
    heavy = [name for name in HEAVY if name in seen.modules]
    if heavy:
        yield warning(
            "heavy-import",
            "its import",
            f"importing the plugin also imports {', '.join(heavy)} ({seen.import_seconds:.1f} s), which slows down "
            "every 'import frobs_core'",
            "the plugin's author should move this import to a module that a record loads through its entry_point",
        )
    elif seen.state == "loaded" and seen.import_seconds > SLOW:
        yield warning(
            "slow-import",
            "its import",
            f"importing the plugin takes {seen.import_seconds:.1f} s",
            "the plugin's author should import fewer modules",
        )
    for stream, text in (("stdout", seen.stdout), ("stderr", seen.stderr)):
        if text.strip() and seen.state != "crashed":
            yield warning(
                "prints",
                stream,
                f"the plugin prints during its import: {text.strip().splitlines()[0][:100]}",
                "the plugin's author should remove the output, or log it from a module that a record loads through "
                "its entry_point",
            )
    for what in seen.changed:
        yield warning(
            "global-state",
            "its import",
            what if what.startswith("it ") else f"the plugin changes global state: the {what}",
            "the plugin's author should leave this change to the user, or move it to a module that a record loads "
            "through its entry_point",
        )
    for warned in seen.warnings:
        place = f"{PurePath(warned['file']).name}:{warned['line']}"
        problem = f"{warned['category']}: {warned['message']}"
        yield warning("deprecated", place, problem, "the plugin's author should follow the advice in the warning")


def _advice_for_failure(candidate: Candidate, seen: Probe, install: str) -> str:
    if seen.state == "hanging":
        return f"disable the plugin: FROBS_DISABLE_PLUGINS={candidate.key}"
    if install:
        return install
    if seen.missing_module:
        return (
            f"install the package that contains the module '{seen.missing_module}'; the plugin's distribution does "
            "not require it"
        )
    return (
        f"upgrade the plugin (pip install --upgrade {candidate.distribution}) or disable it "
        f"(FROBS_DISABLE_PLUGINS={candidate.key})"
    )
