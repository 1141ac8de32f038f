"""Requirements of a distribution that are not met, read from the same metadata that pip uses."""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass

from frobs_core.plugins import is_made_for
from frobs_core.util.install_hints import local_install_hint


@dataclass(frozen=True)
class Missing:
    """A requirement that is not met."""

    requirement: str  # as in the distribution's metadata, such as "mujoco>=4.0"
    installed: str  # installed version, or ""

    @property
    def command(self) -> str:
        """Command that installs the required version."""
        if self.installed:
            return f"pip install --upgrade '{self.requirement}'"
        return local_install_hint(f"pip install '{self.requirement}'")


def has_upper_bound(specifier: str) -> bool:
    """Return whether a version specifier has an upper bound."""
    return not is_made_for(specifier, "9999999")


def missing(requirements: Iterable[str]) -> list[Missing]:
    """Return the requirements that are not met, ignoring requirements that belong to extras."""
    from importlib.metadata import PackageNotFoundError, version

    from packaging.requirements import InvalidRequirement, Requirement

    unmet = []
    for line in requirements:
        try:
            requirement = Requirement(line)
        except InvalidRequirement:
            continue
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": ""}):
            continue
        try:
            installed = version(requirement.name)
        except PackageNotFoundError:
            installed = ""
        if not installed or not requirement.specifier.contains(installed, prereleases=True):
            extras = f"[{','.join(sorted(requirement.extras))}]" if requirement.extras else ""
            unmet.append(Missing(f"{requirement.name}{extras}{requirement.specifier}", installed))
    return unmet


def required_versions(distribution: str) -> dict[str, str]:
    """Return the installed version of each requirement of a distribution, except requirements that belong to extras."""
    from importlib.metadata import PackageNotFoundError, requires, version

    versions = {}
    for line in requires(distribution) or ():
        if "extra ==" not in line:
            name = re.split(r"[^\w.-]", line)[0]
            with suppress(PackageNotFoundError):
                versions[name] = version(name)
    return versions
