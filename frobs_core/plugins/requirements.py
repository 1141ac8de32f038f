"""Versions of the core that a distribution supports, read from the same metadata that pip uses."""

from __future__ import annotations

import re
from collections.abc import Iterable

_CORE_LINE = re.compile(r"^\s*frobs[-_.]core(?![\w.-])\s*(?:\[[^\]]*\])?\s*\(?([^;)]*)\)?", re.IGNORECASE)


def core_versions(requirements: Iterable[str]) -> str:
    """Return the core versions that a distribution supports, such as ``">=0.3,<0.4"``, or ``""`` if not specified."""
    for line in requirements:
        found = _CORE_LINE.match(line)
        if found:
            return found[1].replace(" ", "").strip()
    return ""


def is_made_for(specifier: str, version: str) -> bool:
    """Return whether a distribution supports a version of the core."""
    if not specifier:
        return True
    from packaging.specifiers import InvalidSpecifier, SpecifierSet

    try:
        return SpecifierSet(specifier).contains(version, prereleases=True)
    except InvalidSpecifier:  # pip does not install a distribution with an invalid specifier
        return True
