"""Exceptions of the ROS 2 connection. They do not require the core.

DeployError
└── Ros2Error                  ROS 2 cannot be used
    ├── Ros2MissingError       rclpy or a message type cannot be imported
    ├── NoPeerError            no other node answers
    ├── SettingsError          a setting of a command is invalid
    └── NotReadyError          the robot does not match the policy
"""

from __future__ import annotations

from collections.abc import Sequence

from frobs_deploy import DeployError


class Ros2Error(DeployError):
    """ROS 2, or a node at the other end, cannot be used."""


class Ros2MissingError(Ros2Error):
    """The package rclpy, or a package of message types, cannot be imported.

    Args:
        package: Name of the Python package.
        reason: Error message of the import.
    """

    def __init__(self, package: str, reason: str) -> None:
        self.package, self.reason = package, reason
        super().__init__(
            f"the Python package '{package}' of ROS 2 cannot be imported ({reason}); source the setup.bash of your ROS "
            "2 installation, or install the wheels in a virtual environment of their own: pip install "
            "'frobs-ros2[rclpy]', or in a clone of FRobs pip install -e 'plugins/frobs-ros2[rclpy]'."
        )


class NoPeerError(Ros2Error):
    """No node publishes what is needed.

    Args:
        topic: Full name of the topic.
        seconds: Time that was waited [s].
        domain: The value of ROS_DOMAIN_ID.
        reach: Which machines can be reached.
    """

    def __init__(self, topic: str, seconds: float, domain: str, reach: str) -> None:
        self.topic, self.seconds = topic, seconds
        super().__init__(
            f"no node published {topic} within {seconds:g} s (ROS_DOMAIN_ID={domain}, {reach}); check that the robot's "
            "nodes run with the same variables, or use --network if they run on another machine."
        )


class SettingsError(Ros2Error):
    """A setting has an unsuitable value. The message names it."""


class NotReadyError(Ros2Error):
    """The robot's topics do not match a policy.

    Args:
        bundle: Path of the bundle.
        mismatches: One sentence for each difference, which says what to change.
    """

    def __init__(self, bundle: object, mismatches: Sequence[str]) -> None:
        self.mismatches = tuple(mismatches)
        lines = "".join(f"\n  - {line}" for line in mismatches)
        super().__init__(f"the robot does not match the policy {bundle}; change the following and try again:{lines}")
