"""Folders with links to ROS's Python modules, without other modules of the system.

Debian keeps ROS's modules in one folder with its own NumPy, PyYAML and many others. Adding that folder to ``sys.path``
would mix them with those of a virtual environment, so an overlay contains only links to ROS's modules. It excludes
every module that the environment already has, so its position on the path does not matter.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from importlib.machinery import PathFinder
from pathlib import Path

from frobs_core.files import cache_folder
from frobs_ros.errors import RosNotFoundError

_KEPT = 60 * 24 * 3600.0  # [s]

LIBRARIES = frozenset([
    "actionlib", "catkin", "dynamic_reconfigure", "genmsg", "genpy", "joint_state_publisher", "laser_geometry",
    "message_filters", "moveit_commander", "moveit_ros_planning_interface", "rosbag", "rosclean", "rosgraph", "roslaunch", "roslib", "roslz4", "rosmaster", "rosmsg",
    "rosnode", "rosparam", "rospy", "rosservice", "rostopic", "rosunit", "roswtf", "tf", "tf2_geometry_msgs",
    "tf2_kdl", "tf2_py", "tf2_ros", "tf_conversions",
])  # fmt: skip
"""Python modules of ROS that are not message packages."""

IMPORTED = frozenset(
    ["Cryptodome", "catkin_pkg", "defusedxml", "distro", "docutils", "gnupg", "netifaces", "pyparsing", "rospkg"]
)
"""Modules from other projects that ROS's modules import."""


def make_overlay(links: Mapping[str, Path]) -> Path:
    """Return a folder with these links. The same links always give the same folder, which is created atomically.

    Args:
        links: Target of each link, by file name in the folder.

    Raises:
        RosNotFoundError: The cache folder cannot be written.
    """
    key = "\0".join(f"{name}\0{target}" for name, target in sorted(links.items()))
    folder = cache_folder("ros") / hashlib.sha256(os.fsencode(key)).hexdigest()[:20]
    if folder.is_dir():
        delete_unused(folder)
        return folder
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        made = Path(tempfile.mkdtemp(prefix=".new-", dir=folder.parent))
        for name, target in links.items():
            (made / name).symlink_to(target)
        try:
            made.rename(folder)
        except OSError:
            shutil.rmtree(made)
            if not folder.is_dir():  # no other process created it: the cache cannot be used
                raise
    except OSError as error:
        raise RosNotFoundError(
            f"links to its modules cannot be made in {folder.parent}: {error.strerror}; set XDG_CACHE_HOME to a folder "
            "that you can write to"
        ) from error
    return folder


def delete_unused(folder: Path) -> None:
    """Mark a folder of the cache as used, and delete its neighbors that were not used for 60 days."""
    with contextlib.suppress(OSError):
        os.utime(folder)
        for other in folder.parent.iterdir():
            if other.stat().st_mtime < time.time() - _KEPT:
                shutil.rmtree(other)


def links_to_modules(folders: Sequence[Path]) -> dict[str, Path]:
    """Return links to all ROS modules that the environment does not have, and to the modules that they import.

    Args:
        folders: Folders to search; the first one with a module is used.
    """
    found: dict[str, Path] = {}
    for folder in reversed(dict.fromkeys(filter(Path.is_dir, folders))):
        for name in (*_modules_of_ros(folder), *IMPORTED):
            spec = None if environment_has(name) else PathFinder.find_spec(name, [str(folder)])
            if spec is not None and spec.origin is not None:
                origin = Path(spec.origin)
                target = origin.parent if spec.submodule_search_locations else origin
                found[target.name] = target
    return found


def links_to_messages() -> dict[str, Path]:
    """Return links to FRobs's own message packages that the environment does not have; generating them needs genpy."""
    from frobs_ros.messages import message_folder  # a late import, because of a cycle

    folders = [path.parent for path in message_folder().glob("*/__init__.py")]
    return {folder.name: folder for folder in folders if not environment_has(folder.name)}


def environment_has(name: str) -> bool:
    """Return whether this Python imports a top-level module without any overlay."""
    path = [entry for entry in sys.path if entry and not Path(entry).is_relative_to(cache_folder("ros"))]
    spec = PathFinder.find_spec(name, path)
    return (
        spec is not None and spec.origin is not None
    )  # a namespace package has no origin: any folder of that name is one


def _modules_of_ros(folder: Path) -> Iterator[str]:
    """Yield ROS's modules in a folder; message packages are recognized by their subpackages ``msg`` and ``srv``."""
    for name in os.listdir(folder):
        if name in LIBRARIES or any((folder / name / kind / "__init__.py").is_file() for kind in ("msg", "srv")):
            yield name
