"""ROS packages that replace missing ones: launch files and programs with the names and arguments of the originals.

``frobs legacy run`` adds their folder to the end of ``ROS_PACKAGE_PATH`` if the originals are not installed. Their programs
run with the Python that the variable ``FROBS_PYTHON`` names.
"""

from __future__ import annotations

import sys
from pathlib import Path

from frobs_ros.errors import PackageNotFoundError
from frobs_ros.packages import find_package

STAND_INS = Path(__file__).parent


PACKAGES = ("controller_manager", "gazebo_ros", "xacro")
"""Names of all stand-ins."""


def has_original(package: str) -> bool:
    """Return whether ROS itself has a package, not only the stand-in."""
    try:
        return not find_package(package).is_relative_to(STAND_INS)
    except PackageNotFoundError:
        return False


def missing_packages() -> list[Path]:
    """Return the folders of the stand-ins whose originals are not installed."""
    return [STAND_INS / name for name in PACKAGES if not has_original(name)]


def arguments() -> list[str]:
    """Return the arguments of a program without those that roslaunch adds for ROS (``__name:=…`` and remappings)."""
    return [argument for argument in sys.argv[1:] if ":=" not in argument]
