"""ROS packages by name: where ``rospack find`` finds them, without rospack."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from frobs_core.models import Packages, package_name
from frobs_ros.environment import find_ros
from frobs_ros.errors import PackageNotFoundError

_STOP = ("CATKIN_IGNORE", "AMENT_IGNORE", "rospack_nosubdirs")


def find_package(name: str) -> Path:
    """Return the folder of a ROS package.

    Looked for in the folders of ``ROS_PACKAGE_PATH`` and all below them, in the ``share`` folders of
    ``CMAKE_PREFIX_PATH``, and in that of ROS itself.

    Args:
        name: As ``package.xml`` gives it.

    Raises:
        PackageNotFoundError: There is none; the nearest name is suggested.
    """
    seen: dict[str, Path] = {}
    sources = _folders("ROS_PACKAGE_PATH")
    for root in sources:
        for folder in _crawl(root):
            found = package_name(folder)
            if found == name:
                return folder
            seen.setdefault(found, folder)
    shares = [prefix / "share" for prefix in _folders("CMAKE_PREFIX_PATH")]
    installation = find_ros()
    shares += [installation.share] if installation else []
    for share in shares:
        if (share / name / "package.xml").is_file():
            return share / name
    raise PackageNotFoundError(name, seen, dict.fromkeys([*sources, *shares]))


def find_file(package: str, folder: str, file: str) -> Path:
    """Return a file of a ROS package.

    Args:
        package: Its name.
        folder: Inside of it, with or without slashes around: ``"/urdf"``.
        file: Inside of that.

    Raises:
        PackageNotFoundError: There is no such package, or no such file in it.
    """
    path = find_package(package) / folder.strip("/") / file.lstrip("/")
    if path.is_file():
        return path
    beside = [entry.name for entry in path.parent.iterdir()] if path.parent.is_dir() else []
    raise PackageNotFoundError(package, beside, (), path)


class RosPackages(Packages):
    """Packages that a model file refers to: those of ROS first, then what stands around the file.

    Args:
        file: The model file.
    """

    def __init__(self, file: Path) -> None:
        super().__init__(None, file)

    def find(self, name: str) -> Path:
        """Return the folder of a package.

        Raises:
            ModelFileError: It is nowhere.
        """
        try:
            return find_package(name)
        except PackageNotFoundError:
            return super().find(name)


def _folders(variable: str) -> list[Path]:
    return [Path(entry) for entry in os.environ.get(variable, "").split(os.pathsep) if entry]


def _crawl(root: Path) -> Iterator[Path]:
    """Yield each package at or below a folder; what is inside of a package is not searched."""
    for folder, below, files in os.walk(root, followlinks=True):
        if "package.xml" in files:
            yield Path(folder)
            below.clear()
        elif any(mark in files for mark in _STOP):
            below.clear()
        else:
            below[:] = sorted(entry for entry in below if not entry.startswith("."))
