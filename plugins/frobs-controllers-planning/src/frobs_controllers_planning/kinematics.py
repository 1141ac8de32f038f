"""Robot kinematics with Pinocchio, built from the same model that the simulators use."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from frobs_core.models import JointType, Pose, RobotModel, outward
from frobs_core.util.arrays import Floats

_ANGULAR = (JointType.REVOLUTE, JointType.CONTINUOUS)


class Kinematics:
    """Kinematics of a robot, in the root link's frame.

    All moving joints, including mimic joints, become Pinocchio joints. Floating and planar joints stay at zero.

    Args:
        robot: The robot's model.

    Attributes:
        robot: The robot's model.
        model: Pinocchio model of the robot.
        data: Pinocchio data for the model.
        links: For each link, the index of the joint that moves the link (0 for the root) and the link's pose in the
            joint's frame.
    """

    def __init__(self, robot: RobotModel) -> None:
        self.robot = robot
        self.model = pin.Model()
        self.links: dict[str, tuple[int, Any]] = {robot.root: (0, pin.SE3.Identity())}
        columns, multipliers, offsets = [], [], []
        for joint in outward(robot):
            parent, placement = self.links[joint.parent]
            placement = placement * se3(joint.origin)
            leader = robot.leader(joint)
            if leader is not None:
                kind = pin.JointModelRevoluteUnaligned if joint.type in _ANGULAR else pin.JointModelPrismaticUnaligned
                parent = self.model.addJoint(parent, kind(np.array(joint.axis, float)), placement, joint.name)
                placement = pin.SE3.Identity()
                columns.append(robot.joint_names.index(leader.joint))
                multipliers.append(leader.multiplier)
                offsets.append(leader.offset)
            self.links[joint.child] = parent, placement
        self._columns = np.array(columns, np.intp)
        self._multipliers, self._offsets = np.array(multipliers, float), np.array(offsets, float)
        self.data = self.model.createData()

    def configuration(self, joint_positions: Floats) -> Floats:
        """Return the Pinocchio configuration for joint positions (dof,) [rad or m]."""
        positions: Floats = joint_positions[self._columns] * self._multipliers + self._offsets
        return positions

    def frame_pose(self, link: str, joint_positions: Floats) -> Any:
        """Return a link's pose in the root link's frame, as a Pinocchio SE3."""
        pin.forwardKinematics(self.model, self.data, self.configuration(joint_positions))
        joint, placement = self.links[link]
        return self.data.oMi[joint] * placement

    def frame_jacobian(self, link: str, joint_positions: Floats) -> tuple[Any, Floats]:
        """Return a link's pose as SE3 and its Jacobian (6, dof), linear rows first, in the root link's frame."""
        pose = self.frame_pose(link, joint_positions)  # computeJointJacobian does not compute the pose
        joint, placement = self.links[link]
        columns = pin.computeJointJacobian(self.model, self.data, self.configuration(joint_positions), joint)
        local = placement.toActionMatrixInverse() @ columns
        turned = np.concatenate([pose.rotation @ local[:3], pose.rotation @ local[3:]])
        jacobian = np.zeros((6, len(self.robot.joint_names)))
        np.add.at(jacobian.T, self._columns, (turned * self._multipliers).T)
        return pose, jacobian


def se3(pose: Pose) -> Any:
    """Convert a pose to a Pinocchio SE3."""
    return to_se3(np.array(pose.pos), np.array(pose.quat_wxyz))


def to_se3(pos: Floats, quat_wxyz: Floats) -> Any:
    """Convert a position (3,) [m] and a quaternion (4,), scalar first, to a Pinocchio SE3."""
    w, x, y, z = np.asarray(quat_wxyz, float) / np.linalg.norm(quat_wxyz)
    return pin.SE3(pin.Quaternion(w, x, y, z), np.asarray(pos, float))
