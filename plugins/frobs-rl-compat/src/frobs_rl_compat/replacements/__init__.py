"""Contains replacements for missing ROS packages, with the launch files, programs and arguments of the originals.

If the originals are not installed, ``frobs legacy run`` appends the folders of the replacements to
``ROS_PACKAGE_PATH``. The replacement programs run with the Python interpreter that the environment variable
``FROBS_PYTHON`` specifies.
"""

from __future__ import annotations

import sys
from pathlib import Path

from frobs_ros.errors import PackageNotFoundError
from frobs_ros.ros.packages import find_package

REPLACEMENTS = Path(__file__).parent


PACKAGES = ("controller_manager", "gazebo_ros", "xacro")
"""Names of the ROS packages for which a replacement is available."""


def has_original(package: str) -> bool:
    """Return whether the original ROS package is installed, rather than only its replacement."""
    try:
        return not find_package(package).is_relative_to(REPLACEMENTS)
    except PackageNotFoundError:
        return False


def missing_packages() -> list[Path]:
    """Return the folders of the replacements whose originals are not installed."""
    return [REPLACEMENTS / name for name in PACKAGES if not has_original(name)]


def arguments() -> list[str]:
    """Return the program's arguments, except for the arguments that roslaunch adds (``__name:=…`` and remappings)."""
    return [argument for argument in sys.argv[1:] if ":=" not in argument]
