"""Where model files and what they refer to are found, without ROS."""

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
_SCHEME = re.compile(r"^([A-Za-z][A-Za-z0-9+.-]+)://(.*)$", re.DOTALL)  # one letter is a Windows drive


def resolve_path(path: str | Path) -> Path:
    """Return the absolute path of a file or of ``"package:relative/path"`` inside an installed package.

    A file of that very name comes first, so paths with a colon work.

    Raises:
        ModelFileError: There is no such file or package; the message names what is near.
    """
    text = os.path.expanduser(path)
    if os.path.exists(text):
        return Path(text).resolve()
    package, colon, inside = text.partition(":")
    if colon and len(package) > 1 and all(part.isidentifier() for part in package.split(".")):
        try:
            base = Path(str(files(package)))
        except (ImportError, TypeError) as error:
            raise ModelFileError(text, f"the Python package '{package}' is not installed here.") from error
        if (base / inside).exists():
            return (base / inside).resolve()
        raise ModelFileError(base / inside, f"no such file in the package '{package}'.{_beside(base / inside)}")
    raise ModelFileError(text, f"no such file.{_beside(Path(text))}")


def _beside(path: Path) -> str:
    """Say what is in the nearest folder that exists, above a path that does not."""
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
    """ROS packages by name, found without ROS.

    Looked for in this order: the folders given; those of ``ROS_PACKAGE_PATH``, ``AMENT_PREFIX_PATH`` and
    ``GAZEBO_MODEL_PATH``; all folders below ``ROS_PACKAGE_PATH``; the folders above the model file that are named so or whose ``package.xml`` names them so,
    and the folders beside those. A folder above the file that is named so counts at any height; what is beside, and
    without such a name, up to the folder beside the package that holds the file.

    Args:
        given: Folder of each package by name; also ``"package:relative/path"`` of an installed Python package.
        file: The model file.
    """

    def __init__(self, given: Mapping[str, str | Path] | None, file: Path) -> None:
        self.given = dict(given or {})
        self.file = file

    def find(self, name: str) -> Path:
        """Return the folder of a package.

        Raises:
            ModelFileError: It is nowhere; the message names where it was looked for.
        """
        if name in self.given:
            folder = resolve_path(self.given[name])
            if not folder.is_dir():
                raise ModelFileError(folder, f"package_paths names it for '{name}', but it is no folder.")
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
        hint = f" Did you mean '{close}', which package_paths names?" if close else ""
        places = ", ".join(["package_paths", *map(str, searched), "the names of all folders above"])
        raise ModelFileError(
            self.file,
            f"the ROS package '{name}' is not found; say where it is with package_paths={{'{name}': FOLDER}} or "
            f"ROS_PACKAGE_PATH.{hint} Looked in: {places}.",
        )

    def _folders(self) -> list[Path]:
        """Folders that are packages or hold them, in the order in which they are searched."""
        folders = path_folders("ROS_PACKAGE_PATH")
        folders += [Path(p) / "share" for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p]
        folders += [Path(p) for p in os.environ.get("GAZEBO_MODEL_PATH", "").split(os.pathsep) if p]
        above = list(self.file.parents)
        roots = [i for i, folder in enumerate(above) if (folder / "package.xml").is_file()]
        depth = roots[0] + 2 if roots else 3  # without a package.xml: not up to the root of the disk
        return list(dict.fromkeys(folders + above[:depth]))

    @cached_property
    def _workspace(self) -> dict[str, Path]:
        """The packages below ``ROS_PACKAGE_PATH`` by name."""
        folders = [folder for root in path_folders("ROS_PACKAGE_PATH") for folder in packages_below(root)]
        return {package_name(folder): folder for folder in reversed(folders)}

    def resolve(self, uri: str, base: Path) -> Path:
        """Return the file that a model refers to.

        Args:
            uri: ``package://name/path``, ``model://name/path``, ``file:///path``, or a path.
            base: Folder that relative paths begin at.

        Raises:
            ModelFileError: It is not there, or the scheme is none of these.
        """
        match = _SCHEME.match(uri)
        if match is None:
            found = base / os.path.expanduser(uri)
        elif match[1] in ("package", "model"):
            package, _, inside = match[2].lstrip("/").partition("/")  # a third slash is a common slip
            found = self.find(package) / inside
        elif match[1] == "file":
            found = base / re.sub(r"^localhost(?=/)", "", match[2])
        else:
            raise ModelFileError(
                self.file, f"'{uri}': nothing is fetched by {match[1]}://; use package://, file:// or a path."
            )
        if not found.is_file():
            raise ModelFileError(self.file, f"the file '{uri}' is missing: looked for {found}.{_beside(found)}")
        return found.resolve()


def path_folders(variable: str) -> list[Path]:
    """Return the folders that a path variable of the environment lists."""
    return [Path(entry) for entry in os.environ.get(variable, "").split(os.pathsep) if entry]


def packages_below(root: Path) -> Iterator[Path]:
    """Yield each ROS package at or below a folder, as rospack finds them; folders inside a package are not searched."""
    for folder, below, names in os.walk(root, followlinks=True):
        if "package.xml" in names:
            yield Path(folder)
            below.clear()
        elif any(mark in names for mark in _NO_PACKAGES_BELOW):
            below.clear()
        else:
            below[:] = sorted(entry for entry in below if not entry.startswith("."))


def package_name(folder: Path) -> str:
    """Return the name that a folder's ``package.xml`` gives it, else its own."""
    try:
        text = read_limited(folder / "package.xml", _MAX_PACKAGE_BYTES).decode(errors="replace")
        match = _PACKAGE.search(text)
    except OSError:
        match = None
    return match[1] if match else folder.name
