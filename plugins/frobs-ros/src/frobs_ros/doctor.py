"""What of ROS and Gazebo is on this machine, as data."""

from __future__ import annotations

import os
import re
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

from frobs_core.errors import FrobsError
from frobs_ros.environment import child_variables, find_ros, use_ros
from frobs_ros.errors import PackageNotFoundError
from frobs_ros.packages import find_package

_VERSION = re.compile(r"<version>\s*([^<\s]+)\s*</version>")

MODULES = (
    ("rospy", "python3-rospy", "nodes in Python", True),
    ("rosgraph", "python3-rosgraph", "the master's interface", True),
    ("genpy", "python3-genpy", "messages in Python", True),
    ("genmsg", "python3-genmsg", "definitions of messages", True),
    ("rosparam", "python3-rosparam", "YAML files to parameters", True),
    ("std_msgs", "python3-std-msgs", "messages", True),
    ("std_srvs", "python3-std-srvs", "services that take nothing", True),
    ("geometry_msgs", "python3-geometry-msgs", "poses", True),
    ("sensor_msgs", "python3-sensor-msgs", "joint states, scans", True),
    ("trajectory_msgs", "python3-trajectory-msgs", "trajectories of controllers", True),
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
    ("rosrun", "rosbash", "nodes by hand", False),
    ("xterm", "xterm", "windows of processes", False),
    ("gzserver", "", "Gazebo 11, from its own packages", False),
)
ROS_PACKAGES = (
    ("robot_state_publisher", "ros-robot-state-publisher", "frames, in launch files of yours", False),
    ("joint_state_publisher", "joint-state-publisher", "joint states by hand", False),
    ("gazebo_ros", "", "Gazebo's own names in ROS; without it the bridge stands in", False),
)


@dataclass(frozen=True, kw_only=True)
class Part:
    """One part of ROS.

    Attributes:
        name: Of the module, program or ROS package.
        kind: ``"module"``, ``"program"`` or ``"ROS package"``.
        purpose: What it is for.
        needed: Whether frobs-ros cannot work without it.
        found: Whether it is here.
        version: As its package says; empty: unknown.
        place: Its folder or file; empty: it is not here.
        package: The Debian package that brings it; empty: Debian has none.
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
    """What is here.

    Attributes:
        usable: Whether frobs-ros can work.
        prefix: Where ROS is; empty: nowhere.
        python: The version of this Python.
        master_uri: Where the master is, or should be.
        master_answers: Whether one does.
        linked: Whether plain Python can import rospy.
        parts: Each part.
        missing: The Debian packages that bring what is missing.
        advice: What to do, a line each.
    """

    usable: bool
    prefix: str
    python: str
    master_uri: str
    master_answers: bool
    linked: bool
    parts: tuple[Part, ...]
    missing: tuple[str, ...]
    advice: tuple[str, ...]


def examine_ros() -> RosReport:
    """Look at all parts of ROS. Starts nothing, and writes nothing but the cache of message packages."""
    from importlib.machinery import PathFinder

    from frobs_ros.master import is_online, master_uri

    linked = PathFinder.find_spec("rospy") is not None
    installation = find_ros()
    trouble = ""
    try:
        use_ros()
    except FrobsError as error:
        trouble = str(error)
    parts = [*map(_module, MODULES), *map(_program, PROGRAMS), *map(_ros_package, ROS_PACKAGES)]
    missing = tuple(dict.fromkeys(part.package for part in parts if not part.found and part.package))
    usable = not trouble and all(part.found for part in parts if part.needed)
    answers = not trouble and is_online()
    advice = [trouble] if trouble else []
    if missing:
        advice.append(f"To have all of it: apt-get install {' '.join(missing)}")
    if usable and not linked:
        advice.append("Plain Python cannot import rospy here; start scripts by 'frobs legacy run' (frobs-rl-compat)")
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


def _module(row: tuple[str, str, str, bool]) -> Part:
    import importlib.util

    name, package, purpose, needed = row
    spec = importlib.util.find_spec(name)
    place = str(Path(spec.origin).parent) if spec and spec.origin else ""
    installation = find_ros()
    version = _version(installation.share / name) if place and installation else ""
    return Part(name=name, kind="module", purpose=purpose, needed=needed, found=bool(place), version=version,
                place=place, package=package)  # fmt: skip


def _program(row: tuple[str, str, str, bool]) -> Part:
    name, package, purpose, needed = row
    place = shutil.which(name, path=child_variables().get("PATH", os.defpath)) or ""
    return Part(name=name, kind="program", purpose=purpose, needed=needed, found=bool(place), version="", place=place,
                package=package)  # fmt: skip


def _ros_package(row: tuple[str, str, str, bool]) -> Part:
    name, package, purpose, needed = row
    try:
        folder = find_package(name)
    except PackageNotFoundError:
        folder = None
    return Part(name=name, kind="ROS package", purpose=purpose, needed=needed, found=folder is not None,
                version=_version(folder) if folder else "", place=str(folder or ""), package=package)  # fmt: skip


def _version(*folders: Path) -> str:
    for folder in folders:
        file = folder / "package.xml"
        if file.is_file() and (match := _VERSION.search(file.read_text(errors="replace"))):
            return match[1]
    return ""
