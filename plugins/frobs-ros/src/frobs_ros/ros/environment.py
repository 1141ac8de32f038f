"""Finds ROS 1, and makes ROS's Python modules importable without exposing the system's other Python modules.

This module neither imports ROS nor changes the process until :func:`use_ros` is called.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import sys
from collections.abc import Mapping, MutableMapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from urllib.parse import urlparse

from frobs_core.util.install_hints import local_install_hint
from frobs_ros.errors import RosNotFoundError
from frobs_ros.ros import interrupts
from frobs_ros.ros.overlay import links_to_messages, links_to_modules, make_overlay

DISTRIBUTION = Path("/opt/ros/noetic")
SYSTEM = Path("/usr")
MASTER_URI = "http://localhost:11311"

PACKAGES = (
    "ros-core", "python3-rospy", "python3-tf2-ros", "python3-sensor-msgs", "python3-geometry-msgs",
    "python3-visualization-msgs",
)  # fmt: skip
"""Debian packages that most ROS packages require. ``frobs doctor ros`` shows the complete list."""


@dataclass(frozen=True)
class RosInstallation:
    """Location of a ROS installation.

    Attributes:
        prefix: Root folder of ROS: ``/usr`` for Debian's packages, ``/opt/ros/noetic``, or the prefix of a conda
            environment.
        modules: Folder of ROS's Python modules.
    """

    prefix: Path
    modules: Path

    @property
    def share(self) -> Path:
        """Folder of the ROS packages."""
        return self.prefix / "share"

    @property
    def programs(self) -> Path:
        """Folder of the ROS commands."""
        return self.prefix / "bin"


def find_ros() -> RosInstallation | None:
    """Find the ROS installation, or return None if ROS is not installed.

    An installation that this Python can import takes precedence over ``/opt/ros/noetic``, and ``/opt/ros/noetic`` takes
    precedence over Debian's packages.
    """
    spec = importlib.util.find_spec("rospy")
    if spec is not None and spec.origin is not None:
        modules = Path(spec.origin).resolve().parents[1]  # resolve symbolic links to find the rest of ROS
        return RosInstallation(_prefix(modules), modules)
    for prefix in (DISTRIBUTION, SYSTEM):
        modules = prefix / "lib" / "python3" / "dist-packages"
        if (modules / "rospy" / "__init__.py").is_file():
            return RosInstallation(prefix, modules)
    return None


def _prefix(modules: Path) -> Path:
    """Return the folder that contains ``lib/python3…/``, or the modules' own folder if no ``lib`` folder exists."""
    for folder in modules.parents:
        if folder.name == "lib":
            return folder.parent
    return modules


def links_to_ros() -> dict[str, Path]:
    """Return links to the ROS modules, and to the modules that ROS imports, unless this Python can already import them.

    Raises:
        RosNotFoundError: ROS is not installed. The error message names the Debian packages to install.
    """
    installation = find_ros()
    if installation is None:
        raise RosNotFoundError("the Python module 'rospy' is not installed", PACKAGES)
    return links_to_modules([installation.modules, SYSTEM / "lib" / "python3" / "dist-packages"])


@cache
def link_modules() -> str:
    """Append a folder with links to ROS's modules to the end of ``sys.path``, and return this folder."""
    folder = str(make_overlay(links_to_ros()))
    sys.path.append(folder)
    return folder


@cache
def use_ros() -> None:
    """Make rospy and the message packages importable in this process. Further calls have no effect.

    Folders with links to missing modules are appended to the end of ``sys.path``. Environment variables that ROS
    requires are set by :func:`set_variables` unless they already have a value.

    Raises:
        RosNotFoundError: ROS is not installed for this version of Python. The error message describes how to install
            ROS.
        RosError: The generated message packages cannot be stored.
    """
    folder = link_modules()
    set_variables(os.environ)
    try:
        importlib.import_module("rospy")
    except ImportError as error:
        sys.path.remove(folder)
        link_modules.cache_clear()
        version = f"{sys.version_info.major}.{sys.version_info.minor}"
        raise RosNotFoundError(
            f"'import rospy' fails in Python {version}: {error}. If a Python module is missing: "
            + local_install_hint("pip install 'frobs-ros[ros]'")
        ) from error
    sys.path.append(str(make_overlay(links_to_messages())))
    interrupts.watch()


def set_variables(environment: MutableMapping[str, str]) -> None:
    """Set the environment variables that ROS requires, unless they already have a value.

    By default, the ROS master is assumed to be on this machine. If the master is on this machine, and neither
    ``ROS_HOSTNAME`` nor ``ROS_IP`` is set, nodes use the host name ``localhost``, so that rospy listens only on the
    loopback address.
    """
    environment.setdefault("ROS_MASTER_URI", MASTER_URI)
    if not environment.get("ROS_HOSTNAME") and not environment.get("ROS_IP") and is_local(environment):
        environment["ROS_HOSTNAME"] = "localhost"


def is_local(environment: Mapping[str, str]) -> bool:
    """Return whether the ROS master's address is a loopback address of this machine."""
    host = urlparse(environment.get("ROS_MASTER_URI", MASTER_URI)).hostname or ""
    return host in ("localhost", "::1") or host.startswith("127.")


def child_variables() -> dict[str, str]:
    """Return the environment variables for ROS programs, with the system's Python first on ``PATH``.

    The scripts of ROS nodes start with ``#!/usr/bin/env python3``, and a different Python would not find rospy.
    """
    environment = dict(os.environ)
    set_variables(environment)
    installation = find_ros()
    first = ["/usr/bin", "/bin"]
    if installation is not None and installation.prefix != SYSTEM:
        first.insert(0, str(installation.programs))
    rest = [entry for entry in environment.get("PATH", "").split(os.pathsep) if entry and entry not in first]
    environment["PATH"] = os.pathsep.join([*first, *rest])
    for name in ("PYTHONHOME", "VIRTUAL_ENV", "__PYVENV_LAUNCHER__"):
        environment.pop(name, None)
    return environment
