"""Finds ROS packages by name, like ``rospack find``, but without rospack."""

from __future__ import annotations

import os
from pathlib import Path

from frobs_models import Packages, package_name, packages_below, path_folders
from frobs_ros.errors import PackageNotFoundError
from frobs_ros.ros.environment import find_ros


def find_package(name: str) -> Path:
    """Return the folder of a ROS package.

    The search covers the folders in ``ROS_PACKAGE_PATH`` and all their subfolders, the ``share`` folders of the
    prefixes in ``CMAKE_PREFIX_PATH``, and ROS's own ``share`` folder.

    Raises:
        PackageNotFoundError: The package does not exist. The error message suggests the closest match.
    """
    seen: dict[str, Path] = {}
    sources = path_folders("ROS_PACKAGE_PATH")
    for root in sources:
        for folder in packages_below(root):
            package = package_name(folder)
            if package == name:
                return folder
            seen.setdefault(package, folder)
    shares = [prefix / "share" for prefix in _prefixes()]
    for share in shares:
        if (share / name / "package.xml").is_file():
            return share / name
    raise PackageNotFoundError(name, seen, dict.fromkeys([*sources, *shares]))


def _prefixes() -> list[Path]:
    installation = find_ros()
    return [*path_folders("CMAKE_PREFIX_PATH"), *([installation.prefix] if installation else [])]


def find_file(package: str, folder: str, file: str) -> Path:
    """Return the path of a file in a ROS package.

    Raises:
        PackageNotFoundError: The package does not exist, or does not contain the file.
    """
    path = find_package(package) / folder.strip("/") / file.lstrip("/")
    if path.is_file():
        return path
    beside = [entry.name for entry in path.parent.iterdir()] if path.parent.is_dir() else []
    raise PackageNotFoundError(package, beside, (), path)


def find_anywhere(package: str, folder: str, file: str, suffix: str) -> Path:
    """Find a file in a ROS package: in the given folder, by its path in the package, or by name in any subfolder."""
    root = find_package(package)
    for path in (root / folder / file, root / file, *sorted(root.rglob(Path(file).name))):
        if path.is_file():
            return path
    available = [path.name for path in root.rglob(f"*{suffix}")]
    raise PackageNotFoundError(package, available, (), root / folder / file)


def find_node(package: str, node: str) -> Path:
    """Return the path of the program that ``rosrun PACKAGE NODE`` would run.

    Raises:
        PackageNotFoundError: The package or the program does not exist. The error message lists alternatives.
    """
    folder = find_package(package)
    places = [prefix / "lib" / package for prefix in _prefixes()] + [folder]
    programs = {
        path.name: path
        for place in reversed(places)
        for path in sorted(place.rglob("*"), reverse=True)
        if path.is_file() and os.access(path, os.X_OK)
    }
    if node not in programs:
        raise PackageNotFoundError(package, programs, places, folder / node)
    return programs[node]


class RosPackages(Packages):
    """Finds packages that a model file refers to, first among the ROS packages, then in folders near the file."""

    def __init__(self, file: Path) -> None:
        super().__init__(None, file)

    def find(self, name: str) -> Path:
        try:
            return find_package(name)
        except PackageNotFoundError:
            return super().find(name)
