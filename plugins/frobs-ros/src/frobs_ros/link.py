"""Links to ROS's modules in a virtual environment."""

from __future__ import annotations

import re
import shutil
import sys
import sysconfig
from dataclasses import dataclass
from importlib.machinery import PathFinder
from pathlib import Path

from frobs_core.errors import ConfigurationError
from frobs_ros.environment import DISTRIBUTION, PACKAGES, SYSTEM, find_ros
from frobs_ros.errors import RosNotFoundError
from frobs_ros.finder import IMPORTED, modules_of_ros

FOLDER, PTH = "frobs_ros_links", "frobs_ros_links.pth"


@dataclass(frozen=True)
class Links:
    """What was linked.

    Attributes:
        folder: That holds the links.
        source: The folder that they lead to.
        modules: Of ROS.
        borrowed: Of others, which ROS's modules import and the environment lacks.
    """

    folder: Path
    source: Path
    modules: tuple[str, ...]
    borrowed: tuple[str, ...]


def site_packages(venv: Path | None) -> Path:
    """Return the folder of a virtual environment's packages.

    Args:
        venv: The environment; None: the one that runs this.

    Raises:
        ConfigurationError: It is none, or one of another Python than ROS's modules can be linked into.
    """
    if venv is None:
        if sys.prefix == sys.base_prefix:
            raise ConfigurationError(
                "this Python runs in no virtual environment; say which with --venv PATH, or make one: python3 -m venv PATH"
            )
        return Path(sysconfig.get_paths()["purelib"])
    if not (venv / "pyvenv.cfg").is_file():
        raise ConfigurationError(f"{venv} is no virtual environment: it has no pyvenv.cfg.")
    found = sorted(venv.glob("lib/python3.*/site-packages"))
    if not found:
        raise ConfigurationError(f"{venv} has no folder lib/python3.*/site-packages.")
    return found[-1]


def link_modules(site: Path) -> Links:
    """Link ROS's modules into an environment; links that were there are made anew.

    Args:
        site: Its folder of packages.

    Raises:
        RosNotFoundError: ROS is not installed.
    """
    source = _source()
    folder = site / FOLDER
    unlink_modules(site)
    folder.mkdir()
    modules = modules_of_ros(source)
    borrowed = []
    for name in modules:
        (folder / name).symlink_to(source / name)
    for name in sorted(IMPORTED):
        found = _origin(name, [str(SYSTEM / "lib" / "python3" / "dist-packages"), str(source)])
        if found is not None and PathFinder.find_spec(name, [str(site), *_named(site)]) is None:
            (folder / found.name).symlink_to(found)
            borrowed.append(name)
    (site / PTH).write_text(f"{folder}\n")
    return Links(folder, source, tuple(modules), tuple(borrowed))


def unlink_modules(site: Path) -> bool:
    """Take the links of an environment away.

    Args:
        site: Its folder of packages.

    Returns:
        Whether there were any.
    """
    found = (site / PTH).exists() or (site / FOLDER).exists()
    (site / PTH).unlink(missing_ok=True)
    if (site / FOLDER).exists():
        shutil.rmtree(site / FOLDER)
    return found


def _source() -> Path:
    """Return where ROS's own modules are, past links of ours."""
    for prefix in (DISTRIBUTION, SYSTEM):
        modules = prefix / "lib" / "python3" / "dist-packages"
        if (modules / "rospy" / "__init__.py").is_file():
            return modules
    installation = find_ros()
    if installation is None:
        raise RosNotFoundError("no module 'rospy' is installed on this machine", PACKAGES)
    return installation.modules


def _origin(name: str, folders: list[str]) -> Path | None:
    """Return the folder or file of a top-level module."""
    spec = PathFinder.find_spec(name, folders)
    if spec is None or spec.origin is None:
        return None
    origin = Path(spec.origin)
    return origin.parent if spec.submodule_search_locations else origin


def _named(site: Path) -> list[str]:
    """Return the folders that an environment's .pth files name."""
    lines = [line.strip() for file in site.glob("*.pth") if file.name != PTH for line in file.read_text().splitlines()]
    return [line for line in lines if line and not re.match(r"#|import[ \t]", line) and Path(line).is_dir()]
