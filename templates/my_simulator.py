"""The simulator moves robots and bodies. It uses only NumPy: each joint moves independently, and nothing collides.

Each joint follows the drive law exactly, including gravity, but with a constant inertia: the inertia that the joint
moves in the home position. Joints do not affect each other, so the record claims ``drive: approximate``. Bodies and
floating bases fly. Contacts, rays, wrenches and rendering are not supported, and the inherited methods of
:class:`frobs_core.contracts.Simulation` raise an error.

Arrays are batched: (num_envs, …).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from frobs_core.contracts import BodyHandle, RobotHandle, Simulation, Snapshot
from frobs_core.description import AT_REST, Placement, Scene, Translation, Twist
from frobs_core.models import Pose, RobotModel, Treatment, composite_inertia
from frobs_core.util.arrays import Floats, Mask, read_only, rows_of
from frobs_core.util.errors import ConfigurationError, SimulationError
from frobs_core.util.rotations import quat_from_axis_angle, quat_multiply, quat_rotate
from frobs_models import translate

_KEPT = "moving_joints fixed_joints mimic_joints position_limits velocity_limits effort_limits joint_damping armatures"
"""Elements of a model file that are simulated without changes."""


class FreeBody(BodyHandle):
    """The pose and twist of a scene body or a robot's base.

    Args:
        name: Name in the simulation.
        num_envs: ≥ 1.
        pose: Pose at reset.
        flies: Whether gravity acts on the body.
        moves: Whether the body can be moved, which is False for static bodies.
        twist: Linear and angular velocity at reset.
    """

    def __init__(
        self, name: str, num_envs: int, pose: Pose, flies: bool, moves: bool = True, twist: Twist = AT_REST
    ) -> None:
        self.name, self._start, self.flies, self._moves, self._twist = name, pose, flies, moves, twist
        self.pos, self.quat = np.tile(pose.pos, (num_envs, 1)), np.tile(pose.quat_wxyz, (num_envs, 1))
        self.linear, self.angular = np.zeros((2, num_envs, 3))
        self.arrays = {"pos": self.pos, "quat": self.quat, "linear": self.linear, "angular": self.angular}

    @property
    def pose(self) -> tuple[Floats, Floats]:
        """pos (num_envs, 3) [m] and quat_wxyz (num_envs, 4) in the world frame."""
        return read_only(self.pos), read_only(self.quat)

    @property
    def twist(self) -> tuple[Floats, Floats]:
        """lin_vel_world (num_envs, 3) [m/s] and ang_vel_world (num_envs, 3) [rad/s]."""
        return read_only(self.linear), read_only(self.angular)

    def write_pose(self, pos: Floats, quat_wxyz: Floats | None = None, mask: Mask | None = None) -> None:
        """Teleport the body; its velocity becomes 0."""
        if not self._moves:
            raise SimulationError(f"body '{self.name}' is static and cannot be moved; set a mass or kinematic=True.")
        rows = rows_of(mask)
        self.pos[rows], self.linear[rows], self.angular[rows] = pos, 0.0, 0.0
        if quat_wxyz is not None:
            self.quat[rows] = quat_wxyz

    def write_twist(self, lin_vel_world: Floats, ang_vel_world: Floats, mask: Mask | None = None) -> None:
        """Set the velocity of a free body."""
        if not self.flies:
            raise SimulationError(f"'{self.name}' is fixed or kinematic, so its velocity cannot be set.")
        self.linear[rows_of(mask)], self.angular[rows_of(mask)] = lin_vel_world, ang_vel_world

    def reset(self, rows: Mask | slice) -> None:
        """Restore the initial pose and velocity."""
        self.pos[rows], self.quat[rows] = self._start.pos, self._start.quat_wxyz
        self.linear[rows], self.angular[rows] = self._twist

    def step(self, seconds: float, gravity: Floats) -> None:
        """Advance in free motion."""
        if self.flies:
            self.linear += seconds * gravity
            self.pos += seconds * self.linear
            speed = np.sqrt((self.angular**2).sum(axis=-1))  # (num_envs,) [rad/s]
            axis = self.angular / np.where(speed == 0.0, 1.0, speed)[:, None]
            self.quat[:] = quat_multiply(quat_from_axis_angle(axis, seconds * speed), self.quat)


class JointRobot(RobotHandle):
    """A robot whose joints move independently.

    Args:
        name: Name in the simulation.
        placement: Placement of the robot.
        num_envs: ≥ 1.
        gravity: (3,) [m/s²]
    """

    def __init__(self, name: str, placement: Placement, num_envs: int, gravity: Floats) -> None:
        robot = placement.robot
        if robot.base not in ("fixed", "floating"):
            raise ConfigurationError(
                f"robot '{robot.name}': base '{robot.base}' needs contacts, which are not supported."
            )
        self.describe(name, placement, num_envs)  # sets name, joint names, limits, home and similar attributes
        self._friction = self.expand([joint.damping for joint in self.model.actuated_joints])  # [N·m·s/rad]
        self.base = self._root = FreeBody("base", num_envs, placement.pose, flies=robot.base == "floating")
        self._gravity = np.zeros(3) if self._root.flies else gravity  # a robot in free fall is weightless
        self._q = self.home.copy()
        self._v, self._efforts = np.zeros((2, *self._q.shape))
        carried = composite_inertia(self.model, self.home[0])  # inertia moved by each joint at home [kg·m² or kg]
        motors = placement.armatures
        self._inertia = self.expand([carried[joint] + motors[joint] for joint in self.joint_names])
        own = {"q": self._q, "v": self._v, "efforts": self._efforts, "command": self._command}
        self.arrays: Snapshot = {**own, **self._root.arrays}  # the complete state

    @property
    def joint_positions(self) -> Floats:
        """(num_envs, dof) [rad or m]."""
        return read_only(self._q)

    @property
    def joint_velocities(self) -> Floats:
        """(num_envs, dof) [rad/s or m/s]."""
        return read_only(self._v)

    @property
    def joint_efforts(self) -> Floats:
        """(num_envs, dof) [N·m or N]: efforts that the drives applied in the last physics step."""
        return read_only(self._efforts)

    def write_joint_state(self, positions: Floats, velocities: Floats | float = 0.0, mask: Mask | None = None) -> None:
        """Set the joint state without simulating the motion."""
        self._q[rows_of(mask)], self._v[rows_of(mask)] = positions, velocities

    def write_base_pose(self, pos: Floats, quat_wxyz: Floats, mask: Mask | None = None) -> None:
        """Teleport the root link."""
        self._root.pos[rows_of(mask)], self._root.quat[rows_of(mask)] = pos, quat_wxyz

    def reset(self, rows: Mask | slice) -> None:
        """Return to the home position, and hold it at rest."""
        self._root.reset(rows)
        self._q[rows], self._v[rows], self._efforts[rows] = self.home[rows], 0.0, 0.0
        self._command[rows], self._command_rows = self.holding_command(self.home[rows]), None

    def step(self, seconds: float, decimation: int, gravity: Floats) -> None:
        """Advance by ``decimation`` physics steps, each lasting ``seconds`` [s]."""
        commands, weight = self._take_commands(decimation), self._weight()
        for k in range(decimation):
            self._drive(commands[:, k], seconds, weight)
            self._root.step(seconds, gravity)

    def _drive(self, target: Floats, seconds: float, weight: Floats) -> None:
        """Advance by one physics step with the drive law. Damping is implicit unless a joint is saturated."""
        kd = self._active_damping
        effort = self._factor * target - self._active_stiffness * self._q - kd * self._v
        implicit = np.where(np.abs(effort) > self.effort_limit, 0.0, kd) + self._friction
        self._efforts[:] = np.clip(effort, -self.effort_limit, self.effort_limit)
        accelerates = self._efforts + weight - self._friction * self._v
        v = self._v + seconds * accelerates / (self._inertia + seconds * implicit)
        q = self._q + seconds * v
        self._q[:] = np.clip(q, self.position_lower, self.position_upper)
        self._v[:] = np.where(q == self._q, v, 0.0)  # a limit is a hard stop

    def _weight(self) -> Floats:
        """Return the joint efforts due to gravity, (num_envs, dof) [N·m or N]."""
        weight = np.zeros_like(self._q)
        for link in self.model.links:
            if link.inertial is not None:
                pos, quat = self.frame_pose(link.name)
                center = pos + quat_rotate(quat, np.array(link.inertial.origin.pos))
                moves = self.point_jacobian(link.name, center)[:, :3]  # (num_envs, 3, dof)
                weight += link.inertial.mass * (moves * self._gravity[:, None]).sum(axis=1)
        return weight


class MySimulator(Simulation):
    """Simulates independently moving joints and free-flying bodies with NumPy."""

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
        scene.check(robots, lacking=("contacts", "attachments"))
        self.num_envs, self.physics_timestep = num_envs, physics_timestep
        self._gravity = np.array(scene.gravity)  # (3,) [m/s²]
        self.robots = self._robots = {n: JointRobot(n, p, num_envs, self._gravity) for n, p in robots.items()}
        self.bodies = self._bodies = {
            name: FreeBody(name, num_envs, body.pose, body.is_free, body.kinematic or body.is_free, body.twist)
            for name, body in scene.bodies.items()
        }
        self._time, self._diverged = np.zeros(num_envs), np.zeros(num_envs, np.bool_)
        self.state: Snapshot = {
            "time": self._time,
            "diverged": self._diverged,
        }  # state for snapshots: every array that changes
        for kind, parts in (("robots", self._robots), ("bodies", self._bodies)):
            for name, part in parts.items():
                self.state |= {f"{kind}/{name}/{key}": array for key, array in part.arrays.items()}

    @classmethod
    def translation(cls, model: RobotModel) -> Sequence[Translation]:
        """Return how each element of a robot's model file is simulated, for the output of ``frobs doctor robot``."""
        table = dict.fromkeys(_KEPT.split(), (Treatment.KEPT, ""))
        table["inertias"] = Treatment.APPROXIMATED, "each joint keeps the inertia that it moves in the home position"
        return translate(model, table, others=(Treatment.DROPPED, "ignored, because joints move independently"))

    @property
    def time(self) -> Floats:
        """(num_envs,) [s] since the reset."""
        return read_only(self._time)

    @property
    def diverged(self) -> Mask | None:
        """Environments whose state contains invalid numbers, or None."""
        return self._diverged if self._diverged.any() else None

    def reset(self, mask: Mask | None = None) -> None:
        """Return to the initial state of the scene."""
        rows = rows_of(mask)
        parts: list[JointRobot | FreeBody] = [*self._robots.values(), *self._bodies.values()]
        for part in parts:
            part.reset(rows)
        self._time[rows], self._diverged[rows] = 0.0, False

    def step(self, decimation: int) -> None:
        """Advance every environment."""
        for robot in self._robots.values():
            before = robot.joint_positions.copy()
            robot.step(self.physics_timestep, decimation, self._gravity)
            lost = np.asarray(~np.isfinite(robot.joint_positions + robot.joint_velocities).all(axis=-1))
            robot.write_joint_state(before[lost], 0.0, lost)
            self._diverged |= lost
        for body in self._bodies.values():
            for _ in range(decimation):
                body.step(self.physics_timestep, self._gravity)
        self._time += decimation * self.physics_timestep


if __name__ == "__main__":  # python my_simulator.py checks the capabilities that its record declares
    from frobs_core.plugins.records import Level, SimulatorRecord
    from frobs_devkit.testing import check_simulator, run_checks

    exact = dict.fromkeys(("determinism", "snapshot", "teleport", "pause", "batched"), Level.EXACT)
    record = SimulatorRecord(
        name="my_simulator",
        summary="independent joints, in NumPy",
        entry_point="__main__:MySimulator",
        capabilities={**exact, "drive": Level.APPROXIMATE},
    )
    for result in run_checks(check_simulator(record)).results:
        print(result.status, result.name, result.message)
