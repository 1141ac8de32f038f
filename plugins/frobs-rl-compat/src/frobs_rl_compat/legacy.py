"""Environment variables that let old packages import ``gym``, ``frobs_rl``, ROS's Python modules and messages."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from frobs_core.util.files import cache_folder
from frobs_rl_compat.replacements import missing_packages
from frobs_ros import (
    RosInstallation,
    environment_has,
    find_ros,
    links_to_messages,
    links_to_ros,
    make_overlay,
    use_ros,
)

_HERE = Path(__file__).parent
FROBS_RL = _HERE.parent / "frobs_rl"
"""Folder of the Python package ``frobs_rl``, which is also the ROS package of the same name."""

_MOVEIT = "moveit_commander"
_OF_ROS = ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME")


def legacy_variables() -> dict[str, str]:
    """Return environment variables for an old package and all processes that it starts.

    FRobs's ``gym`` and ``frobs_rl`` take precedence over packages of the same names in a catkin workspace. ROS modules
    and messages are added only if this Python interpreter cannot import them, and replacements for MoveIt and other ROS
    packages are added only if the originals are not installed.
    """
    use_ros()
    installation = find_ros()
    # Python runs any module named sitecustomize at startup, so startup_patches.py gets this name only in the overlay.
    own = {"frobs_rl": FROBS_RL, "gym": _HERE / "overlay" / "gym", "sitecustomize.py": _HERE / "startup_patches.py"}
    replacements = missing_packages()
    if not _has_moveit(installation):
        own[_MOVEIT] = _HERE / "overlay" / _MOVEIT
        replacements.append(_HERE / "ros_packages")
    overlay = make_overlay({**links_to_messages(), **links_to_ros(), **own})
    packages = _prepend(FROBS_RL, "ROS_PACKAGE_PATH")
    for folder in replacements:
        packages = _append(folder, packages)
    set_by_use_ros = {name: os.environ[name] for name in _OF_ROS if name in os.environ}
    return {
        "PYTHONPATH": _prepend(overlay, "PYTHONPATH"),
        "ROS_PACKAGE_PATH": packages,
        "FROBS_PYTHON": sys.executable,  # Python interpreter that runs the replacement programs
        **({"PATH": _append(installation.programs, os.environ.get("PATH", os.defpath))} if installation else {}),
        **set_by_use_ros,
    }


def _has_moveit(installation: RosInstallation | None) -> bool:
    """Return whether MoveIt's own ``moveit_commander`` is installed, either for this Python interpreter or with ROS."""
    beside = installation is not None and (installation.modules / _MOVEIT / "__init__.py").is_file()
    return beside or environment_has(_MOVEIT)


def _append(folder: Path, value: str) -> str:
    """Return a path variable's value with a folder appended, unless the value already contains the folder."""
    entries = value.split(os.pathsep)
    return os.pathsep.join(entries if str(folder) in entries else [*entries, str(folder)])


def _prepend(folder: Path, variable: str) -> str:
    """Return a path variable's value with a folder prepended, after removing entries that earlier calls added."""
    rest = [entry for entry in os.environ.get(variable, "").split(os.pathsep) if entry]
    kept = [entry for entry in map(Path, rest) if entry != folder and not entry.is_relative_to(cache_folder("ros"))]
    return os.pathsep.join(map(str, [folder, *kept]))
