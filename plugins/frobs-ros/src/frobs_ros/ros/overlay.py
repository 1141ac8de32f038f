"""Creates folders with links to ROS's Python modules, without the system's other Python modules.

Debian installs ROS's modules in the same folder as NumPy, PyYAML and many other modules. Adding this folder to
``sys.path`` would mix these modules with the modules of a virtual environment, so an overlay contains only links to
ROS's modules. An overlay excludes all modules that the environment already contains, so its position on ``sys.path``
does not matter.
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

from frobs_core.util.files import cache_folder
from frobs_ros.errors import RosNotFoundError

_KEPT = 60 * 24 * 3600.0  # [s]

LIBRARIES = frozenset([
    "actionlib", "catkin", "dynamic_reconfigure", "genmsg", "genpy", "joint_state_publisher", "laser_geometry",
    "message_filters", "moveit_commander", "moveit_ros_planning_interface", "rosbag", "rosclean", "rosgraph", "roslaunch", "roslib", "roslz4", "rosmaster", "rosmsg",
    "rosnode", "rosparam", "rospy", "rosservice", "rostopic", "rosunit", "roswtf", "tf", "tf2_geometry_msgs",
    "tf2_kdl", "tf2_py", "tf2_ros", "tf_conversions",
])  # fmt: skip
"""ROS's Python modules, except for message packages."""

IMPORTED = frozenset(
    ["Cryptodome", "catkin_pkg", "defusedxml", "distro", "docutils", "gnupg", "netifaces", "pyparsing", "rospkg"]
)
"""Modules from other projects that ROS's modules import."""


def make_overlay(links: Mapping[str, Path]) -> Path:
    """Return a folder that contains the given links, and create it atomically if it does not exist.

    Args:
        links: Target of each link, by the link's file name. The same links always result in the same folder.

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
            if not folder.is_dir():  # no other process created the folder, so the cache cannot be used
                raise
    except OSError as error:
        raise RosNotFoundError(
            f"links to ROS's Python modules cannot be created in {folder.parent}: {error.strerror}; "
            "set XDG_CACHE_HOME to a writable folder"
        ) from error
    return folder


def delete_unused(folder: Path) -> None:
    """Mark a cache folder as used, and delete sibling folders that have not been used for 60 days."""
    with contextlib.suppress(OSError):
        os.utime(folder)
        for other in folder.parent.iterdir():
            if other.stat().st_mtime < time.time() - _KEPT:
                shutil.rmtree(other)


def links_to_modules(folders: Sequence[Path]) -> dict[str, Path]:
    """Return links to ROS's modules and the modules that ROS imports, unless the environment already contains them.

    Args:
        folders: Folders to search. If several folders contain a module, the first of these folders is used.
    """
    links: dict[str, Path] = {}
    for folder in reversed(dict.fromkeys(filter(Path.is_dir, folders))):
        for name in (*_modules_of_ros(folder), *IMPORTED):
            spec = None if environment_has(name) else PathFinder.find_spec(name, [str(folder)])
            if spec is not None and spec.origin is not None:
                origin = Path(spec.origin)
                target = origin.parent if spec.submodule_search_locations else origin
                links[target.name] = target
    return links


def links_to_messages() -> dict[str, Path]:
    """Return links to the message packages that FRobs generates, unless the environment already contains them.

    Generating the packages requires genpy.
    """
    from frobs_ros.messages import message_folder  # imported here to avoid a circular import

    folders = [path.parent for path in message_folder().glob("*/__init__.py")]
    return {folder.name: folder for folder in folders if not environment_has(folder.name)}


def environment_has(name: str) -> bool:
    """Return whether this Python can import a top-level module without an overlay."""
    path = [entry for entry in sys.path if entry and not Path(entry).is_relative_to(cache_folder("ros"))]
    spec = PathFinder.find_spec(name, path)
    return (
        spec is not None and spec.origin is not None
    )  # any folder without an __init__.py can be imported as a namespace package, which has no origin


def _modules_of_ros(folder: Path) -> Iterator[str]:
    """Yield the names of ROS's modules in a folder. Message packages contain a subpackage ``msg`` or ``srv``."""
    for name in os.listdir(folder):
        if name in LIBRARIES or any((folder / name / kind / "__init__.py").is_file() for kind in ("msg", "srv")):
            yield name
