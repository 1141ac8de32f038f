"""Finds ROS 1, and makes its Python modules importable without other modules of the system.

This module does not import ROS or change the process until :func:`use_ros` is called.
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

from frobs_core.install_hints import local_install_hint
from frobs_ros import interrupts
from frobs_ros.errors import RosNotFoundError
from frobs_ros.overlay import links_to_messages, links_to_modules, make_overlay

DISTRIBUTION = Path("/opt/ros/noetic")
SYSTEM = Path("/usr")
MASTER_URI = "http://localhost:11311"

PACKAGES = (
    "ros-core", "python3-rospy", "python3-tf2-ros", "python3-sensor-msgs", "python3-geometry-msgs",
    "python3-visualization-msgs",
)  # fmt: skip
"""Debian packages that most ROS packages need; ``frobs doctor ros`` lists all."""


@dataclass(frozen=True)
class RosInstallation:
    """Location of a ROS installation.

    Attributes:
        prefix: ``/usr`` for Debian's packages, ``/opt/ros/noetic``, or a conda prefix.
        modules: Folder of its Python modules.
    """

    prefix: Path
    modules: Path

    @property
    def share(self) -> Path:
        """Folder of its packages."""
        return self.prefix / "share"

    @property
    def programs(self) -> Path:
        """Folder of its commands."""
        return self.prefix / "bin"


def find_ros() -> RosInstallation | None:
    """Return the ROS installation, or None: the importable one, then ``/opt/ros/noetic``, then Debian's packages."""
    spec = importlib.util.find_spec("rospy")
    if spec is not None and spec.origin is not None:
        modules = Path(spec.origin).resolve().parents[1]  # links are resolved to find the rest of ROS
        return RosInstallation(_prefix(modules), modules)
    for prefix in (DISTRIBUTION, SYSTEM):
        modules = prefix / "lib" / "python3" / "dist-packages"
        if (modules / "rospy" / "__init__.py").is_file():
            return RosInstallation(prefix, modules)
    return None


def _prefix(modules: Path) -> Path:
    """Return the folder above ``lib/python3…/``; the modules' own folder if there is no ``lib``."""
    for folder in modules.parents:
        if folder.name == "lib":
            return folder.parent
    return modules


def links_to_ros() -> dict[str, Path]:
    """Return links to ROS modules that this Python cannot import, and to the modules that they import.

    Raises:
        RosNotFoundError: ROS is not installed; the message names the Debian packages.
    """
    installation = find_ros()
    if installation is None:
        raise RosNotFoundError("no module 'rospy' is installed on this machine", PACKAGES)
    return links_to_modules([installation.modules, SYSTEM / "lib" / "python3" / "dist-packages"])


@cache
def link_modules() -> str:
    """Append links to ROS's modules to ``sys.path``, after all other modules, and return their folder.

    Raises:
        RosNotFoundError: ROS is not installed; the message names the Debian packages.
    """
    folder = str(make_overlay(links_to_ros()))
    sys.path.append(folder)
    return folder


@cache
def use_ros() -> None:
    """Make ``import rospy`` and the message packages work in this process. Calling it again has no effect.

    Links to missing modules are appended to ``sys.path``, after all other modules. Environment variables that ROS needs
    are set unless they have a value; see :func:`set_variables`.

    Raises:
        RosNotFoundError: ROS is not installed, or not for this Python; the message names the Debian packages.
        RosError: The message packages cannot be stored.
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
    """Set the variables that ROS needs, unless they have a value.

    The default master is on this machine. If the master is on this machine, and neither ``ROS_HOSTNAME`` nor ``ROS_IP``
    is set, nodes are named ``localhost``, so that rospy listens only on the loopback address.
    """
    environment.setdefault("ROS_MASTER_URI", MASTER_URI)
    if not environment.get("ROS_HOSTNAME") and not environment.get("ROS_IP") and is_local(environment):
        environment["ROS_HOSTNAME"] = "localhost"


def is_local(environment: Mapping[str, str]) -> bool:
    """Return whether the ROS master is on the loopback address of this machine."""
    host = urlparse(environment.get("ROS_MASTER_URI", MASTER_URI)).hostname or ""
    return host in ("localhost", "::1") or host.startswith("127.")


def child_variables() -> dict[str, str]:
    """Return the environment for programs of ROS, with the system's Python first on ``PATH``.

    Nodes begin with ``#!/usr/bin/env python3``; a different Python would not find rospy.
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
