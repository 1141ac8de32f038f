"""Plans motions of one joint group in a planning scene."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from frobs_controllers_planning import Plan, Planner, ToolGoal
from frobs_core.description import Robot, Scene
from frobs_core.models import Joint, JointLimits, JointType, Link, RobotModel
from frobs_core.util.arrays import Floats
from frobs_rl_compat.moveit import scene as scenes
from frobs_rl_compat.moveit.description import RobotDescription
from frobs_rl_compat.moveit.errors import MoveItCommanderException
from frobs_rl_compat.moveit.semantics import Group

CLEARANCE = 0.01
"""Distance that planned motions keep from obstacles [m], which allows for the tracking errors of the controllers."""

_HELD = 1e-9  # [rad or m] half the width of a held joint's range; the search requires a nonzero range for every joint
_MOVED = 1e-4  # [rad or m] the planner is rebuilt after a joint outside the group moves by about this amount


class GroupPlanner:
    """Plans motions of one joint group, while all other joints stay at their initial positions."""

    def __init__(self, description: RobotDescription, group: Group) -> None:
        self._description, self._group = description, group
        self._key: tuple[Any, ...] = ()
        self._planner: Planner | None = None

    def plan(
        self,
        start: Mapping[str, float],
        goal: Floats | ToolGoal,
        *,
        link: str,
        scene: Any,
        velocity_scaling: float,
        acceleration_scaling: float,
        max_seconds: float,
    ) -> Plan:
        """Plan a motion, and return a plan for all joints of the robot."""
        names, group = self._description.model.joint_names, self._group.joint_names
        others = {name: start[name] for name in names if name not in group}
        planner = self._made(others, link, scene, velocity_scaling, acceleration_scaling)
        if not isinstance(goal, ToolGoal):
            goal_positions = {**start, **dict(zip(group, goal.tolist(), strict=True))}
            # Clipping also moves the held joints into their narrow limits.
            goal = np.clip([goal_positions[name] for name in names], planner.lower, planner.upper)
        return planner.plan([start[name] for name in names], goal, max_seconds=max_seconds)

    def _made(
        self, others: Mapping[str, float], link: str, scene: Any, velocity_scaling: float, acceleration_scaling: float
    ) -> Planner:
        """Return the planner, rebuilding it only if one of the arguments has changed."""
        objects, attached = scene.world.collision_objects, scene.robot_state.attached_collision_objects
        places = tuple(round(value / _MOVED) for value in others.values())
        key = (places, link, velocity_scaling, acceleration_scaling, repr(objects), repr(attached))
        if self._planner is not None and key == self._key:
            return self._planner
        description = self._description
        model = with_attached(hold(description.model, others), attached)
        touching = [
            (item.object.id, other)
            for item in attached
            for other in (*item.touch_links, *(another.object.id for another in attached))
        ]
        self._planner = Planner(
            Robot(model=str(model.path), name=model.name, tcp=link or model.root),
            Scene(floor=False, bodies={item.id: scenes.body(item) for item in objects}),
            model=model,
            clearance=CLEARANCE,
            velocity_scaling=velocity_scaling,
            acceleration_scaling=acceleration_scaling,
            max_acceleration=description.max_acceleration,
            may_touch=[*description.semantics.may_touch, *touching],
        )
        self._key = key
        return self._planner


def hold(model: RobotModel, positions: Mapping[str, float]) -> RobotModel:
    """Return a robot model in which each joint in ``positions`` is held at the given position [rad or m].

    Held joints keep their type, so that the set of link pairs that are allowed to touch does not change.
    """

    def limits(joint: Joint) -> JointLimits:
        if joint.name not in positions:
            return joint.limits
        position = positions[joint.name]
        return replace(joint.limits, lower=position - _HELD, upper=position + _HELD)

    return replace(model, joints=tuple(replace(joint, limits=limits(joint)) for joint in model.joints))


def with_attached(model: RobotModel, attached: Collection[Any]) -> RobotModel:
    """Return a robot model with an additional link for each ``moveit_msgs/AttachedCollisionObject``."""
    names = {link.name for link in model.links}
    links, joints = [*model.links], [*model.joints]
    for item in attached:
        name = item.object.id
        if name in names:
            raise MoveItCommanderException(
                f"the attached object '{name}' has the same name as a link of the robot; rename the object."
            )
        placed = scenes.body(item.object).pose
        links.append(Link(name, collisions=scenes.collisions(item.object)))
        joints.append(Joint(f"{name} (attached)", JointType.FIXED, item.link_name, name, origin=placed))
    return replace(model, links=tuple(links), joints=tuple(joints))
