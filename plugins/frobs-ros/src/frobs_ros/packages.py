"""Finds ROS packages by name like ``rospack find``, without rospack."""

from __future__ import annotations

from pathlib import Path

from frobs_core.models import Packages, package_name, packages_below, path_folders
from frobs_ros.environment import find_ros
from frobs_ros.errors import PackageNotFoundError


def find_package(name: str) -> Path:
    """Return the folder of a ROS package.

    It searches the folders of ``ROS_PACKAGE_PATH`` and all folders below them, the ``share`` folders of
    ``CMAKE_PREFIX_PATH``, and the ``share`` folder of ROS itself.

    Raises:
        PackageNotFoundError: The package does not exist; the nearest name is suggested.
    """
    seen: dict[str, Path] = {}
    sources = path_folders("ROS_PACKAGE_PATH")
    for root in sources:
        for folder in packages_below(root):
            found = package_name(folder)
            if found == name:
                return folder
            seen.setdefault(found, folder)
    shares = [prefix / "share" for prefix in path_folders("CMAKE_PREFIX_PATH")]
    installation = find_ros()
    shares += [installation.share] if installation else []
    for share in shares:
        if (share / name / "package.xml").is_file():
            return share / name
    raise PackageNotFoundError(name, seen, dict.fromkeys([*sources, *shares]))


def find_file(package: str, folder: str, file: str) -> Path:
    """Return a file of a ROS package.

    Raises:
        PackageNotFoundError: The package or the file in it does not exist.
    """
    path = find_package(package) / folder.strip("/") / file.lstrip("/")
    if path.is_file():
        return path
    beside = [entry.name for entry in path.parent.iterdir()] if path.parent.is_dir() else []
    raise PackageNotFoundError(package, beside, (), path)


def find_anywhere(package: str, folder: str, file: str, suffix: str) -> Path:
    """Return a file of a ROS package: in its folder ``folder``, by its path in the package, or anywhere below it.

    Raises:
        PackageNotFoundError: The package or file does not exist; suggests files with the suffix.
    """
    root = find_package(package)
    for path in (root / folder / file, root / file, *sorted(root.rglob(Path(file).name))):
        if path.is_file():
            return path
    available = [path.name for path in root.rglob(f"*{suffix}")]
    raise PackageNotFoundError(package, available, (), root / folder / file)


class RosPackages(Packages):
    """Packages that a model file refers to: those of ROS first, then those in folders around the file."""

    def __init__(self, file: Path) -> None:
        super().__init__(None, file)

    def find(self, name: str) -> Path:
        """Return the folder of a package.

        Raises:
            ModelFileError: The package is not found.
        """
        try:
            return find_package(name)
        except PackageNotFoundError:
            return super().find(name)
