"""Finds Python modules of ROS in a folder that also holds what is not to be found there.

Debian keeps ROS's modules in one folder with its own NumPy, PyYAML and all else; on ``sys.path`` that folder would put
them before those of a virtual environment, or mix the two. This finder takes from it ROS's modules and the few that
they import, and stands last, so that whatever is installed comes first.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType

LIBRARIES = frozenset(
    [
        "actionlib",
        "catkin",
        "dynamic_reconfigure",
        "genmsg",
        "genpy",
        "joint_state_publisher",
        "laser_geometry",
        "message_filters",
        "rosbag",
        "rosclean",
        "rosgraph",
        "roslaunch",
        "roslib",
        "roslz4",
        "rosmaster",
        "rosmsg",
        "rosnode",
        "rosparam",
        "rospy",
        "rosservice",
        "rostopic",
        "rosunit",
        "roswtf",
        "tf",
        "tf2_geometry_msgs",
        "tf2_kdl",
        "tf2_py",
        "tf2_ros",
        "tf_conversions",
    ]
)
"""Modules of ROS that are no message packages."""

IMPORTED = frozenset(
    ["Cryptodome", "catkin_pkg", "defusedxml", "distro", "docutils", "gnupg", "netifaces", "pyparsing", "rospkg"]
)
"""Modules of others that ROS's import."""


def is_of_ros(name: str, folder: Path) -> bool:
    """Return whether a top-level module in Debian's folder is one of ROS's.

    A package of generated messages is known by its sub-packages ``msg`` and ``srv``.
    """
    if name in LIBRARIES:
        return (folder / name).exists()
    return any((folder / name / kind / "__init__.py").is_file() for kind in ("msg", "srv"))


def modules_of_ros(folder: Path) -> list[str]:
    """Return the names of ROS's modules in a folder, sorted."""
    return sorted(entry.name for entry in folder.iterdir() if entry.is_dir() and is_of_ros(entry.name, folder))


class RosFinder:
    """A finder for ``sys.meta_path``, best at its end.

    Args:
        folders: Where modules of ROS are, and what they import; the first that has one counts.
    """

    def __init__(self, folders: Sequence[Path]) -> None:
        self.folders = tuple(folders)

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return where a top-level module of ROS is, or None."""
        if path is not None or "." in name:
            return None  # what is inside of a package is found by the package's own path
        for folder in self.folders:
            if name in IMPORTED or is_of_ros(name, folder):
                spec = PathFinder.find_spec(name, [str(folder)], target)
                if spec is not None:
                    return spec
        return None

    def invalidate_caches(self) -> None:
        """Do nothing: nothing is kept."""


def install(folders: Sequence[Path]) -> None:
    """Put a finder for these folders at the end of ``sys.meta_path``, once."""
    if not any(isinstance(finder, RosFinder) for finder in sys.meta_path):
        sys.meta_path.append(RosFinder(folders))
