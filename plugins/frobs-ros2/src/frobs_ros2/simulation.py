"""The simulator ``ros2``: a robot behind ROS 2 topics as a paced simulation."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from frobs_core.contracts import CommandMode, MeasuredRobot, MeasuredSimulation, Pacer
from frobs_core.description import Marker, Placement, Scene
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import SimulationError, UnsuitableRobotError, check_keys
from frobs_core.util.validation import positive
from frobs_ros2.guard import GuardedRobot, safety_filter
from frobs_ros2.ros import PEER_TIMEOUT, Node, advice, clock_problem, image_of, joints_of, message_type, seconds_of
from frobs_ros2.safety import REPEATED

_MOST_SILENCE = 5.0  # [s] time without measurements, or with a stopped clock, after which a step fails


class Ros2Robot(GuardedRobot, MeasuredRobot):
    """A robot behind ROS 2 topics, as measured at the end of the last step.

    Args:
        name: Name in the simulation.
        placement: Placement of the robot.
        node: The node.
        namespace: Prefix of its topics, empty or ``"name/"``.
        safety: Settings of the safety rules.
    """

    def __init__(self, name: str, placement: Placement, node: Node, namespace: str, safety: Mapping[str, Any]) -> None:
        if placement.robot.base != "fixed":
            raise UnsuitableRobotError(
                placement.robot.name, "has a movable base, so it cannot be driven home by the simulator 'ros2'."
            )
        self.describe(name, placement, 1)
        self._node, self._namespace = node, namespace
        self.measured = np.array([self.home, *np.zeros((2, 1, self.dof))])
        self._latest: tuple[float, Floats, Floats, Floats] | None = None
        self.fault = ""
        tool = placement.robot.end_effector_of()
        fingers = placement.robot.groups[tool.group] if tool is not None and tool.group else ()
        self._fingers = [self.joint_names.index(joint) for joint in fingers]
        self._arm = [i for i in range(self.dof) if i not in self._fingers]
        array = "std_msgs/msg/Float64MultiArray"
        self._forward = {
            mode: node.publisher(array, f"{namespace}forward_{mode}_controller/commands") for mode in CommandMode
        }
        self._gripper = node.publisher(array, f"{namespace}gripper_controller/commands")
        node.subscribe("sensor_msgs/msg/JointState", f"{namespace}joint_states", self._on_joints)
        self.rules = safety_filter(self, safety)

    def _on_joints(self, message: Any) -> None:
        rows = joints_of(message, self.joint_names)
        if rows is not None:
            self._latest = seconds_of(message.header.stamp), *rows

    @property
    def is_measured(self) -> bool:
        """Whether joint states have arrived."""
        return self._latest is not None

    def read(self, now: float, start: bool = False) -> str:
        """Use the latest measurement, and return why it cannot be used, or an empty text.

        Args:
            now: Current time [s].
            start: Whether to accept any position, as at the start of an episode.
        """
        assert self._latest is not None
        stamp, positions, velocities, efforts = self._latest
        if start:
            self.rules.start(positions, now, stamp - 1e-9)
        reason = self.rules.measure(stamp, positions, velocities, now)
        if not reason:
            self.measured = np.array([positions, velocities, efforts])[:, None]
        return reason

    def update(self, now: float) -> str:
        """Use the latest measurement if there is a new one, and return the fault for which the robot must hold."""
        reason = self.read(now)
        is_fresh = self.rules.age(now) <= self.rules.limits.max_age
        self.fault = "" if reason == REPEATED and is_fresh and not self.fault else reason
        return self.fault

    def send(self, mode: CommandMode, values: Floats) -> None:
        """Send a command to the controllers of the arm and of the gripper."""
        kind = message_type("std_msgs/msg/Float64MultiArray")
        if self._arm:
            self._forward[mode].publish(kind(data=values[self._arm].tolist()))
        if self._fingers and mode is CommandMode.POSITION:
            self._gripper.publish(kind(data=values[self._fingers].tolist()))

    @property
    def has_controller(self) -> bool:
        """Whether a controller listens to the commands."""
        return bool(self._forward[CommandMode.POSITION].get_subscription_count())


class Ros2Simulation(MeasuredSimulation):
    """Robots behind ROS 2 topics: forward command controllers, ``joint_states``, image and pose topics.

    A reset drives the robots home slowly and waits. All commands pass the safety rules of
    :mod:`frobs_ros2.safety`. Software limits do not replace the robot's emergency stop.

    Args:
        namespaces: Namespace of each robot, by name. By default, a single robot has none, and several have their names.
        use_sim_time: Whether to use the clock of the topic ``/clock``. By default, it is used if a node publishes it.
        cameras: Image topic of each camera, by name.
        bodies: Topic with the pose of each body, by name. Bodies with a mass require one. Other bodies are where the
            scene places them.
        safety: Settings of the safety rules: ``speed``, ``acceleration`` [rad/s²], ``workspace`` (two corners [m]),
            ``slow_start`` [s], ``max_age`` [s] and ``log`` (a file).
        homing_speed: Largest velocity of a joint during a reset [rad/s or m/s].
        homing_timeout: Time after which a reset has failed [s].
        network: Whether to reach other machines.
    """

    render_modalities = ("rgb",)

    def __init__(
        self,
        robots: Mapping[str, Placement],
        scene: Scene,
        *,
        num_envs: int,
        physics_timestep: float,
        num_threads: int = 0,
        namespaces: Mapping[str, str] | None = None,
        use_sim_time: bool | None = None,
        cameras: Mapping[str, str] | None = None,
        bodies: Mapping[str, str] | None = None,
        safety: Mapping[str, Any] | None = None,
        homing_speed: float = 0.5,
        homing_timeout: float = 60.0,
        network: bool = False,
    ) -> None:
        scene.check(robots, lacking=("contacts", "attachments"))
        self.num_envs, self.physics_timestep = num_envs, physics_timestep
        self.homing = positive("homing_speed", homing_speed), positive("homing_timeout", homing_timeout)
        check_keys("namespaces", namespaces or {}, robots)
        check_keys("bodies", bodies or {}, scene.bodies)
        self.place_bodies(scene, bodies or {})
        self._topics, self._heard = dict(bodies or {}), dict[str, float]()  # when poses and images arrived
        self._node = Node("frobs_simulation", [], network)
        self.pacer = Pacer(self._clock, self._sleep)
        try:
            spaces = {name: "" if len(robots) == 1 else f"{name}/" for name in robots}
            spaces |= {
                name: f"{text.strip('/')}/" if text.strip("/") else "" for name, text in (namespaces or {}).items()
            }
            self.robots = self._robots = {
                name: Ros2Robot(name, one, self._node, spaces[name], safety or {}) for name, one in robots.items()
            }
            for name, topic in (bodies or {}).items():
                self._node.subscribe("geometry_msgs/msg/PoseStamped", topic, partial(self._on_pose, name))
            self._images: dict[str, np.ndarray[Any, Any]] = {}
            for camera, topic in (cameras or {}).items():
                self._node.subscribe("sensor_msgs/msg/Image", topic, partial(self._on_image, camera))
            if not self._node.spin_until(self._is_connected, PEER_TIMEOUT):
                raise SimulationError(
                    f"within {PEER_TIMEOUT:g} s, no joint_states with all joints arrived, or no "
                    f"forward_position_controller listens; check the robot's nodes; {advice()}."
                )
            if use_sim_time or (use_sim_time is None and self._node.node.count_publishers("/clock")):
                self._node.use_sim_time()
            if not self._node.spin_until(lambda: not self._silent_bodies(), PEER_TIMEOUT):
                raise SimulationError(
                    f"within {PEER_TIMEOUT:g} s, no pose of these bodies arrived: {self._silent_bodies()}; check the "
                    f"names of the topics (PoseStamped); {advice()}."
                )
            self._node.spin_until(lambda: self._clock() > 0.0, PEER_TIMEOUT)
            self.receive(start=True)
        except BaseException:
            self.close()
            raise

    @property
    def measurement_age(self) -> Floats:
        """Age of the oldest joint state in use, (1,) [s]."""
        now = self._clock()
        return np.array([max(robot.rules.age(now) for robot in self._robots.values())])

    def hold(self) -> None:
        """Command all robots to hold, immediately."""
        for robot in self._robots.values():
            robot.send(*robot.hold_command("hold() was called", self._clock()))

    def render(
        self,
        mask: Mask | None = None,
        camera: str | None = None,
        size: tuple[int, int] = (480, 640),
        modality: str = "rgb",
        markers: Sequence[Marker] = (),
        fast: bool = False,
    ) -> np.ndarray[Any, Any]:
        """Return the latest image of a camera, (1, h, w, 3) uint8. For the arguments, see :meth:`.Simulation.render`.

        Raises:
            SimulationError: No image has arrived.
        """
        name = camera if camera is not None else next(iter(self._images), "")
        if not self._node.spin_until(lambda: self._is_heard(f"images of {name}"), PEER_TIMEOUT):
            if name in self._images:
                raise SimulationError(f"the images of the camera '{name}' no longer arrive.")
            raise SimulationError(
                f"no image of the camera '{name}' arrived; name its topic: simulator_kwargs={{'cameras': "
                f"{{'{name}': '/{name}/image_raw'}}}}."
            )
        image = self._images[name]
        rows = (np.arange(size[0]) * image.shape[0]) // size[0]
        columns = (np.arange(size[1]) * image.shape[1]) // size[1]
        return np.ascontiguousarray(image[rows][:, columns][None])

    def close(self) -> None:
        """Make the robots hold, and end the node."""
        try:
            if self._node.ok() and self.pacer.time[0] > 0.0 and all(each.is_measured for each in self._robots.values()):
                self.hold()
        finally:
            self._node.close()

    _robots: Mapping[str, Ros2Robot] = {}
    _last_good = 0.0

    def send(self, decimation: int, duration: float) -> None:
        """Send the commands that the safety rules allow. For the arguments, see :meth:`.MeasuredSimulation.send`."""
        now = self._clock()
        for robot in self._robots.values():
            robot.send(*robot.safe_command(decimation, duration, now, robot.fault))

    def receive(self, start: bool = False) -> None:
        """Read the latest measurements that the safety rules allow.

        Args:
            start: Whether to accept any positions.

        Raises:
            SimulationError: There were no usable measurements for several seconds.
        """
        self._node.spin()
        if start:
            for robot in self._robots.values():
                if not self._node.spin_until(partial(self._is_read, robot), _MOST_SILENCE):
                    raise SimulationError(f"no measurement could be used for {_MOST_SILENCE:g} s: {robot.fault}.")
            self._last_good = time.monotonic()
            return
        now = self._clock()
        faults = [fault for robot in self._robots.values() if (fault := robot.update(now))]
        if silent := self._silent_bodies():
            self.hold()
            raise SimulationError(f"for {_MOST_SILENCE:g} s, no pose of these bodies arrived: {silent}.")
        if not faults:
            self._last_good = time.monotonic()
        elif time.monotonic() - self._last_good > _MOST_SILENCE:
            self.hold()
            raise SimulationError(f"no measurement could be used for {_MOST_SILENCE:g} s: {faults[0]}.")

    def _is_read(self, robot: Ros2Robot) -> bool:
        """Begin with the latest measurement of a robot, and return whether it can be used."""
        now = self._clock()
        reason = robot.read(now, start=True)
        robot.fault = clock_problem(robot.rules.age(now), "simulator_kwargs={'use_sim_time': True}") or reason
        return not robot.fault

    def _clock(self) -> float:
        return 1e-9 * float(self._node.node.get_clock().now().nanoseconds)

    def _sleep(self, seconds: float) -> None:
        """Run callbacks until the clock has advanced, or fail if it has stopped."""
        end, until = time.monotonic() + seconds + _MOST_SILENCE, self._clock() + seconds
        while (left := until - self._clock()) > 0.0:
            self._node.spin(min(left, 0.005))
            if time.monotonic() > end:
                self.hold()
                raise SimulationError(f"the ROS clock did not advance for {_MOST_SILENCE:g} s.")

    def _is_connected(self) -> bool:
        return all(robot.is_measured and robot.has_controller for robot in self._robots.values())

    def _on_image(self, camera: str, message: Any) -> None:
        try:
            image = image_of(message)
            if image.dtype != np.uint8:
                raise ValueError(f"the encoding '{message.encoding}' is for depth; name a topic with colors")
        except ValueError as error:
            raise SimulationError(f"an image of the camera '{camera}' cannot be used: {error}.") from None
        self._images[camera], self._heard[f"images of {camera}"] = image, time.monotonic()

    def _is_heard(self, name: str) -> bool:
        return time.monotonic() - self._heard.get(name, -np.inf) <= _MOST_SILENCE

    def _silent_bodies(self) -> str:
        """Return the bodies whose poses do not arrive, with their topics."""
        return ", ".join(f"'{name}' ({topic})" for name, topic in self._topics.items() if not self._is_heard(name))

    def _on_pose(self, name: str, message: Any) -> None:
        p, q = message.pose.position, message.pose.orientation
        self.bodies[name].measure(np.array([p.x, p.y, p.z]), np.array([q.w, q.x, q.y, q.z]))
        self._heard[name] = time.monotonic()
