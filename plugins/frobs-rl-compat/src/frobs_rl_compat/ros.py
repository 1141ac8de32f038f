"""ROS for packages that were written where ``import rospy`` simply works."""

from frobs_ros import environment
from frobs_ros.environment import find_ros, use_ros
from frobs_ros.messages import use_messages


def make_findable() -> bool:
    """Make ROS's modules and our messages findable; returns whether ROS is installed."""
    if environment.make_findable() is None:
        return False
    use_messages()
    return True


def find_and_use_ros() -> None:
    """Make ROS usable where it is installed; elsewhere it is missed, and named, by the first function that needs it."""
    if find_ros() is not None:
        use_ros()
