"""Access to the planning scene through the services of the ``move_group`` node."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

from frobs_rl_compat.moveit.errors import MoveItCommanderException
from frobs_rl_compat.moveit.node import resolve

GET, APPLY = "get_planning_scene", "apply_planning_scene"


def wait_for_move_group(namespace: str, timeout: float) -> None:
    """Wait until ``move_group`` is running."""
    import rospy

    for service in (GET, APPLY):
        name = resolve(namespace, service)
        try:
            rospy.wait_for_service(name, timeout)
        except rospy.ROSException as error:
            raise MoveItCommanderException(
                f"the service {name} did not become available within {timeout:g} s; start move_group with the launch "
                "file move_group.launch from the robot's MoveIt package."
            ) from error


def current_scene(namespace: str) -> Any:
    """Return the current planning scene as ``moveit_msgs/PlanningScene``."""
    from moveit_msgs.msg import PlanningSceneComponents as Components
    from moveit_msgs.srv import GetPlanningScene

    components = Components(components=Components.WORLD_OBJECT_GEOMETRY | Components.ROBOT_STATE_ATTACHED_OBJECTS)
    return _call(resolve(namespace, GET), GetPlanningScene, components).scene


def scene_change(objects: Sequence[Any] = (), attached: Sequence[Any] = ()) -> Any:
    """Return a ``moveit_msgs/PlanningScene`` that changes only the given objects and attached objects."""
    from moveit_msgs.msg import PlanningScene

    scene = PlanningScene(is_diff=True)
    scene.robot_state.is_diff = True
    scene.world.collision_objects = list(objects)
    scene.robot_state.attached_collision_objects = list(attached)
    return scene


def apply_scene(namespace: str, scene: Any) -> bool:
    """Apply a ``moveit_msgs/PlanningScene`` and return whether ``move_group`` accepted it."""
    from moveit_msgs.srv import ApplyPlanningScene

    return bool(_call(resolve(namespace, APPLY), ApplyPlanningScene, scene).success)


@cache
def _connection(name: str, service: Any) -> Any:
    import rospy

    return rospy.ServiceProxy(name, service, persistent=True)


def _call(name: str, service: Any, request: Any) -> Any:
    import rospy

    for attempt in range(2):  # the cached connection may belong to a move_group process that has exited
        try:
            return _connection(name, service)(request)
        except (rospy.ServiceException, rospy.exceptions.TransportException, OSError) as error:
            _connection.cache_clear()
            if attempt:
                raise MoveItCommanderException(f"the service {name} does not answer: {error}.") from error
    raise AssertionError("the loop returns or raises")
