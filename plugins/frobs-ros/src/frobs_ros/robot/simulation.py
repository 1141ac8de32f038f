"""The simulator ``ros``: a robot behind ROS topics as a paced simulation."""

from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np

from frobs_core.contracts import CommandMode, ContactState, MeasuredSimulation, Pacer
from frobs_core.description import Placement, Scene
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError, ParameterValueError, UnsuitableRobotError, check_keys
from frobs_core.util.validation import positive
from frobs_ros.errors import ClockResetError, NodeEndedError, RobotSilentError
from frobs_ros.robot.commands import Commands
from frobs_ros.robot.handle import RosRobot
from frobs_ros.ros.environment import use_ros
from frobs_ros.ros.master import require

TOPICS = {"joint_states": "joint_states", "odom": "odom", "scan": "scan", "cmd_vel": "cmd_vel"}
"""Topics of a robot, relative to its namespace: joint states (sensor_msgs/JointState) from any number of nodes, odometry of
a moving base (nav_msgs/Odometry), scans of a lidar (sensor_msgs/LaserScan), and commands to wheels (geometry_msgs/Twist).
"""

_POLL = 0.001
"""Time between two reads of the ROS clock [s]. The clock does not advance while a simulation is paused."""


class RosSimulation(MeasuredSimulation):
    """A robot behind ROS topics, in ROS time.

    Commands are clipped to the joint limits. Software limits do not replace the robot's emergency stop.

    Args:
        namespace: ROS namespace of the robot.
        controller: ROS controller that receives the commands. By default, a wheeled robot is controlled through its
            ``cmd_vel`` topic.
        topics: Topic names that differ from :data:`TOPICS`.
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
        check_keys("topics", topics or {}, TOPICS)
        if len(robots) > 1:
            raise ConfigurationError(f"the simulator 'ros' supports one robot, but there are {', '.join(robots)}.")
        reported = bodies or {}
        check_keys("bodies", reported, scene.bodies)
        self.place_bodies(scene, reported)
        self.num_envs, self.physics_timestep = num_envs, physics_timestep
        self._timeout, self._speed, self._period = timeout, speed, physics_timestep
        [(name, placement)] = robots.items()
        if home and (placement.robot.base != "fixed" or {*placement.command_modes} != {CommandMode.POSITION}):
            raise UnsuitableRobotError(
                placement.robot.name,
                "has a movable base or is not controlled by positions, so a reset cannot drive it home; start episodes "
                "where it is: simulator_kwargs={'home': False}.",
            )
        if home:
            self.homing = positive("homing_speed", homing_speed), positive("homing_timeout", homing_timeout)
        use_ros()
        import rospy

        require()
        if not rospy.core.is_initialized():
            rospy.init_node("frobs_simulation", anonymous=True, disable_signals=True)
        self._now, self._last, self._is_ending = rospy.get_time, 0.0, rospy.core.is_shutdown_requested
        names, space = {**TOPICS, **(topics or {})}, namespace.rstrip("/")
        self._robot = RosRobot(name, placement)
        self._robot.stays = not home
        self.robots, self.contacts = {name: self._robot}, ContactState(scene, 1)
        self.pacer = Pacer(self._clock, self._sleep)
        self._commands = Commands(self._robot, space, controller, names["cmd_vel"])
        self._subscribers = self._robot.subscribe(
            space, names, [(self.bodies[each], reported[each]) for each in reported]
        )
        try:
            while not self._robot.is_measured:
                self._check()
                time.sleep(_POLL)
            self._robot.read()
        except BaseException:
            self.close()
            raise

    @property
    def measurement_age(self) -> Floats:
        """Time since the oldest measurement was received, in real time, (1,) [s]."""
        return np.array([self._robot.silent()[1]])

    def send(self, decimation: int, duration: float) -> None:
        """Send the command, clipped to the joint limits. For the arguments, see :meth:`.MeasuredSimulation.send`."""
        self._period = duration
        self._commands.send(self._robot.limited_command(decimation, duration, self._speed), duration)

    def receive(self, start: bool = False) -> None:
        """Read the latest measurements.

        Args:
            start: Whether a reset begins, before which the clock may have been set back.

        Raises:
            RobotSilentError: The robot has not sent measurements for longer than the timeout. It is commanded to hold.
            ClockResetError: The ROS clock was set back.
            NodeEndedError: The node is shutting down.
        """
        self._last = 0.0 if start else self._last
        self._check()
        self._robot.read()

    def hold(self) -> None:
        """Command the robot to hold its measured position, and return when the command has been sent.

        Raises:
            RosError: The command could not be sent.
        """
        self._robot.read()
        self._commands.hold(self._period)

    def close(self) -> None:
        """Make the robot hold, and end the connections to it."""
        try:
            if not self._commands.is_holding:
                self.hold()
        finally:
            self._commands.close()
            for subscriber in self._subscribers:
                subscriber.unregister()

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
        if self._is_ending():
            raise NodeEndedError
        what, seconds = self._robot.silent()
        if seconds > self._timeout:
            if not self._commands.is_holding:
                self.hold()
            raise RobotSilentError(what, seconds)
