"""Checks which parts of ROS and Gazebo are installed."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import re
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

from frobs_core.util.errors import FrobsError
from frobs_ros.errors import PackageNotFoundError
from frobs_ros.ros.environment import child_variables, find_ros, use_ros
from frobs_ros.ros.packages import find_package

_Row = tuple[str, str, str, bool]
_VERSION = re.compile(r"<version>\s*([^<\s]+)\s*</version>")

MODULES = (
    ("rospy", "python3-rospy", "nodes in Python", True),
    ("rosgraph", "python3-rosgraph", "the master's interface", True),
    ("genpy", "python3-genpy", "messages in Python", True),
    ("genmsg", "python3-genmsg", "definitions of messages", True),
    ("rosparam", "python3-rosparam", "parameters from YAML files", True),
    ("std_msgs", "python3-std-msgs", "messages", True),
    ("std_srvs", "python3-std-srvs", "services without arguments", True),
    ("geometry_msgs", "python3-geometry-msgs", "poses", True),
    ("sensor_msgs", "python3-sensor-msgs", "joint states, scans", True),
    ("trajectory_msgs", "python3-trajectory-msgs", "trajectories of controllers", True),
    (
        "visualization_msgs",
        "python3-visualization-msgs",
        "markers, imported by every example task of FRobs_RL",
        False,
    ),
    ("rosgraph_msgs", "python3-rosgraph-msgs", "the clock", True),
    ("tf2_msgs", "python3-tf2-msgs", "frames of a robot's links", True),
    ("nav_msgs", "python3-nav-msgs", "odometry", False),
    ("actionlib", "python3-actionlib", "actions of trajectory controllers", False),
    ("actionlib_msgs", "python3-actionlib-msgs", "goals and states of actions", True),
    ("tf2_ros", "python3-tf2-ros", "frames", False),
    ("diagnostic_msgs", "python3-diagnostic-msgs", "messages of tools", False),
)
PROGRAMS = (
    ("rosmaster", "python3-rosmaster", "the master", True),
    ("roslaunch", "python3-roslaunch", "launch files", True),
    ("rosrun", "rosbash", "starting nodes manually", False),
    ("rviz", "rviz", "visualization of robots, scans, paths and markers", False),
    ("xterm", "xterm", "terminal windows for processes", False),
    ("gzserver", "", "Gazebo 11, from its own packages", False),
)
ROS_PACKAGES = (
    ("robot_state_publisher", "ros-robot-state-publisher", "frames, in your launch files", False),
    ("joint_state_publisher", "joint-state-publisher", "joint states set manually", False),
    ("gazebo_ros", "", "Gazebo's ROS interface; if it is missing, the bridge is used instead", False),
)


@dataclass(frozen=True, kw_only=True)
class RosComponent:
    """A module, program or package of ROS or Gazebo.

    Attributes:
        kind: ``"module"``, ``"program"`` or ``"ROS package"``.
        needed: Whether frobs-ros requires the component.
        version: Version of the component, or an empty string if the version is unknown.
        place: Folder or file of the component, or an empty string if the component is not installed.
        package: Debian package that contains the component, or an empty string if no package contains it.
    """

    name: str
    kind: str
    purpose: str
    needed: bool
    found: bool
    version: str
    place: str
    package: str


@dataclass(frozen=True, kw_only=True)
class RosReport:
    """Result of checking the ROS installation.

    Attributes:
        usable: Whether frobs-ros can be used.
        prefix: Folder of the ROS installation, or an empty string if ROS is not installed.
        python: Version of the running Python interpreter.
        linked: Whether Python can import rospy without :func:`frobs_ros.ros.environment.use_ros`.
        missing: Debian packages that contain the missing parts.
        advice: Recommendations, each in one line.
    """

    usable: bool
    prefix: str
    python: str
    master_uri: str
    master_answers: bool
    linked: bool
    parts: tuple[RosComponent, ...]
    missing: tuple[str, ...]
    advice: tuple[str, ...]


def examine_ros() -> RosReport:
    """Check all parts of ROS, without starting any process.

    The only files that this function writes are the generated message packages in the user's cache.
    """
    from importlib.machinery import PathFinder

    from frobs_ros.ros.master import is_online, master_uri

    linked = PathFinder.find_spec("rospy") is not None
    installation = find_ros()
    trouble = ""
    try:
        use_ros()
    except FrobsError as error:
        trouble = str(error)
    tables = {"module": MODULES, "program": PROGRAMS, "ROS package": ROS_PACKAGES}
    parts = [_component(kind, row) for kind, rows in tables.items() for row in rows]
    missing = tuple(dict.fromkeys(part.package for part in parts if not part.found and part.package))
    usable = not trouble and all(part.found for part in parts if part.needed)
    answers = not trouble and is_online()
    advice = [trouble] if trouble else []
    if missing:
        advice.append(f"To install all missing packages: apt-get install {' '.join(missing)}")
    if usable and not linked:
        advice.append("Python cannot import rospy directly; run scripts with 'frobs legacy run' from frobs-rl-compat")
    advice.append(f"A ROS master {'answers' if answers else 'does not answer'} at {master_uri()}")
    return RosReport(
        usable=usable,
        prefix=str(installation.prefix) if installation else "",
        python=f"{sys.version_info.major}.{sys.version_info.minor}",
        master_uri=master_uri(),
        master_answers=answers,
        linked=linked,
        parts=tuple(parts),
        missing=missing,
        advice=tuple(advice),
    )


def _component(kind: str, row: _Row) -> RosComponent:
    """Return the component for a table row, and read its version from its ``package.xml`` if possible."""
    name, package, purpose, needed = row
    place: Path | str | None = None
    folder: Path | None = None
    if kind == "module":
        spec, installation = importlib.util.find_spec(name), find_ros()
        place = Path(spec.origin).parent if spec and spec.origin else None
        folder = installation.share / name if place and installation else None
    elif kind == "program":
        place = shutil.which(name, path=child_variables().get("PATH", os.defpath))
    else:
        with contextlib.suppress(PackageNotFoundError):
            place = folder = find_package(name)
    file = folder / "package.xml" if folder else None
    match = _VERSION.search(file.read_text(errors="replace")) if file and file.is_file() else None
    return RosComponent(
        name=name, kind=kind, purpose=purpose, needed=needed, found=place is not None, version=match[1] if match else "",
        place=str(place or ""), package=package,
    )  # fmt: skip
