"""ROS-related exceptions, in addition to the exceptions in :mod:`frobs_core.util.errors`.

``RosError`` is a subclass of the core's SimulationError, and the base class of these exceptions:

- ``RosNotFoundError``: ROS is not installed for this version of Python.
- ``MasterError``: No ROS master responds, or the master rejects a request.
- ``ServiceError``: A service does not exist, cannot be reached, or rejected a request.
- ``PackageNotFoundError``: A ROS package does not exist, or does not contain a file.
- ``ProcessError``: A process did not start, or ended immediately.
- ``RobotSilentError``: A robot does not publish its measurements, or has stopped publishing them.
- ``ClockResetError``: The ROS clock was set back during a step.
- ``NodeEndedError``: The node was shut down during a step.

These exceptions are subclasses of the core's ConfigurationError:

- ``ControllerError``: A ROS controller cannot be loaded, started, stopped or used.
- ``TrajectoryError``: A trajectory message cannot be executed. The subclass ``TrajectoryJointsError`` means that the
  message omits or repeats joints of the controller.
- ``GazeboElementError``: A ``<gazebo>`` element of a model file cannot be used.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from textwrap import indent

from frobs_core.util.errors import ConfigurationError, SimulationError, nearest


class RosError(SimulationError):
    """ROS, or a program that ROS runs, failed."""


class RosNotFoundError(RosError):
    """ROS is not installed for this version of Python.

    Args:
        reason: Description of what is missing.
        packages: Debian packages that contain the missing parts. If no packages are given, ``reason`` describes another
            solution.
    """

    def __init__(self, reason: str, packages: Sequence[str] = ()) -> None:
        self.reason = reason
        self.packages = tuple(packages)
        install = f" Install it with 'apt-get install {' '.join(self.packages)}'." if self.packages else ""
        super().__init__(f"ROS cannot be used: {reason}.{install} Run 'frobs doctor ros' to list all missing parts.")


class MasterError(RosError):
    """No ROS master responds, or the master rejects a request.

    Args:
        uri: Address of the master.
        reason: Reason why the request failed, or None if no master responds.
    """

    def __init__(self, uri: str, reason: str | None = None) -> None:
        self.uri = uri
        self.reason = reason
        what = (
            f"the request to the ROS master at {uri} failed: {reason}" if reason else f"no ROS master responds at {uri}"
        )
        remedy = "" if reason else ". Run 'roscore' to start a master, or set ROS_MASTER_URI to a running master"
        super().__init__(f"{what}{remedy}.")


class ServiceError(RosError):
    """A service does not exist, cannot be reached, or rejected a request.

    Args:
        service: Full name of the service.
        reason: Description of the problem and, if possible, how to fix it.
    """

    def __init__(self, service: str, reason: str) -> None:
        self.service = service
        self.reason = reason
        super().__init__(f"service {service}: {reason}")


class PackageNotFoundError(RosError):
    """A ROS package does not exist, or does not contain a file.

    Args:
        package: Name of the requested package.
        available: Names of the available packages, or of the available files if a file is missing.
        searched: Folders that were searched.
        file: The missing file, or None if the package itself is missing.
    """

    def __init__(
        self, package: str, available: Iterable[str], searched: Iterable[Path | str], file: Path | None = None
    ) -> None:
        self.package = package
        self.file = file
        self.searched = tuple(str(folder) for folder in searched)
        names = sorted(available)
        close = nearest(package if file is None else file.name, names)
        hint = f" Did you mean '{close}'?" if close else ""
        if file is not None:
            there = f" {file.parent} contains: {', '.join(names[:10]) or 'nothing'}."
            super().__init__(f"the ROS package '{package}' has no file {file}.{hint or there}")
        else:
            super().__init__(
                f"no ROS package is named '{package}'.{hint} Searched {', '.join(self.searched) or 'no folder'}. "
                "Source the workspace's setup.bash, or add the folder that contains the package to ROS_PACKAGE_PATH."
            )


class ProcessError(RosError):
    """A process did not start, or ended immediately.

    Args:
        name: Name of the process.
        reason: Description of the problem.
        output: Last lines of the process's output.
    """

    def __init__(self, name: str, reason: str, output: str = "") -> None:
        self.name = name
        self.reason = reason
        self.output = output
        said = f" Last output:\n{indent(output, '  ')}" if output else ""
        super().__init__(f"{name}: {reason}.{said}")


class RobotSilentError(RosError):
    """A robot does not publish its measurements, or has stopped publishing them.

    Args:
        missing: Name of the missing measurement.
        seconds: Time since the measurement was last received [s].
    """

    def __init__(self, missing: str, seconds: float) -> None:
        self.missing, self.seconds = missing, seconds
        super().__init__(
            f"no {missing} received for {seconds:.2g} s; the robot was commanded to hold its position. Check that the "
            "robot publishes its measurements, or allow more time with --timeout."
        )


class ClockResetError(RosError):
    """The ROS clock was set back, for example because a simulation was reset.

    Args:
        before: Time before [s].
        now: Time after [s].
    """

    def __init__(self, before: float, now: float) -> None:
        super().__init__(
            f"the ROS clock was set back from {before:g} s to {now:g} s; reset the environment to continue."
        )


class NodeEndedError(RosError):
    """The node was shut down while a robot was being controlled."""

    def __init__(self) -> None:
        super().__init__("the node was shut down; the robot is commanded to hold its position.")


class ControllerError(ConfigurationError):
    """A ROS controller cannot be loaded, started, stopped or used.

    Args:
        controller: Name of the controller.
        reason: Description of the problem and how to fix it.
    """

    def __init__(self, controller: str, reason: str) -> None:
        self.controller = controller
        self.reason = reason
        super().__init__(f"controller '{controller}': {reason}")


class TrajectoryError(ConfigurationError):
    """A trajectory message cannot be executed. The error message names the invalid part."""


class TrajectoryJointsError(TrajectoryError):
    """A trajectory message omits or repeats joints of the controller.

    Args:
        names: Joints in the message.
        joints: Joints of the controller.
    """

    def __init__(self, names: Iterable[str], joints: Iterable[str]) -> None:
        super().__init__(
            f"the trajectory names the joints {', '.join(names)}, but the controller has the joints "
            f"{', '.join(joints)}; list each joint once."
        )


class GazeboElementError(ConfigurationError):
    """A ``<gazebo>`` element of a model file cannot be used.

    Args:
        element: Description of the plugin or sensor, such as ``"the plugin 'drive'"``.
        reason: Description of the problem and how to fix it.
    """

    def __init__(self, element: str, reason: str) -> None:
        self.element = element
        self.reason = reason
        super().__init__(f"{element}: {reason}")
