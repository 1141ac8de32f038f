"""Finds model files and the files that they reference. ROS is not required."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from functools import cached_property
from importlib.resources import files
from pathlib import Path
from urllib.parse import unquote

from frobs_core.util.errors import ModelFileError, nearest
from frobs_core.util.files import read_limited
from frobs_models.xmltree import parse_xml

_MAX_PACKAGE_BYTES = 2**20
_NO_PACKAGES_BELOW = ("CATKIN_IGNORE", "AMENT_IGNORE", "rospack_nosubdirs")
_SCHEME = re.compile(r"^([A-Za-z][A-Za-z0-9+.-]+)://(.*)$", re.DOTALL)  # a single letter is a Windows drive


def resolve_path(path: str | Path) -> Path:
    """Return the absolute path of a file.

    The argument can also be ``"package:relative/path"`` for a file in an installed Python package. An existing file
    takes precedence over a package, so file paths may contain a colon.

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
            base / inside, f"the Python package '{package}' does not contain this file.{_beside(base / inside)}"
        )
    raise ModelFileError(text, f"the file does not exist.{_beside(Path(text))}")


def _beside(path: Path) -> str:
    """Suggest a similar name for a missing path, or list the files of its kind in the folder that should contain it."""
    kind = path.suffix.lower()
    folder = path.absolute().parent
    missing = None
    while not folder.is_dir():
        path, folder, missing = folder, folder.parent, folder
    names = sorted(entry.name for entry in folder.iterdir())
    close = nearest(path.name, names)
    if close:
        return f" Did you mean '{folder / close}'?"
    if missing is not None:
        return f" There is no folder {missing}."
    alike = [name for name in names if os.path.splitext(name)[1].lower() == kind]
    shown = ", ".join(alike[:10]) + (", …" if len(alike) > 10 else "")
    return f" {folder} contains {shown or 'no other file of this kind'}."


class Packages:
    """Finds ROS packages by name. A ROS installation is not required.

    The following locations are searched in order:

    1. the folders in ``given``,
    2. the folders in ``ROS_PACKAGE_PATH``, ``AMENT_PREFIX_PATH`` and ``GAZEBO_MODEL_PATH``,
    3. the folders above the model file,
    4. all folders below ``ROS_PACKAGE_PATH``,
    5. any folder above the model file that has the package's name.

    In steps 2 and 3, a folder can be the package itself or the package's parent folder. If the model file belongs to a
    package, step 3 ends at the parent folder of that package. Otherwise, step 3 searches only the three nearest
    folders.

    Args:
        given: Folder of each package, by package name. A folder in an installed Python package can be specified as
            ``"package:relative/path"``.
        file: The model file.
    """

    def __init__(self, given: Mapping[str, str | Path] | None, file: Path) -> None:
        self.given = dict(given or {})
        self.file = file

    def find(self, name: str) -> Path:
        """Return the folder of the package ``name``.

        Raises:
            ModelFileError: The package is not found. The error message lists the searched locations.
        """
        if name in self.given:
            folder = resolve_path(self.given[name])
            if not folder.is_dir():
                raise ModelFileError(
                    folder,
                    f"package_paths sets the location of the package '{name}' to this path, which is not a folder.",
                )
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
        places = ", ".join(["package_paths", *map(str, searched), "and any folder of this name above the model file"])
        raise ModelFileError(
            self.file,
            f"the ROS package '{name}' is not found; set its location with package_paths={{'{name}': FOLDER}} or "
            f"ROS_PACKAGE_PATH.{hint} Looked in: {places}.",
        )

    def _folders(self) -> list[Path]:
        """Return the folders that may be packages or contain packages, in search order."""
        folders = path_folders("ROS_PACKAGE_PATH")
        folders += [Path(p) / "share" for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p]
        folders += [Path(p) for p in os.environ.get("GAZEBO_MODEL_PATH", "").split(os.pathsep) if p]
        above = list(self.file.parents)
        roots = [i for i, folder in enumerate(above) if (folder / "package.xml").is_file()]
        depth = roots[0] + 2 if roots else 3  # without a package.xml, search only three folders
        return list(dict.fromkeys(folders + above[:depth]))

    @cached_property
    def _workspace(self) -> dict[str, Path]:
        """Folders of all packages below ``ROS_PACKAGE_PATH``, by package name."""
        folders = [folder for root in path_folders("ROS_PACKAGE_PATH") for folder in packages_below(root)]
        return {package_name(folder): folder for folder in reversed(folders)}

    def resolve(self, uri: str, base: Path) -> Path:
        """Return the path of a file that a model references.

        Args:
            uri: ``package://name/path``, ``model://name/path``, ``file:///path``, or a path.
            base: Folder for resolving relative paths.

        Raises:
            ModelFileError: The file does not exist, or the scheme is not supported.
        """
        file = self._locate(uri, base)
        if not file.is_file():
            raise ModelFileError(self.file, f"the file '{uri}' is missing: {file} does not exist.{_beside(file)}")
        return file.resolve()

    def missing(self, uri: str, base: Path) -> Path | None:
        """Return where the file ``uri`` of a model should be, or None if it exists or its package is unknown."""
        try:
            file = self._locate(uri, base)
        except ModelFileError:
            return None
        return None if file.exists() else file

    def _locate(self, uri: str, base: Path) -> Path:
        """Return where a file should be: the first place that has it, as the name is written or in another notation."""
        notations = dict.fromkeys((uri, uri.replace("\\", "/")))  # separators of Windows
        if "://" in uri:
            notations |= dict.fromkeys(unquote(notation) for notation in tuple(notations))
        places = []
        errors = []
        for notation in notations:
            try:
                places.append(self._place(notation, base))
            except ModelFileError as error:
                errors.append(error)
        if not places:
            raise errors[0]
        return next((place for place in places if place.is_file()), None) or self._moved(places[-1]) or places[0]

    def _place(self, uri: str, base: Path) -> Path:
        match = _SCHEME.match(uri)
        if match is None:
            return base / os.path.expanduser(uri)
        if match[1] in ("package", "model"):
            package, _, inside = match[2].lstrip("/").partition("/")  # a third slash is a common mistake
            return self.find(package) / inside
        if match[1] == "file":
            return base / re.sub(r"^localhost(?=/)", "", match[2])
        raise ModelFileError(
            self.file, f"the scheme {match[1]}:// of '{uri}' is not supported; use package://, file:// or a path."
        )

    def _moved(self, path: Path) -> Path | None:
        """Return the file of a package that was installed elsewhere, for a path on the machine of the file's author."""
        for i, part in reversed(list(enumerate(path.parts[:-1]))):
            if part in self.given or (i > 0 and path.parts[i - 1] == "share"):
                try:
                    candidate = self.find(part).joinpath(*path.parts[i + 1 :])
                except ModelFileError:
                    continue
                if candidate.is_file():
                    return candidate
        return None


def path_folders(variable: str) -> list[Path]:
    """Return the folders listed in an environment variable such as ``ROS_PACKAGE_PATH``."""
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
    file = folder / "package.xml"
    try:
        name = parse_xml(read_limited(file, _MAX_PACKAGE_BYTES), file).child("name")
    except (OSError, ModelFileError):
        return folder.name
    return ((name.text or "").strip() if name is not None else "") or folder.name
