"""The simulator: how robots and bodies move. This one is NumPy alone: each joint moves by itself, and nothing touches.

Its joints follow the drive law exactly, against gravity and with the inertia that they carry at home; that one joint's
motion shakes the others is left out, which is what ``drive: approximate`` in its record says. Bodies and floating bases
fly. It has no contacts, rays, wrenches and pictures, and says so.

Arrays are batched: (num_envs, …). State is replaced, never written in place, so what was handed out stays as it was.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from frobs_core.arrays import Floats, Mask, read_only
from frobs_core.errors import CapabilityError, ConfigurationError, SimulationError
from frobs_core.interfaces import (
    Body,
    BodyHandle,
    CommandMode,
    Placement,
    RobotHandle,
    Scene,
    Simulation,
    Snapshot,
    Translation,
)
from frobs_core.models import (
    Joint,
    JointType,
    Pose,
    RobotModel,
    Treatment,
    elements,
)
from frobs_core.rotations import quat_conjugate, quat_from_axis_angle, quat_multiply, quat_rotate

_MODES = tuple(CommandMode)
_KEPT = (
    *("moving_joints", "fixed_joints", "mimic_joints", "position_limits", "velocity_limits", "effort_limits"),
    *("joint_damping", "armatures"),
)
"""What of a model file is simulated as it stands; inertias are only those that each joint carries at home."""


class FreeBody:
    """What a floating base and a body of the scene have in common: a pose and a twist, each (num_envs, …).

    Args:
        num_envs: ≥ 1.
        pose: At reset.
        flies: Whether gravity pulls at it.
    """

    def __init__(self, num_envs: int, pose: Pose, flies: bool) -> None:
        self.flies = flies
        self._start = (np.tile(pose.pos, (num_envs, 1)), np.tile(pose.quat_wxyz, (num_envs, 1)))
        self.pos, self.quat = self._start
        self.linear: Floats = np.zeros((num_envs, 3))
        self.angular: Floats = np.zeros((num_envs, 3))

    def reset(self, mask: Mask) -> None:
        """Go back to where it was placed, at rest."""
        self.place(self._start[0][mask], self._start[1][mask], mask)

    def place(self, pos: Floats, quat: Floats | None, mask: Mask) -> None:
        """Put it somewhere, at rest; (n, 3) [m] and (n, 4)."""
        self.pos = _replaced(self.pos, pos, mask)
        self.quat = self.quat if quat is None else _replaced(self.quat, quat, mask)
        self.linear, self.angular = _replaced(self.linear, 0.0, mask), _replaced(self.angular, 0.0, mask)

    def step(self, seconds: float, gravity: Floats) -> None:
        """Fly."""
        if not self.flies:
            return
        self.linear = self.linear + seconds * gravity
        self.pos = self.pos + seconds * self.linear
        speed = np.sqrt((self.angular**2).sum(axis=-1))  # (num_envs,) [rad/s]
        axis = self.angular / np.where(speed == 0.0, 1.0, speed)[:, None]
        self.quat = quat_multiply(quat_from_axis_angle(axis, seconds * speed), self.quat)

    def snapshot(self, name: str) -> Snapshot:
        """Return the complete state, under names that begin with ``name``."""
        return {f"{name}/{part}": getattr(self, part).copy() for part in ("pos", "quat", "linear", "angular")}

    def restore(self, name: str, snapshot: Snapshot) -> None:
        """Return to a snapshot."""
        for part in ("pos", "quat", "linear", "angular"):
            setattr(self, part, snapshot[f"{name}/{part}"].copy())


class SceneBody(BodyHandle):
    """A body of the scene."""

    def __init__(self, name: str, body: Body, num_envs: int) -> None:
        self.name = name
        self._is_static = body.mass is None and not body.kinematic
        self.free = FreeBody(num_envs, body.pose, flies=body.mass is not None)

    @property
    def pose(self) -> tuple[Floats, Floats]:
        """pos (num_envs, 3) [m] and quat_wxyz (num_envs, 4) in the world."""
        return read_only(self.free.pos), read_only(self.free.quat)

    @property
    def twist(self) -> tuple[Floats, Floats]:
        """lin_vel_world (num_envs, 3) [m/s] and ang_vel_world (num_envs, 3) [rad/s]."""
        return read_only(self.free.linear), read_only(self.free.angular)

    def write_pose(self, pos: Floats, quat_wxyz: Floats | None = None, mask: Mask | None = None) -> None:
        """Put the body somewhere at once."""
        if self._is_static:
            raise SimulationError(f"body '{self.name}' is static; give it a mass, or kinematic=True.")
        self.free.place(pos, quat_wxyz, _all(self.free.pos) if mask is None else mask)


class JointRobot(RobotHandle):
    """A robot whose joints move one by one.

    Args:
        name: In the simulation.
        placement: Its description, its model and its place.
        num_envs: ≥ 1.
        gravity: (3,) [m/s²]
    """

    def __init__(self, name: str, placement: Placement, num_envs: int, gravity: Floats) -> None:
        robot, model = placement.robot, placement.model
        if robot.base not in ("fixed", "floating"):
            raise ConfigurationError(f"robot '{robot.name}': base '{robot.base}' needs contacts, which are not here.")
        self.describe(name, placement, num_envs)  # name, joint names, limits, home and the like
        self._kp, self._kd = self.described_gains()
        self._friction = self.expand([joint.damping for joint in model.actuated_joints])  # [N·m·s/rad]
        self.base = FreeBody(num_envs, placement.pose, flies=robot.base == "floating")
        self._gravity = gravity if robot.base == "fixed" else np.zeros(3)  # what falls with its base is weightless
        self._parents = {joint.child: joint for joint in model.joints}
        self._mode = placement.command_mode
        self._positions, self._velocities = self.home, np.zeros_like(self.home)
        self._efforts: Floats = np.zeros_like(self.home)
        self._inertia = self._joint_inertia()  # (num_envs, dof) [kg·m² or kg]
        self.set_command_mode(self._mode)

    # -- What tasks and controllers read and write --

    @property
    def joint_positions(self) -> Floats:
        """(num_envs, dof) [rad or m]."""
        return read_only(self._positions)

    @property
    def joint_velocities(self) -> Floats:
        """(num_envs, dof) [rad/s or m/s]."""
        return read_only(self._velocities)

    @property
    def joint_efforts(self) -> Floats:
        """(num_envs, dof) [N·m or N]: what the drives applied in the last physics step."""
        return read_only(self._efforts)

    def write_joint_state(self, positions: Floats, velocities: Floats | float = 0.0, mask: Mask | None = None) -> None:
        """Put the joints somewhere at once."""
        rows = _all(self._positions) if mask is None else mask
        self._positions = _replaced(self._positions, positions, rows)
        self._velocities = _replaced(self._velocities, velocities, rows)

    @property
    def command_mode(self) -> CommandMode:
        """What commands mean."""
        return self._mode

    def set_command_mode(self, mode: CommandMode) -> None:
        """Change what commands mean, and hold."""
        self._mode = mode
        self._command = self._positions if mode is CommandMode.POSITION else np.zeros_like(self._positions)

    def command(self, values: Floats) -> None:
        """Set what the drives follow: (num_envs, dof), or a row for each physics step of the next ``step``."""
        self._command = np.array(values)

    def drive_gains(self) -> tuple[Floats, Floats]:
        """Return Kp and Kd, (num_envs, dof) each."""
        return read_only(self._kp), read_only(self._kd)

    @property
    def base_pose(self) -> tuple[Floats, Floats]:
        """pos (num_envs, 3) [m] and quat_wxyz (num_envs, 4) of the root link in the world."""
        return read_only(self.base.pos), read_only(self.base.quat)

    @property
    def base_twist(self) -> tuple[Floats, Floats]:
        """lin_vel_world (num_envs, 3) [m/s] and ang_vel_world (num_envs, 3) [rad/s] of the root link."""
        return read_only(self.base.linear), read_only(self.base.angular)

    def write_base_pose(self, pos: Floats, quat_wxyz: Floats, mask: Mask | None = None) -> None:
        """Put the root link somewhere at once."""
        rows = _all(self._positions) if mask is None else mask
        linear, angular = self.base_twist
        self.base.place(pos, quat_wxyz, rows)
        self.base.linear, self.base.angular = linear, angular

    def write_base_twist(self, lin_vel_world: Floats, ang_vel_world: Floats, mask: Mask | None = None) -> None:
        """Give a floating root link a velocity at once."""
        if not self.base.flies:
            raise SimulationError(f"the base of robot '{self.name}' is fixed; it has no velocity.")
        rows = _all(self._positions) if mask is None else mask
        self.base.linear = _replaced(self.base.linear, lin_vel_world, rows)
        self.base.angular = _replaced(self.base.angular, ang_vel_world, rows)

    def frame_pose(self, frame: str, joint_positions: Floats | None = None) -> tuple[Floats, Floats]:
        """Return where a link is in the world, now or for given joint positions."""
        if joint_positions is not None:
            return self.planned_frame_pose(frame, joint_positions)
        pos, quat = self.model.frame_pose(self.frame_name(frame), self._positions)
        return self.base.pos + quat_rotate(self.base.quat, pos), quat_multiply(self.base.quat, quat)

    def frame_velocity(self, frame: str) -> tuple[Floats, Floats]:
        """Return lin_vel_world [m/s] and ang_vel_world [rad/s] of a link's origin, (num_envs, 3) each."""
        twist = (self.frame_jacobian(frame) * self._velocities[:, None, :]).sum(axis=-1)  # (num_envs, 6)
        lever = self.frame_pose(frame)[0] - self.base.pos
        return (
            twist[:, :3] + self.base.linear + np.cross(self.base.angular, lever),
            twist[:, 3:] + self.base.angular,
        )

    def frame_jacobian(self, frame: str) -> Floats:
        """Return (num_envs, 6, dof): lin_vel_world and ang_vel_world per joint velocity."""
        return self._jacobian(self.frame_name(frame), self.frame_pose(frame)[0])

    def lidar(self, name: str) -> Floats:
        """Raise CapabilityError: there are no rays."""
        self.lidar_rays(name)
        raise CapabilityError("my_simulator", [("the caller", "rays", "approximate", "unsupported")])

    # -- Motion --

    def reset(self, mask: Mask) -> None:
        """Go home, at rest, and hold."""
        self.base.reset(mask)
        self.write_joint_state(self.home[mask], 0.0, mask)
        hold = self._positions if self._mode is CommandMode.POSITION else np.zeros_like(self._positions)
        command = self._command if self._command.ndim == 2 else self._command[:, -1]
        self._command = _replaced(command, hold[mask], mask)
        self._efforts = _replaced(self._efforts, 0.0, mask)

    def step(self, seconds: float, decimation: int, gravity: Floats) -> None:
        """Advance by ``decimation`` physics steps of so many seconds."""
        rows = self._command if self._command.ndim == 3 else np.repeat(self._command[:, None], decimation, axis=1)
        if rows.shape[1] != decimation:
            raise SimulationError(
                f"the command of robot '{self.name}' has {rows.shape[1]} rows for {decimation} steps."
            )
        weight = self._weight()
        for k in range(decimation):
            self._drive(rows[:, k], seconds, weight)
            self.base.step(seconds, gravity)
        self._command = rows[:, -1]

    def _drive(self, target: Floats, seconds: float, weight: Floats) -> None:
        """Move by one physics step of the drive law: the damping is implicit, but for joints that saturate."""
        q, v, kd = self._positions, self._velocities, self._kd
        if self._mode is CommandMode.POSITION:
            effort = self._kp * (target - q) - kd * v
        elif self._mode is CommandMode.VELOCITY:
            effort = kd * (target - v)
        else:
            effort, kd = target, np.zeros_like(kd)
        implicit = np.where(np.abs(effort) > self.effort_limit, 0.0, kd) + self._friction
        self._efforts = np.clip(effort, -self.effort_limit, self.effort_limit)
        accelerates = self._efforts - weight - self._friction * v
        v = v + seconds * accelerates / (self._inertia + seconds * implicit)
        q = q + seconds * v
        self._positions = np.clip(q, self.position_lower, self.position_upper)
        self._velocities = np.where(q == self._positions, v, 0.0)  # a limit is a hard stop

    def _weight(self) -> Floats:
        """Return the efforts that hold the robot against gravity, (num_envs, dof)."""
        holding = np.zeros_like(self._positions)
        for link in self.model.links:
            if link.inertial is not None:
                pos, quat = self.frame_pose(link.name)
                center = pos + quat_rotate(quat, np.array(link.inertial.origin.pos))
                moves = self._jacobian(link.name, center)[:, :3]  # (num_envs, 3, dof)
                holding = holding - link.inertial.mass * (moves * self._gravity[:, None]).sum(axis=1)
        return np.asarray(holding)

    def _joint_inertia(self) -> Floats:
        """Return what each joint has to move, alone and at home: (num_envs, dof) [kg·m² or kg]."""
        inertia = np.array([joint.armature for joint in self.model.actuated_joints])
        for link in self.model.links:
            if link.inertial is None:
                continue
            pos, quat = self.frame_pose(link.name)
            center = pos + quat_rotate(quat, np.array(link.inertial.origin.pos))
            jacobian = self._jacobian(link.name, center)[0]  # (6, dof)
            axes = quat_conjugate(quat_multiply(quat[0], np.array(link.inertial.origin.quat_wxyz)))
            turns = quat_rotate(axes, jacobian[3:].T)  # (dof, 3) in the axes of the inertia
            xx, xy, xz, yy, yz, zz = link.inertial.inertia
            tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            inertia = inertia + link.inertial.mass * (jacobian[:3] ** 2).sum(axis=0)
            inertia = inertia + (turns[:, :, None] * tensor * turns[:, None, :]).sum(axis=(1, 2))
        return self.expand(np.maximum(inertia, 1e-4))

    def _jacobian(self, link: str, point: Floats) -> Floats:
        """Return how a point (num_envs, 3) of a link moves with each joint: (num_envs, 6, dof)."""
        jacobian = np.zeros((self.num_envs, 6, self.dof))
        while link in self._parents:
            joint: Joint = self._parents[link]
            link = joint.parent
            if joint.type is JointType.FIXED:
                continue
            pos, quat = self.frame_pose(joint.child)
            axis = quat_rotate(quat, np.broadcast_to(np.array(joint.axis), pos.shape))
            column = self.joint_names.index(joint.mimic.joint if joint.mimic else joint.name)
            factor = joint.mimic.multiplier if joint.mimic else 1.0
            if joint.type is JointType.PRISMATIC:
                jacobian[:, :3, column] += factor * axis
            else:
                jacobian[:, :3, column] += factor * np.cross(axis, point - pos)
                jacobian[:, 3:, column] += factor * axis
        return jacobian

    def snapshot(self) -> Snapshot:
        """Return the complete state."""
        return {
            "positions": self._positions.copy(),
            "velocities": self._velocities.copy(),
            "efforts": self._efforts.copy(),
            "command": self._command.copy(),
            "mode": np.full(self.num_envs, _MODES.index(self._mode)),
            **self.base.snapshot("base"),
        }

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""
        self._positions, self._velocities = snapshot["positions"].copy(), snapshot["velocities"].copy()
        self._efforts, self._command = snapshot["efforts"].copy(), snapshot["command"].copy()
        self._mode = _MODES[int(snapshot["mode"][0])]
        self.base.restore("base", snapshot)


class MySimulator(Simulation):
    """Joints that move one by one, and bodies that fly, in NumPy."""

    render_modalities = ()

    def __init__(
        self,
        robots: Mapping[str, Placement],
        scene: Scene,
        *,
        num_envs: int,
        physics_timestep: float,
        num_threads: int = 0,
    ) -> None:
        scene.check(robots)
        if scene.contacts:
            raise ConfigurationError(
                f"the scene asks for the contacts {', '.join(scene.contacts)}; there are none here."
            )
        self.num_envs, self.physics_timestep = num_envs, physics_timestep
        self._gravity = np.array(scene.gravity)  # (3,) [m/s²]
        self._robots = {name: JointRobot(name, p, num_envs, self._gravity) for name, p in robots.items()}
        self._bodies = {name: SceneBody(name, body, num_envs) for name, body in scene.bodies.items()}
        self.robots, self.bodies = self._robots, self._bodies
        self._time: Floats = np.zeros(num_envs)
        self._diverged: Mask = np.zeros(num_envs, np.bool_)

    @classmethod
    def translation(cls, model: RobotModel) -> Sequence[Translation]:
        """Say what becomes of a robot's model file; ``frobs doctor robot`` shows it."""
        return [
            Translation(element=element, treatment=Treatment.KEPT)
            if element in _KEPT
            else Translation(element=element, treatment=Treatment.APPROXIMATED, how="what each joint carries at home")
            if element == "inertias"
            else Translation(element=element, treatment=Treatment.DROPPED, how="joints move one by one, without it")
            for element in elements(model)
        ]

    @property
    def native(self) -> None:
        """There is no engine."""
        return

    @property
    def time(self) -> Floats:
        """(num_envs,) [s] since the reset."""
        return read_only(self._time)

    @property
    def diverged(self) -> Mask | None:
        """Which environments are no longer numbers, or None."""
        return self._diverged if self._diverged.any() else None

    def reset(self, mask: Mask | None = None) -> None:
        """Go back to the scene as it was built."""
        rows = _all(self._time) if mask is None else mask
        for robot in self._robots.values():
            robot.reset(rows)
        for body in self._bodies.values():
            body.free.reset(rows)
        self._time = _replaced(self._time, 0.0, rows)
        self._diverged = self._diverged & ~rows

    def step(self, decimation: int) -> None:
        """Advance every environment."""
        for robot in self._robots.values():
            before = robot.joint_positions
            robot.step(self.physics_timestep, decimation, self._gravity)
            lost = ~np.isfinite(robot.joint_positions + robot.joint_velocities).all(axis=-1)
            if lost.any():
                robot.write_joint_state(before[lost], 0.0, lost)
                self._diverged = self._diverged | lost
        for body in self._bodies.values():
            for _ in range(decimation):
                body.free.step(self.physics_timestep, self._gravity)
        self._time = self._time + decimation * self.physics_timestep

    def snapshot(self) -> Snapshot:
        """Return the complete state."""
        state = {"time": self._time.copy(), "diverged": self._diverged.copy()}
        for name, robot in self._robots.items():
            state |= {f"robots/{name}/{key}": array for key, array in robot.snapshot().items()}
        for name, body in self._bodies.items():
            state |= body.free.snapshot(f"bodies/{name}")
        return state

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""
        self._time, self._diverged = snapshot["time"].copy(), snapshot["diverged"].copy()
        for name, robot in self._robots.items():
            start = f"robots/{name}/"
            robot.restore({key.removeprefix(start): a for key, a in snapshot.items() if key.startswith(start)})
        for name, body in self._bodies.items():
            body.free.restore(f"bodies/{name}", snapshot)

    def close(self) -> None:
        """There is nothing to release."""


def _all(array: np.ndarray[Any, Any]) -> Mask:
    return np.ones(len(array), np.bool_)


def _replaced(array: Floats, values: Floats | float, mask: Mask) -> Floats:
    """Return a copy with other values in the rows of a mask."""
    copy = array.copy()
    copy[mask] = values
    return copy


if __name__ == "__main__":  # python my_simulator.py: does it do what its record claims?
    from frobs_core.capabilities import Level
    from frobs_core.specs import SimulatorRecord
    from frobs_devkit.testing import check_simulator, run_checks

    exact = dict.fromkeys(("determinism", "snapshot", "teleport", "pause", "batched"), Level.EXACT)
    record = SimulatorRecord(
        name="my_simulator",
        summary="joints one by one, in NumPy",
        entry_point="__main__:MySimulator",
        capabilities={**exact, "drive": Level.APPROXIMATE},
    )
    for result in run_checks(check_simulator(record)).results:
        print(result.status, result.name, result.message)
