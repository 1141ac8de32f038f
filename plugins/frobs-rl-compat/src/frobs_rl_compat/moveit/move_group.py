"""Replacement for the ``move_group`` node that the launch files of MoveIt packages start.

This node stores the planning scene. Motions are planned and executed in the process that uses ``moveit_commander``.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Sequence
from typing import Any

from frobs_core.util.errors import FrobsError
from frobs_rl_compat.moveit.description import read_description
from frobs_rl_compat.moveit.errors import MoveItCommanderException
from frobs_rl_compat.moveit.execution import SETTINGS
from frobs_rl_compat.moveit.joints import joint_states
from frobs_rl_compat.moveit.scene_service import APPLY, GET, scene_change
from frobs_rl_compat.moveit.world import World
from frobs_ros import use_ros

LOG = logging.getLogger("rosout.move_group")

_STATUS_PERIOD = 0.2  # [s] as in actionlib


class MoveGroup:
    """Stores the planning scene, and provides the services and topics of ``move_group`` that clients wait for.

    Raises:
        MoveItCommanderException: The robot's description is not on the parameter server.
    """

    def __init__(self) -> None:
        import rospy
        from actionlib_msgs.msg import GoalStatusArray
        from dynamic_reconfigure.srv import Reconfigure
        from moveit_msgs.msg import AttachedCollisionObject, CollisionObject, PlanningScene
        from moveit_msgs.srv import ApplyPlanningScene, GetPlanningScene

        description, states = read_description(), joint_states("")
        self._world = World(
            description.model.name,
            description.semantics.planning_frame,
            lambda frame: description.frame_pose(frame, states),
        )
        self._scene = rospy.Publisher("~monitored_planning_scene", PlanningScene, queue_size=1, latch=True)
        self.status = rospy.Publisher("~status", GoalStatusArray, queue_size=1)
        self._parts = [
            rospy.Subscriber("planning_scene", PlanningScene, self._apply),
            rospy.Subscriber("collision_object", CollisionObject, lambda item: self._apply(scene_change([item]))),
            rospy.Subscriber(
                "attached_collision_object",
                AttachedCollisionObject,
                lambda item: self._apply(scene_change(attached=[item])),
            ),
            rospy.Service("~trajectory_execution/set_parameters", Reconfigure, _reconfigure),
            rospy.Service(APPLY, ApplyPlanningScene, lambda request: self._apply(request.scene)),
            rospy.Service(GET, GetPlanningScene, lambda _: self._world.message()),
        ]
        self._scene.publish(self._world.message())

    def _apply(self, scene: Any) -> bool:
        try:
            self._world.apply(scene)
        except MoveItCommanderException as error:
            LOG.error("The planning scene was not changed: %s", error)
            return False
        self._scene.publish(self._world.message())
        return True


def _reconfigure(request: Any) -> Any:
    """Change settings of the trajectory execution, ignoring unknown names, and return all settings."""
    import rospy
    from dynamic_reconfigure.msg import BoolParameter, Config, DoubleParameter, GroupState

    given = {entry.name: entry.value for entry in (*request.config.doubles, *request.config.bools)}
    merged = {**SETTINGS, **rospy.get_param("~trajectory_execution", {}), **given}
    settings = {name: type(default)(merged[name]) for name, default in SETTINGS.items()}
    for name, value in settings.items():
        rospy.set_param(f"~trajectory_execution/{name}", value)
    return Config(
        bools=[BoolParameter(name, value) for name, value in settings.items() if isinstance(value, bool)],
        doubles=[DoubleParameter(name, value) for name, value in settings.items() if not isinstance(value, bool)],
        groups=[GroupState("Default", True, 0, 0)],
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node until it is shut down, and return the exit code."""
    use_ros()
    import rospy
    from actionlib_msgs.msg import GoalStatusArray

    rospy.init_node("move_group", argv=list(sys.argv if arguments is None else arguments))
    try:
        node = MoveGroup()
    except FrobsError as error:
        LOG.error("%s", error)
        return 1
    LOG.info("You can start planning now: this is FRobs's replacement for move_group.")
    while not rospy.is_shutdown():
        node.status.publish(GoalStatusArray())
        rospy.rostime.wallsleep(_STATUS_PERIOD)
    return 0


if __name__ == "__main__":
    sys.exit(main())
