"""ROS for packages that were written where ``import rospy`` simply works."""

from frobs_ros import environment
from frobs_ros.environment import find_ros, use_ros
from frobs_ros.errors import RosNotFoundError
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


def why_missing(name: str) -> str:
    """Return why a module cannot be imported that packages of FRobs_RL import, and what to do.

    Args:
        name: Of ROS's module, or of MoveIt's.
    """
    if name.startswith("moveit"):
        return (
            "MoveIt is not installed, and nothing stands in for it. Move with the topic of a trajectory controller, or make a "
            "plugin of the package: frobs migrate PATH."
        )
    installation = find_ros()
    if installation is None:
        return str(RosNotFoundError("it is not installed for this Python", environment.PACKAGES))
    return f"ROS is in {installation.prefix}, but this part of it is not. 'frobs doctor ros' says what is missing."
