"""Real robots as simulations: a step sends commands, waits, and reads measurements."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping

import numpy as np

from frobs_core.contracts.body_handle import BodyHandle
from frobs_core.contracts.pacing import Pacer
from frobs_core.contracts.robot_handle import RobotHandle
from frobs_core.contracts.simulation import Simulation
from frobs_core.description.robot import CommandMode
from frobs_core.description.scene import Scene
from frobs_core.models.model import Pose
from frobs_core.util.arrays import Floats, Mask, read_only
from frobs_core.util.errors import ConfigurationError, SimulationError

_PERIOD = 0.02  # [s] time between commands while robots are driven home
_AT_HOME = 0.05  # [rad or m] largest distance from home, and [rad/s or m/s] largest velocity there


class MeasuredRobot(RobotHandle):
    """Handle of a robot with the joint state that was measured last.

    Attributes:
        measured: Joint positions [rad or m], velocities [rad/s or m/s] and efforts [N·m or N], (3, 1, dof).
        stays: Whether the robot stays where it is if a task places it. Otherwise, placing it raises an error.
    """

    measured: Floats
    stays: bool = False

    @property
    def joint_positions(self) -> Floats:
        """(1, dof) [rad or m]."""
        return read_only(self.measured[0])

    @property
    def joint_velocities(self) -> Floats:
        """(1, dof) [rad/s or m/s]."""
        return read_only(self.measured[1])

    @property
    def joint_efforts(self) -> Floats:
        """(1, dof) [N·m or N]."""
        return read_only(self.measured[2])

    def write_joint_state(self, positions: Floats, velocities: Floats | float = 0.0, mask: Mask | None = None) -> None:
        if not self.stays:
            super().write_joint_state(positions, velocities, mask)

    def write_base_pose(self, pos: Floats, quat_wxyz: Floats, mask: Mask | None = None) -> None:
        if not self.stays:
            super().write_base_pose(pos, quat_wxyz, mask)

    def write_base_twist(self, lin_vel_world: Floats, ang_vel_world: Floats, mask: Mask | None = None) -> None:
        if not self.stays:
            super().write_base_twist(lin_vel_world, ang_vel_world, mask)

    def limited_command(self, decimation: int, duration: float, speed: float) -> Floats:
        """Return the command at the end of the next step, clipped to the joint limits, (dof,).

        A commanded position is then clipped to the range that the joint can reach within the step, so a joint beyond its
        limits returns slowly.

        Args:
            decimation: Number of physics steps.
            duration: Duration of the step [s].
            speed: Fraction of the velocity limits that the command may use.
        """
        asked, mode = self._take_commands(decimation)[0, -1], self.command_mode
        fastest = speed * self.velocity_limit[0]
        if mode is CommandMode.POSITION:
            reach, measured = fastest * duration, self.joint_positions[0]
            low, high = self.position_lower[0], self.position_upper[0]
            return np.asarray(np.clip(np.clip(asked, low, high), measured - reach, measured + reach))
        most = fastest if mode is CommandMode.VELOCITY else self.effort_limit[0]
        return np.asarray(np.clip(asked, -most, most))


class MeasuredBody(BodyHandle):
    """Handle of a body with the pose that was measured last.

    Args:
        name: Name in the scene.
        pose: Pose before the first measurement.
        is_assumed: Whether the pose is not measured, but is the one that a task writes.
    """

    def __init__(self, name: str, pose: Pose, is_assumed: bool = False) -> None:
        self.name, self._is_assumed = name, is_assumed
        self.measure(np.array(pose.pos), np.array(pose.quat_wxyz))

    def measure(self, pos: Floats, quat_wxyz: Floats) -> None:
        """Set the pose in the world frame.

        Args:
            pos: (3,) [m]
            quat_wxyz: (4,)
        """
        self._pose = pos.reshape(1, 3), quat_wxyz.reshape(1, 4)

    @property
    def pose(self) -> tuple[Floats, Floats]:
        """pos (1, 3) [m] and quat_wxyz (1, 4) in the world frame."""
        pos, quat = self._pose
        return read_only(pos), read_only(quat)

    @property
    def twist(self) -> tuple[Floats, Floats]:
        """Zeros, because a pose does not report velocities: (1, 3) [m/s] and (1, 3) [rad/s]."""
        return np.zeros((1, 3)), np.zeros((1, 3))

    def write_pose(self, pos: Floats, quat_wxyz: Floats | None = None, mask: Mask | None = None) -> None:
        """Set an assumed pose, and do nothing for a measured one. For the arguments, see :meth:`.BodyHandle.write_pose`."""
        if self._is_assumed:
            self.measure(np.array(pos), self.pose[1] if quat_wxyz is None else np.array(quat_wxyz))


class MeasuredSimulation(Simulation):
    """Base class of paced simulations that consist of real robots.

    A subclass sets the attributes, calls :meth:`place_bodies`, and implements :meth:`send` and :meth:`receive`.

    Attributes:
        homing: Largest velocity of a joint [rad/s or m/s] when a reset drives the robots home, and the time after which
            a reset has failed [s]; or None if the robots stay where they are at a reset.
    """

    robots: Mapping[str, MeasuredRobot]
    bodies: Mapping[str, MeasuredBody]
    pacer: Pacer
    homing: tuple[float, float] | None = None

    @abstractmethod
    def send(self, decimation: int, duration: float) -> None:
        """Send the commands of the next step.

        Args:
            decimation: Number of physics steps.
            duration: Duration of the step [s].
        """

    @abstractmethod
    def receive(self, start: bool = False) -> None:
        """Read the latest measurements.

        Args:
            start: Whether a reset begins, before which the robots may have been moved.

        Raises:
            SimulationError: There are no measurements.
        """

    def place_bodies(self, scene: Scene, topics: Mapping[str, str]) -> None:
        """Create the handles of the scene's bodies. Bodies without a topic are where the scene or a task places them.

        Args:
            scene: The scene.
            topics: Topic with the pose of each body that is measured, by name.

        Raises:
            ConfigurationError: A body with a mass is not measured.
        """
        missing = [name for name, body in scene.bodies.items() if body.is_free and name not in topics]
        if missing:
            raise ConfigurationError(
                f"the poses of the bodies {', '.join(missing)} are unknown; name their topics (PoseStamped): "
                f"simulator_kwargs={{'bodies': {{'{missing[0]}': '/{missing[0]}_pose'}}}}."
            )
        self.bodies = {name: MeasuredBody(name, body.pose, name not in topics) for name, body in scene.bodies.items()}

    @property
    def time(self) -> Floats:
        """(1,) [s] since the reset."""
        return read_only(self.pacer.time)

    def reset(self, mask: Mask | None = None) -> None:
        """Drive all robots home slowly, and return when they have stopped there; or leave them where they are."""
        if mask is not None and not mask.any():
            return
        self.pacer.restart()
        self.receive(start=True)
        if self.homing is not None:
            self._drive_home(*self.homing)
            self.pacer.restart()
            return
        for robot in self.robots.values():
            robot.command(robot.holding_command(robot.joint_positions))

    def step(self, decimation: int) -> None:
        """Send the commands, wait until the step is over, and read the measurements.

        Raises:
            SimulationError: There are no measurements.
        """
        self._advance(decimation, decimation * self.physics_timestep)

    def _advance(self, decimation: int, duration: float) -> None:
        self.send(decimation, duration)
        self.pacer.wait(duration)
        self.receive()

    def _drive_home(self, speed: float, timeout: float) -> None:
        modes = {name: robot.command_modes for name, robot in self.robots.items()}
        for robot in self.robots.values():
            robot.set_command_mode(CommandMode.POSITION)
        try:
            self._move_home(speed, timeout)
        finally:  # also after a failure: the commands of the controllers are not positions
            for name, robot in self.robots.items():
                if modes[name] != robot.command_modes:
                    robot.set_command_mode(modes[name])

    def _move_home(self, speed: float, timeout: float) -> None:
        targets = {name: robot.joint_positions.copy() for name, robot in self.robots.items()}
        while not all(_is_home(robot, targets[name]) for name, robot in self.robots.items()):
            for name, robot in self.robots.items():
                step = _PERIOD * np.minimum(speed, 0.5 * robot.velocity_limit)
                targets[name] += np.clip(robot.home - targets[name], -step, step)
                robot.command(targets[name])
            self._advance(1, _PERIOD)
            if self.pacer.time[0] > timeout:
                far = ", ".join(
                    f"{joint} by {off:.2g}"
                    for robot in self.robots.values()
                    for joint, off in zip(robot.joint_names, np.abs(robot.joint_positions - robot.home)[0], strict=True)
                    if off > _AT_HOME
                )
                raise SimulationError(
                    f"the robots did not stop at their home positions within {timeout:g} s of a reset "
                    f"(off: {far or 'none'})."
                )


def _is_home(robot: RobotHandle, target: Floats) -> bool:
    return (
        np.array_equal(target, robot.home)
        and np.abs(robot.joint_positions - robot.home).max(initial=0.0) <= _AT_HOME
        and np.abs(robot.joint_velocities).max(initial=0.0) <= _AT_HOME
    )
