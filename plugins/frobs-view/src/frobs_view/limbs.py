"""Turns the wish of a person into the action of a controller, from the public settings of the controller."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from frobs_core import plugins
from frobs_core.contracts import Controller, JointGroup
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import RunError
from frobs_core.util.rotations import quat_conjugate, quat_multiply, quat_rotate

SPEED, TURN = 0.25, 1.0
"""Speed of a tool whose controller moves joints [m/s], and of its rotation and of single joints [rad/s or m/s]."""

STOP, APPROACH, AIM = 0.05, 1.0, 0.5
"""Distance from its goal at which a wheeled robot stops [m], and times in which it covers the distance and turns [s]."""


@dataclass
class Wish:
    """Motion that a person commands at a control step.

    Attributes:
        motion: Velocity along x, y and z and about these axes of the world, as a fraction of the maximum, (6,). Wheels
            use the first two: forward, and turning to the left.
        joints: Velocity of single joints, as a fraction of the maximum, by index.
        target: Position (3,) [m] and orientation (4,) to which the tool moves in a straight line, or None.
        opening: Opening of the gripper: 1 is open, −1 is closed, and None holds the gripper.
    """

    motion: Floats = field(default_factory=lambda: np.zeros(6))
    joints: dict[int, float] = field(default_factory=dict)
    target: tuple[Floats, Floats] | None = None
    opening: float | None = None


class Limb:
    """Part of a robot that one controller moves. The base class is the gripper, which has no pose to drag.

    Args:
        controller: The controller, which is bound.
        joints: The joints that it moves.
        timestep: Control timestep [s].

    Attributes:
        handle: Size of the handle that drags the limb [m], or 0 for a gripper.
        turns: Whether the handle also turns the limb.
    """

    handle: ClassVar[float] = 0.0
    turns = False

    def __init__(self, controller: Any, joints: JointGroup, timestep: float) -> None:
        self.controller, self.joints, self.timestep = controller, joints, timestep

    def begin(self) -> None:
        """Start from the current state of the robot."""

    def pose(self) -> tuple[Floats, Floats]:
        """Return the position (3,) [m] and the orientation (4,) that a handle drags."""
        pos, quat_wxyz = self.joints.frame_pose("tcp")
        return pos[0].copy(), quat_wxyz[0].copy()

    def opening(self) -> float:
        """Return the opening of the gripper, from −1 (closed) to 1 (open)."""
        return float(2.0 * self.controller.stored_arrays()["wanted"][0, 0] - 1.0)

    def action(self, wish: Wish) -> Floats:
        """Return the action that fulfills a wish, (n,) in the controller's action space."""
        sets = isinstance(self.controller, plugins.get_record("controller", "gripper_position").load())
        hold = self.opening() if sets else 0.0
        return np.array([hold if wish.opening is None else wish.opening])


class _Tool(Limb):
    handle = 0.2

    def __init__(self, controller: Any, joints: JointGroup, timestep: float) -> None:
        super().__init__(controller, joints, timestep)
        axes = getattr(controller, "axes", ("x", "y", "z"))
        self._columns = [("x", "y", "z", "rx", "ry", "rz").index(axis) for axis in axes]
        self._steps = np.repeat([controller.max_delta, getattr(controller, "max_rotation", 1.0)], 3)
        self.turns = self._columns[-1] > 2

    def action(self, wish: Wish) -> Floats:
        motion = wish.motion
        if wish.target is not None:
            pos, quat_wxyz = self.pose()
            turn = quat_multiply(wish.target[1], quat_conjugate(quat_wxyz))
            sine = float(np.linalg.norm(turn[1:]))
            vector = np.copysign(2.0 * np.arctan2(sine, abs(turn[0])) / max(sine, 1e-12), turn[0]) * turn[1:]
            motion = np.concatenate([wish.target[0] - pos, vector]) / self._steps
            motion = motion / max(1.0, float(np.abs(motion[self._columns]).max()))  # keeps the direction
        return np.clip(motion, -1.0, 1.0)[self._columns]


class _Arm(Limb):
    """Arm whose controller moves joints: the inverse kinematics of ``tcp_delta_pose`` moves its tool."""

    handle, turns = 0.2, True

    def __init__(self, controller: Any, joints: JointGroup, timestep: float) -> None:
        super().__init__(controller, joints, timestep)
        if getattr(controller, "full_range", False):
            raise RunError("joint_delta_position cannot be teleoperated with full_range; omit this setting.")
        steps = {"max_delta": SPEED * timestep, "max_rotation": min(1.0, TURN * timestep)}
        self._solver = plugins.get_record("controller", "tcp_delta_pose").load()(**steps, damping=0.05)
        self._solver.bind(joints, timestep, 1)
        self._tool = _Tool(self._solver, joints, timestep)

    def begin(self) -> None:
        self._solver.reset(None)
        self._goal = self.joints.joint_positions[0].copy()

    def action(self, wish: Wish) -> Floats:
        joints = self.joints
        if wish.joints:
            for joint in wish.joints.keys() & range(joints.dof):
                self._goal[joint] += wish.joints[joint] * TURN * self.timestep
            self._goal = np.clip(self._goal, joints.position_lower[0], joints.position_upper[0])
            self._solver.reset(None)
        elif wish.target is not None or wish.motion.any():
            self._goal = self._solver.apply(self._tool.action(wish)[None])[0].copy()
        return np.clip(self._scaled(), -1.0, 1.0)

    def _scaled(self) -> Floats:  # joint_delta_position
        step = np.minimum(self.controller.max_delta, self.joints.velocity_limit[0] * self.timestep)
        return np.asarray((self._goal - self.controller.stored_arrays()["target"][0]) / step)


class _PositionedArm(_Arm):
    def _scaled(self) -> Floats:
        lower, upper = self.joints.position_lower[0], self.joints.position_upper[0]
        lower, upper = np.where(np.isfinite(lower), lower, -np.pi), np.where(np.isfinite(upper), upper, np.pi)
        return np.asarray(2.0 * (self._goal - lower) / (upper - lower) - 1.0)


class _VelocityArm(_Arm):
    def _scaled(self) -> Floats:
        limit = np.minimum(self.joints.velocity_limit[0], self.controller.max_velocity or np.inf)
        return np.asarray((self._goal - self.joints.joint_positions[0]) / self.timestep / limit)


class _Wheels(Limb):
    handle = 0.5

    def __init__(self, controller: Any, joints: JointGroup, timestep: float) -> None:
        super().__init__(controller, joints, timestep)
        drive: Any = joints.robot.differential_drive
        linear = controller.max_linear_velocity or drive.max_linear_velocity
        self._speeds = np.array([linear, controller.max_angular_velocity or drive.max_angular_velocity])

    def pose(self) -> tuple[Floats, Floats]:
        pos, quat_wxyz = self.joints.base_pose
        return pos[0].copy(), quat_wxyz[0].copy()

    def action(self, wish: Wish) -> Floats:
        if wish.target is None:
            return np.clip(wish.motion[:2], -1.0, 1.0)
        pos, quat_wxyz = self.pose()
        ahead, left, _ = quat_rotate(quat_conjugate(quat_wxyz), wish.target[0] - pos)
        distance, bearing = float(np.hypot(ahead, left)), float(np.arctan2(left, ahead))
        speeds = np.array([max(0.0, np.cos(bearing)) * distance / APPROACH, bearing / AIM])  # turns first
        return np.clip(speeds / self._speeds if distance > STOP else np.zeros(2), -1.0, 1.0)


LIMBS: dict[str, type[Limb]] = {
    **{"tcp_delta_pose": _Tool, "tcp_delta_position": _Tool, "tcp_impedance": _Tool, "differential_drive": _Wheels},
    **{"joint_delta_position": _Arm, "joint_position": _PositionedArm, "joint_velocity": _VelocityArm},
    **{"gripper_delta": Limb, "gripper_binary": Limb, "gripper_position": Limb},
}
"""Class of the limb for each controller that can be teleoperated."""


def limb_of(name: str, controller: Controller, joints: JointGroup, timestep: float) -> Limb:
    """Return the limb that a controller moves.

    Args:
        name: Name of the joint group, for errors.
        controller: The controller.
        joints: The joints that it moves.
        timestep: Control timestep [s].

    Raises:
        RunError: The controller cannot be teleoperated.
    """
    records = plugins.records("controller")
    for key in LIMBS.keys() & records.keys():
        if isinstance(controller, records[key].load()):
            return LIMBS[key](controller, joints, timestep)
    cls = type(controller).__name__
    raise RunError(f"the controller {cls} of {name} cannot be teleoperated; choose one of {', '.join(LIMBS)}.")
