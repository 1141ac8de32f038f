"""Location of model files and of the files that they refer to, without ROS."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from functools import cached_property
from importlib.resources import files
from pathlib import Path

from frobs_core.errors import ModelFileError, nearest
from frobs_core.files import read_limited

_PACKAGE = re.compile(r"<name>\s*([^<\s]+)\s*</name>")
_MAX_PACKAGE_BYTES = 2**20
_NO_PACKAGES_BELOW = ("CATKIN_IGNORE", "AMENT_IGNORE", "rospack_nosubdirs")
_SCHEME = re.compile(r"^([A-Za-z][A-Za-z0-9+.-]+)://(.*)$", re.DOTALL)  # a single letter is a Windows drive


def resolve_path(path: str | Path) -> Path:
    """Return the absolute path of a file or of ``"package:relative/path"`` inside an installed package.

    Existing files take precedence, so paths with a colon work.

    Raises:
        ModelFileError: The file or package does not exist. The message suggests similar names.
    """
    text = os.path.expanduser(path)
    if os.path.exists(text):
        return Path(text).resolve()
    package, colon, inside = text.partition(":")
    if colon and len(package) > 1 and all(part.isidentifier() for part in package.split(".")):
        try:
            base = Path(str(files(package)))
        except (ImportError, TypeError) as error:
            raise ModelFileError(text, f"the Python package '{package}' is not installed.") from error
        if (base / inside).exists():
            return (base / inside).resolve()
        raise ModelFileError(
            base / inside, f"the package '{package}' does not contain this file.{_beside(base / inside)}"
        )
    raise ModelFileError(text, f"the file does not exist.{_beside(Path(text))}")


def _beside(path: Path) -> str:
    """Describe the contents of the nearest existing folder above a missing path."""
    folder = path.absolute().parent
    while not folder.is_dir():
        path, folder = folder, folder.parent
    names = sorted(entry.name for entry in folder.iterdir())
    close = nearest(path.name, names)
    if close:
        return f" Did you mean '{folder / close}'?"
    shown = ", ".join(names[:10]) + (", …" if len(names) > 10 else "")
    return f" {folder} holds: {shown or 'nothing'}."


class Packages:
    """Locations of ROS packages by name, without ROS.

    The search order is: the given folders, the folders in ``ROS_PACKAGE_PATH``, ``AMENT_PREFIX_PATH`` and
    ``GAZEBO_MODEL_PATH``, the folders above the model file, all folders below ``ROS_PACKAGE_PATH``, and finally any
    folder above the model file that has the package's name. A folder in a path variable or above the model file may be
    the package itself or contain the package. The folders above the model file are searched up to the folder that
    contains the model file's package.

    Args:
        given: Folder of each package by name, or ``"package:relative/path"`` of an installed Python package.
        file: The model file.
    """

    def __init__(self, given: Mapping[str, str | Path] | None, file: Path) -> None:
        self.given = dict(given or {})
        self.file = file

    def find(self, name: str) -> Path:
        """Return the folder of a package.

        Raises:
            ModelFileError: The package is not found. The message lists the searched locations.
        """
        if name in self.given:
            folder = resolve_path(self.given[name])
            if not folder.is_dir():
                raise ModelFileError(folder, f"package_paths sets it for '{name}', but it is not a folder.")
            return folder
        searched = self._folders()
        for folder in searched:
            for candidate in (folder, folder / name):
                if candidate.is_dir() and package_name(candidate) == name:
                    return candidate
        if name in self._workspace:
            return self._workspace[name]
        for folder in self.file.parents:
            if folder.name == name:
                return folder
        close = nearest(name, self.given)
        hint = f" Did you mean '{close}', which is in package_paths?" if close else ""
        places = ", ".join(["package_paths", *map(str, searched), "the names of all parent folders"])
        raise ModelFileError(
            self.file,
            f"the ROS package '{name}' is not found; set its location with package_paths={{'{name}': FOLDER}} or "
            f"ROS_PACKAGE_PATH.{hint} Looked in: {places}.",
        )

    def _folders(self) -> list[Path]:
        """Folders that are packages or contain them, in search order."""
        folders = path_folders("ROS_PACKAGE_PATH")
        folders += [Path(p) / "share" for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p]
        folders += [Path(p) for p in os.environ.get("GAZEBO_MODEL_PATH", "").split(os.pathsep) if p]
        above = list(self.file.parents)
        roots = [i for i, folder in enumerate(above) if (folder / "package.xml").is_file()]
        depth = roots[0] + 2 if roots else 3  # without a package.xml, do not search up to the root of the disk
        return list(dict.fromkeys(folders + above[:depth]))

    @cached_property
    def _workspace(self) -> dict[str, Path]:
        """Packages below ``ROS_PACKAGE_PATH``, by name."""
        folders = [folder for root in path_folders("ROS_PACKAGE_PATH") for folder in packages_below(root)]
        return {package_name(folder): folder for folder in reversed(folders)}

    def resolve(self, uri: str, base: Path) -> Path:
        """Return the file that a model refers to.

        Args:
            uri: ``package://name/path``, ``model://name/path``, ``file:///path``, or a path.
            base: Folder that relative paths refer to.

        Raises:
            ModelFileError: The file does not exist, or the scheme is not supported.
        """
        match = _SCHEME.match(uri)
        if match is None:
            found = base / os.path.expanduser(uri)
        elif match[1] in ("package", "model"):
            package, _, inside = match[2].lstrip("/").partition("/")  # a third slash is a common mistake
            found = self.find(package) / inside
        elif match[1] == "file":
            found = base / re.sub(r"^localhost(?=/)", "", match[2])
        else:
            raise ModelFileError(
                self.file, f"'{uri}': {match[1]}:// is not supported; use package://, file:// or a path."
            )
        if not found.is_file():
            raise ModelFileError(self.file, f"the file '{uri}' is missing: {found} does not exist.{_beside(found)}")
        return found.resolve()


def path_folders(variable: str) -> list[Path]:
    """Return the folders in a path variable of the environment."""
    return [Path(entry) for entry in os.environ.get(variable, "").split(os.pathsep) if entry]


def packages_below(root: Path) -> Iterator[Path]:
    """Yield each ROS package at or below a folder. As in rospack, folders inside a package are not searched."""
    for folder, below, names in os.walk(root, followlinks=True):
        if "package.xml" in names:
            yield Path(folder)
            below.clear()
        elif any(mark in names for mark in _NO_PACKAGES_BELOW):
            below.clear()
        else:
            below[:] = sorted(entry for entry in below if not entry.startswith("."))


def package_name(folder: Path) -> str:
    """Return the package name in a folder's ``package.xml``, or the folder's name if the file does not define one."""
    try:
        text = read_limited(folder / "package.xml", _MAX_PACKAGE_BYTES).decode(errors="replace")
        match = _PACKAGE.search(text)
    except OSError:
        match = None
    return match[1] if match else folder.name
