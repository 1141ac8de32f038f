"""Finds YAML files in packages."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

from frobs_cli.errors import MissingFileError
from frobs_core.util.errors import ConfigurationError, nearest

DEFAULT_PACKAGE = "frobs_rl"
"""Name of FRobs_RL's package, under which the default files are available even if the package is not installed."""

DEFAULTS = Path(__file__).parents[2] / "frobs_rl" / "config"
"""Folder of the default files."""


def find_config(package: str | None, filename: str | Path) -> Path:
    """Return the path of a YAML file, or raise a ConfigurationError that lists the existing files.

    Args:
        package: Name of a ROS package that contains the file in its ``config`` folder, or of a Python package that
            contains the file in its ``config`` folder or next to its modules. The default files are always available in
            the package ``"frobs_rl"``. If None, ``filename`` is a path.
        filename: Name of the file, or its absolute path, in which case ``package`` is ignored.
    """
    if package is None or Path(filename).is_absolute():
        path = Path(filename)
        if not path.is_file():
            raise MissingFileError(path, "pass the path of the YAML file, or a package and the name of the file")
        return path
    folders = [*_ros_folders(package), *_python_folders(package)]
    if package == DEFAULT_PACKAGE and DEFAULTS not in folders:
        folders.append(DEFAULTS)
    for folder in folders:
        if (folder / filename).is_file():
            return folder / filename
    if not folders:
        raise ConfigurationError(
            f"there is no Python package or ROS package named '{package}'; install the package, or pass a path: "
            "config_file_pkg=None, config_filename='path/to/file.yaml'."
        )
    there = sorted({path.name for folder in folders for path in folder.glob("*.y*ml")})
    places = " nor in ".join(str(folder) for folder in folders)
    raise missing(f"'{filename}' is not in {places}.", str(filename), there)


def missing(problem: str, name: str, there: Iterable[str]) -> ConfigurationError:
    """Return an error about a missing file that suggests the nearest of the available names and lists them."""
    available = list(there)
    similar = nearest(name, available)
    hint = f" Did you mean '{similar}'?" if similar else ""
    return ConfigurationError(f"{problem}{hint} Available: {', '.join(available) or 'none'}.")


def _ros_folders(package: str) -> list[Path]:
    """Return a list with the ``config`` folder of a ROS package. The list is empty if ROS or the package is missing."""
    try:
        import rospkg  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError:
        return []
    try:
        return [Path(rospkg.RosPack().get_path(package)) / "config"]
    except rospkg.ResourceNotFound:
        return []


def _python_folders(package: str) -> list[Path]:
    """Return the folders of a Python package without importing the package, because the import could require ROS."""
    try:
        spec = find_spec(package)
    except (ImportError, ValueError):
        return []
    roots = [Path(root) for root in (spec.submodule_search_locations or ())] if spec else []
    return [folder for root in roots for folder in (root / "config", root)]
