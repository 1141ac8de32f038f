"""ROS for packages that were written where ``import rospy`` simply works."""

import os

from frobs_ros import finder
from frobs_ros.environment import SYSTEM, find_ros, set_variables, use_ros
from frobs_ros.messages import use_messages


def make_findable() -> bool:
    """Make ROS's modules findable; returns whether ROS is installed."""
    installation = find_ros()
    if installation is None:
        return False
    finder.install([installation.modules, SYSTEM / "lib" / "python3" / "dist-packages"])
    set_variables(os.environ)
    use_messages()
    return True


def find_and_use_ros() -> None:
    """Make ROS usable where it is installed; elsewhere it is missed, and named, by the first function that needs it."""
    if find_ros() is not None:
        use_ros()
