"""The program ``pip`` of a reader's environment: ``linked_pip.py FOLDER install [-e PATH | REQUIREMENT]...``.

Nothing is downloaded or copied: the distributions of this environment are linked into the other one, together with
everything that they require. A folder that several distributions share, such as ``google``, is linked as a whole.
Projects in a folder are installed by the real pip.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import sysconfig
import tomllib
from collections.abc import Iterable
from importlib.metadata import Distribution, distributions
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

CLONE = Path(__file__).parents[2]
"""The reader's clone of FRobs. A path that does not exist is relative to it."""

BUILD = ("pip", "hatchling", "editables")
"""Requirements of pip when it installs a project. A real pip downloads them into a temporary folder."""


def site_packages(folder: Path) -> Path:
    """Return the folder for the packages of a virtual environment."""
    return Path(sysconfig.get_path("purelib", vars={"base": str(folder)}))


def link(requirements: Iterable[str], site: Path, programs: Path | None = None) -> None:
    """Link distributions of this environment, and everything that they require, into another environment.

    Args:
        requirements: Requirements of the distributions.
        site: Folder for packages of the other environment.
        programs: Folder for programs of the other environment. If None, no programs are written.
    """
    site.mkdir(exist_ok=True)
    waiting = [Requirement(line) for line in requirements]
    seen = set()
    while waiting:
        requirement = waiting.pop()
        distribution = _find(requirement, site)
        record = distribution.read_text("RECORD") or ""
        for name in {re.split("[/,]", line)[0] for line in record.splitlines()} - {"..", "__pycache__"}:
            if not (site / name).exists():
                (site / name).symlink_to(str(distribution.locate_file(name)))
        for program in distribution.entry_points.select(group="console_scripts") if programs else ():
            code = f"import sys; from {program.module} import {program.attr} as main; sys.exit(main())"
            write_program(programs / program.name, f'exec "{programs / "python"}" -c "{code}" "$@"')
        for extra in {"", *requirement.extras}:
            if (key := (canonicalize_name(requirement.name), extra)) not in seen:
                seen.add(key)
                lines = map(Requirement, distribution.requires or ())
                waiting += [line for line in lines if not line.marker or line.marker.evaluate({"extra": extra})]


def _find(requirement: Requirement, site: Path) -> Distribution:
    for path in (str(site), *sys.path):
        for distribution in distributions(name=requirement.name, path=[path]):
            if requirement.specifier.contains(distribution.version, prereleases=True):
                return distribution
    raise SystemExit(f"ERROR: No matching distribution found for {requirement}")


def write_program(file: Path, text: str) -> None:
    """Write a shell script of one line."""
    file.unlink(missing_ok=True)
    file.write_text(f"#!/bin/sh\n{text}\n")
    file.chmod(0o755)


def install(folder: Path, arguments: list[str]) -> None:
    """Install projects and requirements into an environment, as ``pip install`` does.

    Args:
        folder: Folder of the environment.
        arguments: Arguments of ``pip install``. Paths are options of ``-e``.
    """
    requirements = []
    projects = []
    remaining = iter(arguments)
    for argument in remaining:
        if argument in ("-c", "--constraint", "--find-links"):
            next(remaining)
        elif argument == "-e":
            path, _, extras = next(remaining).partition("[")
            in_clone = not Path(path).exists()
            file = (CLONE if in_clone else Path()) / path / "pyproject.toml"
            table = tomllib.loads(file.read_text("utf-8"))["project"]
            requirements.append(f"{table['name']}{'[' + extras if extras else ''}")
            projects += [] if in_clone else ["-e", path]
        elif not argument.startswith("-"):
            requirements.append(argument)
    if projects:
        link(BUILD, folder / "build")
        pip = [folder / "bin" / "python", "-m", "pip", "install", "--quiet", "--no-deps", *projects]
        subprocess.run(pip, env={**os.environ, "PYTHONPATH": str(folder / "build")}, check=True)
    link(requirements, site_packages(folder), folder / "bin")


if __name__ == "__main__":
    folder, command, *arguments = sys.argv[1:]
    if command != "install":
        raise SystemExit(f"ERROR: only 'pip install' works here, not 'pip {command}'")
    install(Path(folder), arguments)
