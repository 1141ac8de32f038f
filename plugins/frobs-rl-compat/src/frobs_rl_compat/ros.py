"""ROS for packages that say ``import rospy`` below their imports of ``frobs_rl``."""

from frobs_ros.environment import find_ros, use_ros


def find_and_use_ros() -> None:
    """Make ``import rospy`` work where ROS is installed; elsewhere it is said by the first function that needs it."""
    if find_ros() is not None:
        use_ros()
