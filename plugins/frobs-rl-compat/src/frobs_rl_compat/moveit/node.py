"""Functions for this process's ROS node and for names in the ROS graph."""

from __future__ import annotations

from typing import Any


def ensure_node() -> None:
    """Start a node if this process has none, because MoveIt does not require scripts to call ``rospy.init_node``."""
    import rospy

    if not rospy.core.is_initialized():
        rospy.init_node("moveit_commander", anonymous=True, disable_signals=True)


def resolve(namespace: str, name: str) -> str:
    """Return the global form of a name in a namespace. An empty namespace refers to this node's namespace."""
    import rospy

    return str(rospy.resolve_name(f"{namespace.rstrip('/')}/{name}" if namespace else name))


def group_parameters(namespace: str) -> dict[str, Any]:
    """Return the parameters of the ``move_group`` node."""
    import rospy

    parameters = rospy.get_param(resolve(namespace, "move_group"), {})
    return parameters if isinstance(parameters, dict) else {}
