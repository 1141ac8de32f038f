"""What a wheel and an sdist of this repository must contain before they may be published."""

from __future__ import annotations

import re
import tarfile
import zipfile
from collections.abc import Iterator
from email import message_from_bytes
from email.message import Message
from pathlib import Path, PurePosixPath

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.version import Version

LICENSE = (Path(__file__).parents[1] / "LICENSE").read_bytes()
AUTHOR = "The FRobs authors"
OLDEST_METADATA = Version("2.4")
"""The first version of the metadata with license expressions and license files."""

EXACT = {
    ("frobs-algos-sbx", "frobs-algos-sb3"),
    ("frobs-data", "frobs-train"),
    ("frobs-ray", "frobs-train"),
    ("frobs-rl-compat", "frobs-algos-sb3"),
    ("frobs-rl-compat", "frobs-ros"),
}
"""Distributions that require exactly their own version of another; ``docs/explanation/api-stability.md`` has the reason."""

IN_SDIST = {
    "PKG-INFO",
    "LICENSE",
    "README.md",
    "CHANGELOG.md",
    "pyproject.toml",
    "hatch_build.py",
    ".gitignore",
    "src",
    "tools",
    "frobs_core",
}
"""Names that the top folder of an sdist may contain."""

_RELATIVE_LINK = re.compile(r"\]\((?!https?://|mailto:|#)([^)\s]+)\)|(?:src|href)=\"(?!https?://|mailto:|#)([^\"]+)\"")


def metadata(wheel: Path) -> Message:
    """Return the metadata of a wheel."""
    with zipfile.ZipFile(wheel) as archive:
        return message_from_bytes(archive.read(f"{_dist_info(wheel)}/METADATA"))


def problems(wheel: Path, sdist: Path) -> list[str]:
    """Return one line for each thing that is wrong with the wheel or the sdist of a distribution."""
    return [f"{wheel.name}: {line}" for line in _wheel(wheel)] + [f"{sdist.name}: {line}" for line in _sdist(sdist)]


def _wheel(wheel: Path) -> Iterator[str]:
    facts = metadata(wheel)
    yield from _metadata(facts)
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        license_file = f"{_dist_info(wheel)}/licenses/LICENSE"
        if license_file not in names or archive.read(license_file) != LICENSE:
            yield "the license file is missing or differs from the one of the repository"
    packages = {name.partition("/")[0] for name in names} - {_dist_info(wheel)}
    foreign = {name for name in packages if "frobs" not in name}
    if foreign:
        yield f"foreign files: {sorted(foreign)}"
    untyped = {package for package in packages if f"{package}/py.typed" not in names}
    if untyped:
        yield f"py.typed is missing in {sorted(untyped)}"
    if bool(packages) != ("Typing :: Typed" in facts.get_all("Classifier", [])):
        yield "the classifier 'Typing :: Typed' is for distributions with code, and only for them"


def _sdist(sdist: Path) -> Iterator[str]:
    folder = sdist.name.removesuffix(".tar.gz")
    with tarfile.open(sdist) as archive:
        paths = [PurePosixPath(name) for name in archive.getnames()]
        foreign = {path.parts[1] for path in paths} - IN_SDIST
        if foreign:
            yield f"foreign files: {sorted(foreign)}"
        if any("__pycache__" in path.parts for path in paths):
            yield "it contains bytecode"
        license_file = archive.extractfile(f"{folder}/LICENSE") if PurePosixPath(folder, "LICENSE") in paths else None
        if license_file is None or license_file.read() != LICENSE:
            yield "the license file is missing or differs from the one of the repository"


def _metadata(facts: Message) -> Iterator[str]:
    classifiers = facts.get_all("Classifier", [])
    if Version(facts["Metadata-Version"]) < OLDEST_METADATA:
        yield f"metadata version {facts['Metadata-Version']} has no license expression; build with hatchling >= 1.27"
    if facts["License-Expression"] != "MIT" or facts.get_all("License-File") != ["LICENSE"]:
        yield "the metadata must name the license MIT and the license file LICENSE"
    if any(classifier.startswith("License ::") for classifier in classifiers):
        yield "a classifier must not repeat the license expression"
    if facts["Author"] != AUTHOR:
        yield f"the author must be '{AUTHOR}'"
    for prefix in (
        "Development Status ::",
        "Operating System ::",
        "Programming Language :: Python :: 3.11",
        "Topic ::",
    ):
        if not any(classifier.startswith(prefix) for classifier in classifiers):
            yield f"no classifier begins with '{prefix}'"
    if not facts["Keywords"] or not facts["Summary"]:
        yield "the summary or the keywords are missing"
    text = str(facts.get_payload())
    if facts["Description-Content-Type"] != "text/markdown" or not text.strip():
        yield "the description is missing, or is not Markdown"
    relative = [a or b for a, b in _RELATIVE_LINK.findall(text)]
    if relative:
        yield f"the description has relative links, which are broken on a package index: {relative}"
    yield from _bounds(facts)


def _bounds(facts: Message) -> Iterator[str]:
    """Compare the bounds of the requirements on other distributions of FRobs with the version of this one."""
    version = Version(facts["Version"])
    usual = SpecifierSet(f">={version.major}.{version.minor},<{version.major}.{version.minor + 1}")
    for line in facts.get_all("Requires-Dist", []):
        requirement = Requirement(line)
        if "frobs" in requirement.name:
            exact = (facts["Name"], requirement.name) in EXACT
            bounds = SpecifierSet(f"=={version}") if exact else usual
            if requirement.specifier != bounds:
                yield f"it requires '{line}', but the bounds must be '{bounds}'"


def _dist_info(wheel: Path) -> str:
    return "-".join(wheel.name.split("-")[:2]) + ".dist-info"
