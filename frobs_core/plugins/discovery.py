"""Reads the entry points of distributions, and the versions of the core that they support, without importing anything."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.metadata import Distribution

GROUP = "frobs"
"""Entry-point group of plugin modules."""

_CORE_LINE = re.compile(r"^\s*frobs[-_.]core(?![\w.-])\s*(?:\[[^\]]*\])?\s*\(?([^;)]*)\)?", re.IGNORECASE)


@dataclass(frozen=True)
class Candidate:
    """A plugin's entry point, before the plugin is imported.

    Attributes:
        name: The entry point's name.
        distribution: Name of the pip package that contains the entry point.
        version: Version of the distribution.
        value: Value of the entry point.
        problem: Reason why the plugin cannot be imported, or an empty string if it can be imported.
        requirements: Requirements listed in the distribution's metadata.
    """

    name: str
    distribution: str
    version: str
    value: str
    problem: str = ""
    requirements: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """``"distribution:name"``, which is unique."""
        return f"{self.distribution}:{self.name}"

    @property
    def origin(self) -> str:
        """The distribution with its version, such as ``"frobs-robots-abb 0.1.0"``."""
        return f"{self.distribution} {self.version}"

    @property
    def made_for(self) -> str:
        """Versions of the core that the distribution requires, or empty if not specified; see :func:`core_versions`."""
        return core_versions(self.requirements)


def normalize(distribution: str) -> str:
    """Return a distribution's name in pip's normalized spelling."""
    return re.sub(r"[-_.]+", "-", distribution).lower()


def find_candidates(distributions: Iterable[Distribution]) -> list[Candidate]:
    """Return all plugin entry points, sorted by distribution and name.

    If a distribution is found twice, the first occurrence is used, as in an ``import`` statement.
    """
    found: dict[str, list[Candidate]] = {}
    for distribution in distributions:
        text = _read_entry_points(distribution)
        if GROUP not in text:  # avoids reading the metadata of all other distributions
            continue
        candidates = list(_candidates(distribution, text))
        if candidates:
            found.setdefault(normalize(candidates[0].distribution), candidates)
    return sorted((c for group in found.values() for c in group), key=lambda c: (normalize(c.distribution), c.name))


def match_disabled(candidates: Iterable[Candidate], disabled: Iterable[str]) -> tuple[set[str], list[str]]:
    """Match entry point names, distribution names or ``distribution:name`` against candidates.

    Returns:
        The keys of the matching candidates, and the words that do not match any candidate.
    """
    keys: dict[str, set[str]] = {}
    for candidate in candidates:
        distribution = normalize(candidate.distribution)
        for word in (candidate.name, distribution, f"{distribution}:{candidate.name}"):
            keys.setdefault(word, set()).add(candidate.key)
    hit: set[str] = set()
    unknown = []
    for word in disabled:
        distribution, colon, name = word.rpartition(":")
        spellings = {f"{normalize(distribution)}:{name}"} if colon else {word, normalize(word)}
        meant = set().union(*(keys.get(spelling, set()) for spelling in spellings))
        hit |= meant
        if not meant:
            unknown.append(word)
    return hit, unknown


def core_versions(requirements: Iterable[str]) -> str:
    """Return the core versions that a distribution supports, such as ``">=0.3,<0.4"``, or ``""`` if not specified.

    Args:
        requirements: Requirements of the distribution, as in its metadata.
    """
    for line in requirements:
        found = _CORE_LINE.match(line)
        if found:
            return found[1].replace(" ", "").strip()
    return ""


def is_made_for(specifier: str, version: str) -> bool:
    """Return whether ``specifier``, as from :func:`core_versions`, includes a version of the core."""
    if not specifier:
        return True
    from packaging.specifiers import InvalidSpecifier, SpecifierSet

    try:
        return SpecifierSet(specifier).contains(version, prereleases=True)
    except InvalidSpecifier:  # pip does not install a distribution with an invalid specifier
        return True


def _read_entry_points(distribution: Distribution) -> str:
    try:
        return distribution.read_text("entry_points.txt") or ""
    except (OSError, UnicodeDecodeError):  # ignore unrelated distributions with damaged files
        return ""


def _candidates(distribution: Distribution, text: str) -> Iterator[Candidate]:
    try:
        metadata = distribution.metadata
        name = metadata["Name"] or "(unnamed distribution)"
        version = metadata["Version"] or "(no version)"
        requirements = tuple(metadata.get_all("Requires-Dist") or ())
    except Exception:  # a damaged METADATA file can cause any exception in the standard library
        name, version, requirements = "(unnamed distribution)", "(no version)", ()
    try:
        points = list(distribution.entry_points.select(group=GROUP))
    except Exception as error:
        if re.search(rf"^\s*\[\s*{GROUP}\s*\]", text, re.MULTILINE):
            yield Candidate("entry_points.txt", name, version, "", f"entry_points.txt cannot be read: {error}")
        return
    seen: set[str] = set()
    for point in points:
        problem = f"the distribution has two entry points named '{point.name}'" if point.name in seen else ""
        seen.add(point.name)
        yield Candidate(point.name, name, version, point.value, problem, requirements)
