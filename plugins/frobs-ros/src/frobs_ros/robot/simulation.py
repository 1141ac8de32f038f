"""The simulator ``ros``: a robot behind ROS topics as a paced simulation."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import fields

import numpy as np

from frobs_core.contracts import CommandMode, ContactState, Pacer, Simulation, drive_home
from frobs_core.description import Placement, Scene
from frobs_core.util.arrays import Floats, Mask, read_only
from frobs_core.util.errors import ConfigurationError, ParameterValueError, UnsuitableRobotError, check_keys
from frobs_core.util.validation import positive
from frobs_ros.errors import ClockResetError, NodeEndedError, RobotSilentError
from frobs_ros.robot.commands import Commands
from frobs_ros.robot.handle import RosBody, RosRobot, Topics
from frobs_ros.ros.environment import use_ros
from frobs_ros.ros.master import require

_POLL = 0.001
"""Time between two reads of the ROS clock [s]. The clock does not advance while a simulation is paused."""

_HOMING_PERIOD = 0.02  # [s]


class RosSimulation(Simulation):
    """A robot behind ROS topics, in ROS time.

    Commands are clipped to the joint limits. Software limits do not replace the robot's emergency stop.

    Args:
        namespace: ROS namespace of the robot.
        controller: ROS controller that receives the commands. By default, a wheeled robot is controlled through its
            ``cmd_vel`` topic.
        topics: Topic names that differ from the defaults: ``joint_states``, ``odom``, ``scan`` and ``cmd_vel``.
        bodies: Topic with the pose (geometry_msgs/PoseStamped) of each body, by name. Bodies with a mass require one.
            Other bodies are where the scene or the task places them.
        speed: Fraction of the velocity limits that commands may use, in (0, 1].
        timeout: Maximum time without measurements, in real time [s].
        home: Whether a reset drives the robot home slowly. Otherwise, the robot stays where it is, and declared contacts
            are always open.
        homing_speed: Largest velocity of a joint during a reset [rad/s or m/s].
        homing_timeout: Time after which a reset has failed [s].

    Raises:
        ConfigurationError: A value is invalid, the controller cannot be used, or the scene contains several robots or a
            body with an unknown pose.
        RobotSilentError: The robot does not publish its measurements.
        RosError: No master responds, or a call to the controller manager fails.
    """

    render_modalities = ()

    def __init__(
        self,
        robots: Mapping[str, Placement],
        scene: Scene,
        *,
        num_envs: int,
        physics_timestep: float,
        num_threads: int = 0,
        namespace: str = "/",
        controller: str | None = None,
        topics: Mapping[str, str] | None = None,
        bodies: Mapping[str, str] | None = None,
        speed: float = 1.0,
        timeout: float = 0.5,
        home: bool = True,
        homing_speed: float = 0.5,
        homing_timeout: float = 60.0,
    ) -> None:
        scene.check(robots, lacking=("contacts", "attachments") if home else ("attachments",))
        if not 0.0 < speed <= 1.0:
            raise ParameterValueError("speed", speed, "above 0 and at most 1")
        check_keys("topics", topics or {}, [field.name for field in fields(Topics)])
        if len(robots) > 1:
            raise ConfigurationError(f"the simulator 'ros' supports one robot, but there are {', '.join(robots)}.")
        missing = [name for name, body in scene.bodies.items() if body.is_free and name not in (bodies or {})]
        if missing:
            raise ConfigurationError(
                f"the poses of the bodies {', '.join(missing)} are unknown; name their topics (PoseStamped): "
                f"simulator_kwargs={{'bodies': {{'{missing[0]}': '/{missing[0]}_pose'}}}}, or --body "
                f"{missing[0]}=/{missing[0]}_pose."
            )
        self.num_envs, self.physics_timestep = num_envs, physics_timestep
        self._timeout, self._goes_home = timeout, home
        self._homing = positive("homing_speed", homing_speed), positive("homing_timeout", homing_timeout)
        [(name, placement)] = robots.items()
        if home and (placement.robot.base != "fixed" or {*placement.command_modes} != {CommandMode.POSITION}):
            raise UnsuitableRobotError(
                placement.robot.name,
                "has a movable base or is not controlled by positions, so a reset cannot drive it home; start episodes "
                "where it is: simulator_kwargs={'home': False}.",
            )
        use_ros()
        import rospy

        require()
        if not rospy.core.is_initialized():
            rospy.init_node("frobs_simulation", anonymous=True, disable_signals=True)
        self._now, self._last = rospy.get_time, 0.0
        names, space = Topics(**(topics or {})), namespace.rstrip("/")
        self._robot = RosRobot(name, placement, space, names, speed, home)
        self.robots = {name: self._robot}
        self.bodies = self._bodies = {
            each: RosBody(each, body, (bodies or {}).get(each)) for each, body in scene.bodies.items()
        }
        self.contacts = ContactState(scene, 1)
        self.pacer = self._pacer = Pacer(self._clock, self._sleep)
        self._commands: Commands | None = None
        self._period = _HOMING_PERIOD
        try:
            self._commands = Commands(self._robot, space, controller, names.cmd_vel)
            while not self._robot.is_measured:
                self._check()
                time.sleep(_POLL)
            self._robot.read()
        except BaseException:
            self.close()
            raise

    @property
    def time(self) -> Floats:
        """(1,) [s] since the reset."""
        return read_only(self._pacer.time)

    @property
    def measurement_age(self) -> Floats:
        """Time since the oldest measurement was received, in real time, (1,) [s]."""
        return np.array([self._robot.silent()[1]])

    def reset(self, mask: Mask | None = None) -> None:
        """Drive the robot home slowly, and return when it has stopped there; or leave the robot where it is."""
        if mask is not None and not mask.any():
            return
        self._last = 0.0
        self._pacer.restart()
        self._robot.read()
        if self._goes_home:
            drive_home(self.robots, self._advance_home, _HOMING_PERIOD, *self._homing)
            self._pacer.restart()
        self._robot.command(self._robot.holding_command(self._robot.joint_positions))

    def step(self, decimation: int) -> None:
        """Send the command, wait until the step is over, and read the measurements.

        Raises:
            RobotSilentError: The robot has not sent measurements for longer than the timeout. It is commanded to hold.
            ClockResetError: The ROS clock was set back.
            NodeEndedError: The node is shutting down.
        """
        assert self._commands is not None
        self._period = decimation * self.physics_timestep
        self._commands.send(self._robot.safe_command(decimation, self._period), self._period)
        self._wait(self._period)

    def hold(self) -> None:
        """Command the robot to hold its measured position, and return when the command has been sent.

        Raises:
            RosError: The command could not be sent.
        """
        assert self._commands is not None
        self._robot.read()
        self._commands.hold(self._period)

    def close(self) -> None:
        """Make the robot hold, and end the connections to it."""
        try:
            if self._commands is not None and not self._commands.is_holding:
                self.hold()
        finally:
            for part in (self._robot, *self._bodies.values()):
                for subscriber in part.subscribers:
                    subscriber.unregister()
            if self._commands is not None:
                self._commands.close()
            self._commands = None

    def _advance_home(self) -> float:
        """Send the command of the motion home, and return the time since the start of the reset [s]."""
        assert self._commands is not None
        self._commands.send(self._robot.safe_command(1, _HOMING_PERIOD), _HOMING_PERIOD)
        self._wait(_HOMING_PERIOD)
        return float(self._pacer.time[0])

    def _wait(self, duration: float) -> None:
        self._pacer.wait(duration)
        self._check()
        self._robot.read()

    def _clock(self) -> float:
        before, self._last = self._last, float(self._now())
        if self._last < before:
            raise ClockResetError(before, self._last)
        return self._last

    def _sleep(self, seconds: float) -> None:
        """Wait until the ROS clock has advanced."""
        until = self._clock() + seconds
        while self._clock() < until:
            self._check()
            time.sleep(_POLL)

    def _check(self) -> None:
        """Check that the node is not ending and that the robot still sends measurements."""
        if self._commands is not None and self._commands.is_over:
            raise NodeEndedError
        what, seconds = self._robot.silent()
        if seconds > self._timeout:
            if self._commands is not None and not self._commands.is_holding:
                self.hold()
            raise RobotSilentError(what, seconds)
