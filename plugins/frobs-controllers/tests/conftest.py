"""A fake robot for tests of controllers: pure NumPy kinematics, joints that close a share of their error at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from frobs_core.contracts import CommandMode, RobotHandle
from frobs_core.description import DifferentialDrive, DriveGains, EndEffector, Robot
from frobs_core.models.model import Inertial, Joint, JointLimits, JointType, Link, Pose, RobotModel

# The IRB120: joint offset [m], axis, lower, upper [rad], velocity [rad/s].
IRB120 = [
    ((0.0, 0.0, 0.0), (0, 0, 1), -2.87979, 2.87979, 4.36332),
    ((0.0, 0.0, 0.29), (0, 1, 0), -1.91986, 1.91986, 4.36332),
    ((0.0, 0.0, 0.27), (0, 1, 0), -1.91986, 1.22173, 4.36332),
    ((0.0, 0.0, 0.07), (1, 0, 0), -2.79253, 2.79253, 5.58505),
    ((0.302, 0.0, 0.0), (0, 1, 0), -2.094395, 2.094395, 5.58505),
    ((0.072, 0.0, 0.0), (1, 0, 0), -6.98132, 6.98132, 7.33038),
]
HOME = np.array([0.0, 0.2, 0.1, 0.0, 0.8, 0.0])


def arm_model() -> RobotModel:
    inertial = Inertial(1.0, Pose((0.0, 0.0, 0.05)), (0.01, 0.0, 0.0, 0.01, 0.0, 0.01))
    links = tuple(Link(name=f"link_{i}", inertial=inertial) for i in range(7))
    joints = tuple(
        Joint(
            name=f"joint_{i + 1}",
            type=JointType.REVOLUTE,
            parent=f"link_{i}",
            child=f"link_{i + 1}",
            origin=Pose(offset),
            axis=tuple(map(float, axis)),
            limits=JointLimits(lower, upper, velocity, 1000.0),
        )
        for i, (offset, axis, lower, upper, velocity) in enumerate(IRB120)
    )
    return RobotModel(name="fake_arm", path=Path("fake.urdf"), format="urdf", xml="", links=links, joints=joints)


def cart_model(wheel_velocity: float = np.inf) -> RobotModel:
    links = tuple(Link(name=name) for name in ("base", "left", "right", "mast"))
    limits = JointLimits(velocity=wheel_velocity)
    joints = (
        Joint("left_wheel", JointType.CONTINUOUS, "base", "left", limits=limits),
        Joint("mast_lift", JointType.PRISMATIC, "base", "mast"),
        Joint("right_wheel", JointType.CONTINUOUS, "base", "right", limits=limits),
    )
    return RobotModel(name="fake_cart", path=Path("fake.urdf"), format="urdf", xml="", links=links, joints=joints)


CART = Robot(
    model="fake.urdf",
    name="fake_cart",
    base="wheeled",
    differential_drive=DifferentialDrive(
        left=("left_wheel",),
        right=("right_wheel",),
        separation=0.23,
        wheel_radius=0.035,
        max_linear_velocity=0.7,
        max_angular_velocity=3.0,
    ),
)


GRIPPER = Robot(
    model="fake.urdf",
    name="fake_gripper",
    groups={"fingers": tuple(f"joint_{i + 1}" for i in range(6))},
    end_effectors={
        "fingers": EndEffector(
            tcp="link_6",
            group="fingers",
            open={f"joint_{i + 1}": 0.5 for i in range(6)},
            closed={f"joint_{i + 1}": -0.5 for i in range(6)},
        )
    },
)
"""The fake arm as a gripper with six fingers."""


class FakeRobot(RobotHandle):
    """Joints close ``share`` of their position error in each step, and hang ``sag`` [rad] below it."""

    def __init__(self, num_envs=1, *, model=None, robot=None, home=None, share=1.0, sag=0.0):
        self.model = arm_model() if model is None else model
        self.robot = Robot(model="fake.urdf", name=self.model.name) if robot is None else robot
        self.name, self.num_envs = "robot", num_envs
        self.joints, self.joint_names = self.model.actuated_joints, self.model.joint_names
        self.dof = len(self.joint_names)
        self.tcp = self.model.links[-1].name
        self.group_name = next(iter(self.robot.groups), "all")
        self.end_effector = self.robot.end_effector_of(self.group_name)
        limits = [joint.limits for joint in self.model.actuated_joints]
        tile = lambda values: np.tile(np.array(values, dtype=float), (num_envs, 1))  # noqa: E731
        self.position_lower, self.position_upper = tile([x.lower for x in limits]), tile([x.upper for x in limits])
        self.velocity_limit, self.effort_limit = tile([x.velocity for x in limits]), tile([x.effort for x in limits])
        default = HOME if self.dof == 6 else np.zeros(self.dof)
        self.home = tile(default if home is None else home)
        self.share, self.sag = share, sag
        self._q, self._commanded = self.home.copy(), self.home.copy()
        self._moved()

    def step(self) -> None:
        self._q = self._q + self.share * (self._commanded - self.sag - self._q)
        self._moved()

    def _moved(self) -> None:
        """Compute where the last link is, and its Jacobian: stacked products only, as the engines' are."""
        n = self.num_envs
        rotation, pos = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3))
        axes, origins = [], []
        for i, joint in enumerate(self.model.actuated_joints):
            pos = pos + (rotation @ np.array(joint.origin.pos)[None, :, None])[:, :, 0]
            axis = (rotation @ np.array(joint.axis)[None, :, None])[:, :, 0]
            axes.append(axis)
            origins.append(pos)
            rotation = rotation @ _rotation(np.array(joint.axis), self._q[:, i])
        linear = [np.cross(axis, pos - origin) for axis, origin in zip(axes, origins, strict=True)]
        self._jacobian = np.concatenate([np.stack(linear, -1), np.stack(axes, -1)], axis=1)
        self._pose = pos, _quat_wxyz(rotation)
        self.rotation = rotation

    joint_positions = property(lambda self: self._q)
    joint_velocities = property(lambda self: np.zeros_like(self._q))
    joint_efforts = property(lambda self: np.zeros_like(self._q))
    command_mode = property(lambda self: CommandMode.POSITION)
    base_pose = property(lambda self: (np.zeros((self.num_envs, 3)), np.tile([1.0, 0, 0, 0], (self.num_envs, 1))))
    base_twist = property(lambda self: (np.zeros((self.num_envs, 3)), np.zeros((self.num_envs, 3))))

    def write_joint_state(self, positions, velocities=0.0, mask=None):
        rows = slice(None) if mask is None else mask
        self._q = self._q.copy()
        self._q[rows] = positions
        self._commanded = self._q.copy()
        self._moved()

    def command(self, values):
        self._commanded = values.copy()

    def frame_pose(self, frame, joint_positions=None):
        return self._pose

    def frame_jacobian(self, frame):
        return self._jacobian

    def set_command_mode(self, mode): ...
    def drive_gains(self):
        gains = DriveGains(stiffness=100.0, damping=10.0)
        return np.full_like(self._q, gains.stiffness), np.full_like(self._q, gains.damping)

    def frame_velocity(self, frame):
        return np.zeros((self.num_envs, 3)), np.zeros((self.num_envs, 3))

    def _not_faked(self, *args, **kwargs):
        raise NotImplementedError("the fake robot has no such thing")

    write_base_pose = write_base_twist = lidar = _not_faked


def _rotation(axis, angle):
    """Return (n, 3, 3) rotations about one axis (Rodrigues)."""
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    sin, cos = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + sin * k + (1 - cos) * (k @ k)


def _quat_wxyz(rotation):
    """Return (n, 4) unit quaternions: the largest of the four ways to write q qᵀ's rows."""
    r = rotation
    trace = r[:, 0, 0] + r[:, 1, 1] + r[:, 2, 2]
    outer = np.stack(
        [
            np.stack([1 + trace, r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], -1),
            np.stack(
                [r[:, 2, 1] - r[:, 1, 2], 1 + 2 * r[:, 0, 0] - trace, r[:, 0, 1] + r[:, 1, 0], r[:, 0, 2] + r[:, 2, 0]],
                -1,
            ),
            np.stack(
                [r[:, 0, 2] - r[:, 2, 0], r[:, 0, 1] + r[:, 1, 0], 1 + 2 * r[:, 1, 1] - trace, r[:, 1, 2] + r[:, 2, 1]],
                -1,
            ),
            np.stack(
                [r[:, 1, 0] - r[:, 0, 1], r[:, 0, 2] + r[:, 2, 0], r[:, 1, 2] + r[:, 2, 1], 1 + 2 * r[:, 2, 2] - trace],
                -1,
            ),
        ],
        axis=1,
    )  # (n, 4, 4): 4 q qᵀ
    best = np.argmax(np.stack([outer[:, i, i] for i in range(4)], -1), axis=-1)
    row = outer[np.arange(len(r)), best]
    return row / np.sqrt((row * row).sum(-1, keepdims=True))


@pytest.fixture
def fake_arm():
    """Make a fake IRB120: ``fake_arm(num_envs, share=…, sag=…, home=…)``."""
    return FakeRobot


@pytest.fixture
def fake_gripper():
    """Make a fake gripper: ``fake_gripper(num_envs)``."""

    def make(num_envs=1):
        return FakeRobot(num_envs, robot=GRIPPER, share=0.5)

    return make


@pytest.fixture
def fake_cart():
    """Make a fake cart with two wheels and a mast without limits."""

    def make(num_envs=1, *, wheel_velocity=np.inf, robot=CART):
        return FakeRobot(num_envs, model=cart_model(wheel_velocity), robot=robot)

    return make


@pytest.fixture
def bound():
    """Bind a controller to a robot and reset it: ``bound(controller, robot)``."""

    def bind(controller, robot, control_timestep=0.04, decimation=20):
        controller.bind(robot, control_timestep, decimation)
        controller.reset(None)
        return controller

    return bind
