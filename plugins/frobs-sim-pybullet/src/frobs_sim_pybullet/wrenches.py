"""A robot's force-torque sensor in one environment."""

from __future__ import annotations

import numpy as np

from frobs_core.models import Pose
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import UnsuitableRobotError
from frobs_models import joints_below
from frobs_sim_pybullet.articulation import Articulation
from frobs_sim_pybullet.bullet import pybullet as p
from frobs_sim_pybullet.bullet import quiet
from frobs_sim_pybullet.transforms import compose, conjugate, cross, from_pose, rotate


class WrenchSensor:
    """A force-torque sensor at a link's joint. The sensor adds up the joint reactions that Bullet reports.

    The sensor usually reads only the link's own joint. If the link is not a separate body in Bullet, the sensor reads
    the joints of the link's nearest descendants that are separate bodies.

    Raises:
        UnsuitableRobotError: The link is the robot's base in Bullet, which has no joint.
    """

    def __init__(self, robot: Articulation, link: str, pose: Pose) -> None:
        self._robot, bones = robot, robot.bones
        children, waiting, self._joints = joints_below(robot.placement.model), [link], list[int]()
        while waiting:
            name = waiting.pop()
            if name in bones.bodies:
                self._joints.append(robot.links[name])
            else:
                waiting += [joint.child for joint in children.get(name, ())]
        if min(self._joints) < 0:
            raise UnsuitableRobotError(
                robot.name, f"has '{link}' as its base in PyBullet, so this link has no joint to measure."
            )
        with quiet():  # Bullet prints a message if another sensor already reads this joint
            for joint in self._joints:
                p.enableJointForceTorqueSensor(robot.body, joint, True, robot.client)
        body, place = bones.frames[link]
        self._body = robot.links[body]
        self._place = compose(compose(robot.com_backs[self._body], place), from_pose(pose))

    def read(self) -> Floats:
        """Return the force [N] and torque [N·m] of the last physics step in the sensor's frame, (6,)."""
        robot, total = self._robot, np.zeros(6)
        origin, turn = compose(robot.com(self._body), self._place)
        back = conjugate(turn)
        for joint in self._joints:  # Bullet's wrench refers to the child's center of mass and the child's axes
            wrench = p.getJointState(robot.body, joint, robot.client)[2]
            center, axes = robot.com(joint)
            force, torque = rotate(axes, wrench[:3]), rotate(axes, wrench[3:])
            lever = cross((center[0] - origin[0], center[1] - origin[1], center[2] - origin[2]), force)
            total[:3] += rotate(back, force)
            total[3:] += rotate(back, (torque[0] + lever[0], torque[1] + lever[1], torque[2] + lever[2]))
        return total
