"""Finds rclpy and message types, and starts nodes.

This module does not import the core, so it also runs on Python 3.10.
"""

from __future__ import annotations

import importlib
import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np

from frobs_ros2.errors import Ros2Error, Ros2MissingError, SettingsError

PEER_TIMEOUT = 10.0
"""Time after which a line says that no other node was seen [s]."""

_CLOCKS_APART = 2.0  # [s]

FEATURES = {
    "control_msgs": "the actions follow_joint_trajectory and gripper_cmd",
    "tf2_msgs": "the topics /tf and /tf_static",
}
"""Features that require message types that the wheels of ROS 2 do not contain, by package."""


@cache
def message_type(name: str) -> Any:
    """Return a message, service or action type.

    Args:
        name: Name of the type, such as ``"sensor_msgs/msg/JointState"``.

    Raises:
        Ros2MissingError: The type cannot be imported.
    """
    package, kind, short = name.split("/")
    try:
        return getattr(importlib.import_module(f"{package}.{kind}"), short)
    except (ImportError, AttributeError) as error:
        raise Ros2MissingError(package, str(error).partition("\n")[0]) from error


def optional_type(name: str, report: Callable[[str], None]) -> Any:
    """Return a type, or None if it cannot be imported, in which case one line names the features that are missing.

    Args:
        name: Name of the type, such as ``"tf2_msgs/msg/TFMessage"``.
        report: Function that receives the line.
    """
    try:
        return message_type(name)
    except Ros2MissingError as error:
        report(f"not available, because {error.package} is not installed: {FEATURES.get(error.package, name)}")
        return None


def find_rclpy() -> Any:
    """Import rclpy.

    Raises:
        Ros2MissingError: It cannot be imported.
    """
    try:
        return importlib.import_module("rclpy")
    except ImportError as error:
        raise Ros2MissingError("rclpy", str(error).partition("\n")[0]) from error


def set_reach(network: bool) -> None:
    """Choose whether nodes on other machines can be reached. Variables that the user has set are not changed.

    Args:
        network: Whether to reach other machines in the network, and not only this one.
    """
    if os.environ.get("ROS_DISTRO") in ("foxy", "galactic", "humble"):
        os.environ.setdefault("ROS_LOCALHOST_ONLY", "0" if network else "1")
    else:
        os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET" if network else "LOCALHOST")


def variables() -> dict[str, str]:
    """Return the variables that another terminal must have in order to see the nodes of this process."""
    names = ("ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY", "RMW_IMPLEMENTATION")
    return {name: os.environ[name] for name in names if name in os.environ}


def advice() -> str:
    """Return the line that says what to enter in another terminal."""
    exports = " ".join(f"{name}={value}" for name, value in variables().items())
    return f"to see the topics in another terminal: export {exports} && ros2 topic list"


def clock_problem(difference: float, sim_time: str) -> str:
    """Return what is wrong if the stamps of messages are from another clock, or an empty text.

    Args:
        difference: Time of this computer's clock minus a stamp [s].
        sim_time: How to use the clock of a simulation.
    """
    if not np.isfinite(difference) or abs(difference) <= _CLOCKS_APART:
        return ""
    return (
        f"the stamps of joint_states differ from the clock of this node by {difference:.4g} s; for a simulation, set "
        f"{sim_time}, and for a robot, synchronize the clocks of the machines"
    )


def ros_arguments(remap: Sequence[str] = (), parameters: Sequence[str] = (), namespace: str = "") -> list[str]:
    """Return the arguments with which rclpy renames topics and sets parameters.

    Args:
        remap: Rules such as ``"joint_states:=arm/joint_states"``.
        parameters: Values such as ``"use_sim_time:=true"``.
        namespace: Namespace of all relative names, or empty.
    """
    rules = [*remap, *([f"__ns:=/{namespace.strip('/')}"] if namespace.strip("/") else [])]
    given = [*(("-r", rule) for rule in rules), *(("-p", value) for value in parameters)]
    return ["--ros-args", *(word for pair in given for word in pair)] if given else []


class Node:
    """A node of ROS 2 with its own context, and a few helpers.

    All callbacks run in the thread that calls :meth:`spin`, so no locks are required.

    Args:
        name: Name of the node.
        arguments: Arguments for rclpy, from :func:`ros_arguments`.
        network: Whether to reach other machines.
        parameter_services: Whether other nodes may read and set the parameters.

    Attributes:
        node: The node of rclpy.

    Raises:
        Ros2MissingError: rclpy cannot be imported.
        Ros2Error: rclpy cannot start, for example because of the arguments.
    """

    def __init__(
        self, name: str, arguments: Sequence[str] = (), network: bool = False, parameter_services: bool = True
    ) -> None:
        set_reach(network)
        self._rclpy = find_rclpy()
        self._stopped = False
        self._context = self._rclpy.Context()
        try:
            self._rclpy.init(args=list(arguments), context=self._context)
            self.node = self._rclpy.create_node(
                name, context=self._context, start_parameter_services=parameter_services
            )
        except (RuntimeError, ValueError) as error:
            if self._context.ok():
                self._rclpy.shutdown(context=self._context)
            reason = " ".join(str(error).split()).partition(", at /")[0]
            given = f" with {' '.join(arguments)}" if arguments else ""
            raise Ros2Error(f"ROS 2 cannot start{given}: {reason}.") from error
        from rclpy.executors import SingleThreadedExecutor

        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)

    def parameter(self, name: str, default: Any) -> Any:
        """Declare a parameter and return its value.

        Raises:
            SettingsError: The value has another type than the default.
        """
        if not self.node.has_parameter(name):
            try:
                self.node.declare_parameter(name, default)
            except self._rclpy.exceptions.ParameterException as error:
                raise SettingsError(f"the parameter {name} must have a value such as {default}: {error}.") from error
        return self.node.get_parameter(name).value

    def publisher(self, kind: str, topic: str, *, latched: bool = False, depth: int = 10) -> Any:
        """Return a publisher of messages of a type such as ``"std_msgs/msg/String"``."""
        return self.node.create_publisher(message_type(kind), topic, quality(latched, depth))

    def subscribe(self, kind: str, topic: str, callback: Callable[[Any], None], *, latched: bool = False) -> Any:
        """Call a function with each message."""
        return self.node.create_subscription(message_type(kind), topic, callback, quality(latched, 10))

    def service(self, kind: str, name: str, callback: Callable[[Any, Any], Any]) -> Any:
        """Offer a service."""
        return self.node.create_service(message_type(kind), name, callback)

    def spin(self, seconds: float = 0.0) -> None:
        """Run the callbacks that are due, and wait up to ``seconds`` for the first one."""
        self._executor.spin_once(timeout_sec=max(0.0, seconds))

    def spin_for(self, seconds: float) -> None:
        """Run callbacks for a duration [s]."""
        end = time.monotonic() + seconds
        while self.ok() and (left := end - time.monotonic()) > 0.0:
            self.spin(left)

    def spin_until(self, condition: Callable[[], bool], seconds: float) -> bool:
        """Run callbacks until a condition holds, and return whether it did before ``seconds`` had passed."""
        end = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > end or not self.ok():
                return False
            self.spin(0.05)
        return True

    def use_sim_time(self) -> None:
        """Use the clock of the topic ``/clock``."""
        parameter = importlib.import_module("rclpy.parameter").Parameter
        self.node.set_parameters([parameter("use_sim_time", parameter.Type.BOOL, True)])

    def log(self, text: str) -> None:
        """Write a warning to the log of ROS."""
        self.node.get_logger().warning(text)

    def has_peer(self) -> bool:
        """Return whether another node has been discovered."""
        return len(self.node.get_node_names()) > 1

    def ok(self) -> bool:
        """Return whether the node was neither shut down nor stopped by a signal."""
        return bool(self._context.ok()) and not self._stopped

    def stop_on_signals(self) -> None:
        """End the loops of this node on Ctrl-C and SIGTERM. An exception could be raised inside of rclpy."""

        def stop(*_: Any) -> None:
            self._stopped = True

        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, stop)

    def close(self) -> None:
        """End the node. Repeated calls have no effect."""
        if self._context.ok():
            self._executor.shutdown()
            self.node.destroy_node()
            self._rclpy.shutdown(context=self._context)


def quality(latched: bool = False, depth: int = 10) -> Any:
    """Return a quality of service: reliable, and kept for later subscribers if ``latched``."""
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

    durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
    return QoSProfile(depth=1 if latched else depth, reliability=ReliabilityPolicy.RELIABLE, durability=durability)


@contextmanager
def running(node: Node) -> Iterator[Node]:
    """Close the node at the end of a ``with`` block."""
    try:
        yield node
    finally:
        node.close()


def seconds_of(stamp: Any) -> float:
    """Return a ``builtin_interfaces/msg/Time`` in seconds."""
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


def stamp_of(nanoseconds: int) -> Any:
    """Return a ``builtin_interfaces/msg/Time``."""
    sec, nanosec = divmod(nanoseconds, 10**9)
    return message_type("builtin_interfaces/msg/Time")(sec=sec, nanosec=nanosec)


def joints_of(
    message: Any, names: Sequence[str]
) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any], np.ndarray[Any, Any]] | None:
    """Return the positions, velocities and efforts of joints in a ``sensor_msgs/msg/JointState``.

    Args:
        message: The message.
        names: Names of the joints.

    Returns:
        (dof,) [rad or m], [rad/s or m/s] and [N·m or N], or None if a joint is missing. Velocities and efforts that the
        message leaves out are 0. An array of a wrong size becomes NaN, so that it is not used.
    """
    present = list(message.name)
    if not set(names) <= set(present):
        return None
    columns = [present.index(name) for name in names]

    def read(values: Any, is_required: bool = False) -> np.ndarray[Any, Any]:
        if len(values) == len(present):
            return np.array(values, float)[columns]
        return np.full(len(columns), np.nan if len(values) or is_required else 0.0)

    return read(message.position, True), read(message.velocity), read(message.effort)


def image_of(message: Any) -> np.ndarray[Any, Any]:
    """Return the pixels of a ``sensor_msgs/msg/Image``: (h, w, 3) uint8 RGB, or (h, w, 1) float32 depth [m].

    Raises:
        ValueError: The encoding is not supported.
    """
    dtype, channels = {
        "rgb8": (np.uint8, 3),
        "bgr8": (np.uint8, 3),
        "mono8": (np.uint8, 1),
        "32FC1": (np.float32, 1),
        "16UC1": (np.uint16, 1),
    }.get(message.encoding, (None, 0))
    if dtype is None:
        raise ValueError(f"the encoding '{message.encoding}' is not supported; use rgb8, bgr8, mono8, 32FC1 or 16UC1")
    rows = np.frombuffer(bytes(message.data), np.uint8).reshape(message.height, message.step)
    width = message.width * channels * np.dtype(dtype).itemsize
    pixels = np.ascontiguousarray(rows[:, :width]).view(dtype)
    if message.is_bigendian:
        pixels = pixels.byteswap()
    image = pixels.reshape(message.height, message.width, channels)
    if message.encoding == "bgr8":
        return np.ascontiguousarray(image[..., ::-1])
    if message.encoding == "mono8":
        return np.repeat(image, 3, axis=2)
    if message.encoding == "16UC1":
        return np.asarray(image, np.float32) * np.float32(0.001)
    return np.ascontiguousarray(image, dtype)
