"""Replacement for the ``move_group`` node that the launch files of MoveIt packages start.

This node stores the planning scene. Motions are planned and executed in the process that uses ``moveit_commander``.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import FrobsError
from frobs_rl_compat.moveit import poses, settings
from frobs_rl_compat.moveit.description import read_description
from frobs_rl_compat.moveit.errors import MoveItCommanderException
from frobs_rl_compat.moveit.joints import joint_states
from frobs_rl_compat.moveit.scene_service import APPLY, GET
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

        self._description = read_description()
        self._states = joint_states("")
        semantics, model = self._description.semantics, self._description.model
        self._world = World(model.name, semantics.planning_frame, self._locate)
        self._scene = rospy.Publisher("~monitored_planning_scene", PlanningScene, queue_size=1, latch=True)
        self.status = rospy.Publisher("~status", GoalStatusArray, queue_size=1)
        self._parts = [
            rospy.Subscriber("planning_scene", PlanningScene, self._take_scene),
            rospy.Subscriber("collision_object", CollisionObject, self._take_object),
            rospy.Subscriber("attached_collision_object", AttachedCollisionObject, self._take_attached),
            rospy.Service("~trajectory_execution/set_parameters", Reconfigure, self._reconfigure),
            rospy.Service(APPLY, ApplyPlanningScene, lambda request: self._apply(request.scene)),
            rospy.Service(GET, GetPlanningScene, lambda _: self._world.message()),
        ]
        self._scene.publish(self._world.message())

    def _locate(self, frame: str) -> Floats:
        semantics, model = self._description.semantics, self._description.model
        frame = frame.removeprefix("/")
        if frame in ("", semantics.planning_frame, model.root):
            return poses.IDENTITY
        if frame not in {link.name for link in model.links}:
            raise MoveItCommanderException(
                f"the frame '{frame}' is neither the planning frame '{semantics.planning_frame}' nor a link of the "
                "robot."
            )
        current = self._states.current(model.joint_names)
        pos, quat = model.frame_pose(frame, np.array([[current[name] for name in model.joint_names]]))
        return np.concatenate([pos[0], quat[0]])

    def _apply(self, scene: Any) -> bool:
        try:
            self._world.apply(scene)
        except MoveItCommanderException as error:
            LOG.error("The planning scene was not changed: %s", error)
            return False
        self._scene.publish(self._world.message())
        return True

    def _take_scene(self, scene: Any) -> None:
        self._apply(scene)

    def _take_object(self, item: Any) -> None:
        from moveit_msgs.msg import PlanningScene

        scene = PlanningScene(is_diff=True)
        scene.world.collision_objects = [item]
        self._apply(scene)

    def _take_attached(self, item: Any) -> None:
        from moveit_msgs.msg import PlanningScene

        scene = PlanningScene(is_diff=True)
        scene.robot_state.attached_collision_objects = [item]
        self._apply(scene)

    def _reconfigure(self, request: Any) -> Any:
        import rospy

        changed = settings.changed(rospy.get_param("~trajectory_execution", {}), request.config)
        for name, value in changed.items():
            rospy.set_param(f"~trajectory_execution/{name}", value)
        return settings.as_config(changed)


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
