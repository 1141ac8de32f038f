"""What a distribution says that it needs, in the metadata that pip installs by: it cannot say one thing and do another."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from frobs_core.install_hints import local_install_hint

_CORE_LINE = re.compile(r"^\s*frobs[-_.]core(?![\w.-])\s*(?:\[[^\]]*\])?\s*\(?([^;)]*)\)?", re.IGNORECASE)


@dataclass(frozen=True)
class Missing:
    """A requirement that is not met.

    Attributes:
        requirement: As the distribution states it: ``"mujoco>=4.0"``.
        installed: The version that there is, or ``""``.
    """

    requirement: str
    installed: str

    @property
    def command(self) -> str:
        """What installs it."""
        if self.installed:
            return f"pip install --upgrade '{self.requirement}'"
        return local_install_hint(f"pip install '{self.requirement}'")


def core_versions(requirements: Iterable[str]) -> str:
    """Return the versions of the core that a distribution is made for: ``">=0.2,<0.3"``; empty where it says nothing."""
    for line in requirements:
        found = _CORE_LINE.match(line)
        if found:
            return found[1].replace(" ", "").strip()
    return ""


def is_made_for(specifier: str, version: str) -> bool:
    """Return whether a version of the core is among those that a distribution is made for."""
    if not specifier:
        return True
    from packaging.specifiers import InvalidSpecifier, SpecifierSet

    try:
        return SpecifierSet(specifier).contains(version, prereleases=True)
    except InvalidSpecifier:  # pip would not have installed it either
        return True


def has_upper_bound(specifier: str) -> bool:
    """Return whether some later version is excluded."""
    return not is_made_for(specifier, "9999999")


def missing(requirements: Iterable[str]) -> list[Missing]:
    """Return the requirements that are not met here, extras left out."""
    from importlib.metadata import PackageNotFoundError, version

    from packaging.requirements import InvalidRequirement, Requirement

    found = []
    for line in requirements:
        try:
            wanted = Requirement(line)
        except InvalidRequirement:
            continue
        if wanted.marker is not None and not wanted.marker.evaluate({"extra": ""}):
            continue
        try:
            there = version(wanted.name)
        except PackageNotFoundError:
            there = ""
        if not there or not wanted.specifier.contains(there, prereleases=True):
            found.append(Missing(f"{wanted.name}{_extras(wanted.extras)}{wanted.specifier}", there))
    return found


def _extras(names: Iterable[str]) -> str:
    text = ",".join(sorted(names))
    return f"[{text}]" if text else ""
