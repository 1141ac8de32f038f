"""The loop of the policy node: one command for each joint state that is due."""

from __future__ import annotations

import gc
import time
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from frobs_deploy import Policy, read_bundle
from frobs_ros2.errors import NoPeerError, NotReadyError, SettingsError
from frobs_ros2.policy_node.actions import Actions
from frobs_ros2.policy_node.checks import bundle_problems, robot_problems, trained_limits
from frobs_ros2.policy_node.kinematics import Kinematics
from frobs_ros2.policy_node.observation import Inputs, Observer, named_arrays
from frobs_ros2.ros import PEER_TIMEOUT, Node, clock_problem, image_of, joints_of, message_type, seconds_of, variables
from frobs_ros2.safety import Array, Limits, SafetyFilter

_ON_TIME = 1e-6  # [s] rounding of stamps
_RATE_MESSAGES = 20  # joint states over which their rate is measured
_MOST_SILENCE = 1.0  # [s] age of images and numbers above which the robot holds
_ONE_PER_STEP = 1.5  # joint states per control step below which each of them leads to a command


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Settings of a policy node.

    Attributes:
        bundle: The bundle.
        laws: Laws of its controllers, if the bundle does not contain them.
        goal: Goal in the world frame, (3,) [m], or None if a topic provides it.
        interface: ``"forward"`` or ``"trajectory"``: type of the commands.
        topic: Topic of the commands, or empty for the usual name.
        lockstep: Whether to wait for all topics of a time, as ``frobs ros2 serve --lockstep`` publishes them.
        dry_run: Whether to print the commands instead of sending them.
        seconds: Time after which the node ends [s], or None.
        speed: Fraction of the velocity limits that commands may use, in (0, 1].
        acceleration: Acceleration limit [rad/s² or m/s²], or None.
        workspace: Corners of the box that the tool may not leave [m], or None.
        slow_start: Time in which the velocity limit grows to its full value [s].
        max_age: Age of measurements after which the robot holds [s].
        deadman: Whether the topic ``deadman`` must be true.
        log: File for commands that were changed, or None.
        images: Topic of each image, by observation key. By default, ``KEY/image_raw``.
        peer_timeout: Time to wait for the robot's topics [s].
    """

    bundle: Path
    laws: Sequence[Mapping[str, Any]] = ()
    goal: Sequence[float] | None = None
    interface: str = "forward"
    topic: str = ""
    lockstep: bool = False
    dry_run: bool = False
    seconds: float | None = None
    speed: float = 1.0
    acceleration: float | None = None
    workspace: Sequence[float] | None = None
    slow_start: float = 2.0
    max_age: float = 0.2
    deadman: bool = False
    log: Path | None = None
    images: Mapping[str, str] = field(default_factory=dict)
    peer_timeout: float = PEER_TIMEOUT


@dataclass
class Report:
    """Statistics of a run.

    Attributes:
        commands: Number of commands.
        late: Number of commands that were more than half a control step late.
        episodes: Number of episodes.
        holds: Number of times that the robot was made to hold.
        changed: Number of changed commands by rule.
        cycle_ms: Median and 99th percentile of the time from a joint state to its command [ms].
    """

    commands: int = 0
    late: int = 0
    episodes: int = 0
    holds: int = 0
    changed: Mapping[str, int] = field(default_factory=dict)
    cycle_ms: tuple[float, float] = (0.0, 0.0)


class PolicyNode:
    """A policy that is connected to the topics of a robot.

    Args:
        node: The node.
        settings: The settings.

    Raises:
        NoPeerError: Nobody publishes joint states.
        NotReadyError: The robot does not match the policy.
        BundleError: The bundle is damaged.
    """

    def __init__(self, node: Node, settings: Settings) -> None:
        self._node, self._settings = node, settings
        self._bundle = read_bundle(settings.bundle)
        self.policy = Policy(self._bundle)
        manifest = self.policy.manifest
        data = self._bundle.manifest
        controller = data.get("controller") or {}
        self._laws = list(controller.get("laws") or settings.laws)
        self._refuse(list(bundle_problems(self._bundle, self._laws, settings.interface)))
        if settings.interface not in ("forward", "trajectory"):
            raise SettingsError(f"interface is '{settings.interface}'; it must be forward or trajectory.")
        self._timestep = float(manifest.control_timestep or 0.0)
        self._inputs = Inputs(goal=None if settings.goal is None else np.array(settings.goal, float))
        self._other_names: list[str] = []
        self._fresh, self._arrived = False, -np.inf
        self._heard: dict[str, float] = {}  # when images and the topic observation arrived
        self._stamps: deque[float] = deque(maxlen=_RATE_MESSAGES)
        self._urdf = ""
        self._early = _ON_TIME
        self._restart = False
        self._deadman = (False, -np.inf)
        self._subscribe()
        self.kinematics, self._observer = self._await_robot()
        self._watched = [f"{key}/image_raw" for key in manifest.images]
        self._watched += ["observation"] if self._observer.others() else []
        self._limits = self._joint_limits()
        self._actions = self._connect_actions(controller)
        self._drives = controller["name"] == "differential_drive"
        self._filter = SafetyFilter(
            self._wheel_limits() if self._drives else self._limits, self._timestep, self._tool(), settings.log
        )
        self._arm = [i for i in range(len(manifest.joint_names)) if i not in self._actions.fingers]
        self._gripper: Any = None
        if self._actions.fingers:
            self._gripper = self._publisher_of("std_msgs/msg/Float64MultiArray", "gripper_controller/commands")
        self._publisher, self._message = self._connect()
        self.report = Report()
        self._cycles: list[float] = []

    def run(self) -> Report:
        """Act until the node is shut down or the time is over, make the robot hold, and return statistics."""
        settings, node = self._settings, self._node
        began, due, episode = time.monotonic(), -np.inf, -1.0
        gc.freeze()  # what exists now stays, so the garbage collector need not look at it in each step
        try:
            while node.ok() and not (settings.seconds and time.monotonic() - began > settings.seconds):
                node.spin(0.02)
                if not self._is_complete():
                    self._watch()
                    continue
                self._fresh = False
                inputs, now = self._inputs, self._now()
                positions = self._positions()
                if not np.isfinite(positions).all():
                    self._hold("a measurement is not finite", now)
                    continue
                number = float(inputs.named.get("episode", np.zeros(1))[0])
                if self._restart or number != episode or self.report.episodes == 0:
                    self._begin(positions, now)
                    due, episode, self._restart = inputs.stamp, number, False
                reason = self._filter.measure(inputs.stamp, positions, self._velocities(), now)
                if reason:
                    self._hold(reason, now)
                    continue
                if inputs.stamp < due - self._early:
                    continue
                if silent := self._silent():
                    self._hold(f"nothing new on {silent} for {_MOST_SILENCE:g} s", now)
                    continue
                self._act(positions, now)
                late = inputs.stamp - due
                self.report.late += late > 0.5 * self._timestep
                due = (due if late < self._timestep else inputs.stamp) + self._timestep
        finally:
            if self.report.commands:
                self._hold("the node ends", self._now())
        self.report.changed = dict(self._filter.counts)
        if self._cycles:
            cycle = 1e3 * np.array(self._cycles)
            self.report.cycle_ms = float(np.median(cycle)), float(np.quantile(cycle, 0.99))
        return self.report

    def _begin(self, positions: Array, now: float) -> None:
        self.policy.reset()
        self._actions.reset(self._inputs.joint_positions)
        self._filter.start(positions, now)
        self.report.episodes += 1

    def _act(self, positions: Array, now: float) -> None:
        self._filter.press(*self._deadman)
        was_held = self._filter.held
        if was_held and self._actions.mode == "position":
            self._actions.reset(positions)  # after a hold, continue from where the robot is
        action = self.policy.act(self._observer.read(self._inputs))
        command = self._actions.convert(action, self._inputs.joint_positions)
        sent = self._filter.command(self._actions.mode, command, now)
        if not np.array_equal(sent, command):
            self._actions.sent(sent)
        if self._filter.held and not was_held:
            self.report.holds += 1
            self._node.log(f"holding: {self._filter.held}")
        self._send(sent)
        self._cycles.append(time.perf_counter() - self._arrived)
        self.report.commands += 1

    def _hold(self, reason: str, now: float) -> None:
        if self.report.episodes == 0:
            return
        if not self._filter.held:
            self.report.holds += 1
            self._node.log(f"holding: {reason}")
        self._send(self._filter.hold(self._actions.mode, reason, now))

    def _watch(self) -> None:
        """Hold if no measurement arrives, or if the stamps do not advance."""
        silent = time.perf_counter() - self._arrived
        watched = self.report.episodes and not self._settings.lockstep and not self._filter.held
        if watched and silent > self._settings.max_age:
            self._hold(f"no new joint state for {self._settings.max_age:g} s", self._now())

    def _silent(self) -> str:
        """Return the topic of an input that no longer arrives, or an empty text."""
        if self._settings.lockstep:
            return ""
        oldest = time.perf_counter() - _MOST_SILENCE
        return next((name for name in self._watched if self._heard.get(name, -np.inf) < oldest), "")

    def _send(self, command: Array) -> None:
        if self._settings.dry_run:
            names = ("linear", "angular") if self._drives else self._limits.joint_names
            row = " ".join(f"{name}={value:.4f}" for name, value in zip(names, command.tolist(), strict=True))
            self._node.node.get_logger().info(f"would send {self._actions.mode}: {row}")
        else:
            if self._gripper is not None:
                self._gripper.publish(self._array(command[self._actions.fingers]))
            self._publisher.publish(self._message(command if self._drives else command[self._arm]))

    def _is_complete(self) -> bool:
        if not self._fresh:
            return False
        return not self._settings.lockstep or abs(self._inputs.named_stamp - self._inputs.stamp) < _ON_TIME

    def _positions(self) -> Array:
        return np.zeros(2) if self._drives else self._inputs.joint_positions

    def _velocities(self) -> Array:
        return np.zeros(2) if self._drives else self._inputs.joint_velocities

    def _now(self) -> float:
        """Return the time on the clock of the measurements [s]."""
        if self._settings.lockstep:
            return self._inputs.stamp
        return 1e-9 * float(self._node.node.get_clock().now().nanoseconds)

    # -- Topics --

    def _subscribe(self) -> None:
        node = self._node
        # The executor handles topics in this order, and the joint states complete the inputs of a step. Each topic
        # costs time in each step, so only those that are used are subscribed to.
        node.subscribe("sensor_msgs/msg/JointState", "observation", self._on_numbers)
        node.subscribe("sensor_msgs/msg/JointState", "joint_states", self._on_joints)
        if self._settings.goal is None:
            node.subscribe("geometry_msgs/msg/PointStamped", "goal", self._on_goal)
        if self._settings.deadman:
            node.subscribe("std_msgs/msg/Bool", "deadman", self._on_deadman)
        node.subscribe("std_msgs/msg/String", "robot_description", self._on_description, latched=True)
        node.service("std_srvs/srv/Trigger", "~/reset", self._on_reset)
        for key in self.policy.manifest.images:
            topic = self._settings.images.get(key, f"{key}/image_raw")
            node.subscribe("sensor_msgs/msg/Image", topic, partial(self._on_image, key))

    def _on_joints(self, message: Any) -> None:
        inputs, rows = self._inputs, joints_of(message, self.policy.manifest.joint_names)
        if rows is None:  # of another node, such as that of a gripper that the policy does not use
            self._other_names = list(message.name)
            return
        stamp = seconds_of(message.header.stamp)
        if stamp != inputs.stamp:  # a stopped clock is noticed because nothing arrives
            self._arrived, self._fresh = time.perf_counter(), True
            self._stamps.append(stamp)
        inputs.stamp = stamp
        inputs.joint_positions, inputs.joint_velocities, inputs.joint_efforts = rows

    def _on_numbers(self, message: Any) -> None:
        self._inputs.named = named_arrays(message.name, message.position)
        self._inputs.named_stamp = seconds_of(message.header.stamp)
        self._heard["observation"] = time.perf_counter()

    def _on_goal(self, message: Any) -> None:
        self._inputs.goal = np.array([message.point.x, message.point.y, message.point.z])

    def _on_deadman(self, message: Any) -> None:
        self._deadman = bool(message.data), self._now()

    def _on_description(self, message: Any) -> None:
        self._urdf = message.data

    def _on_reset(self, _: Any, response: Any) -> Any:
        self._restart, response.success = True, True
        return response

    def _on_image(self, key: str, message: Any) -> None:
        try:
            self._inputs.images[key] = image_of(message)
            self._heard[f"{key}/image_raw"] = time.perf_counter()
        except ValueError as error:
            self._node.log(f"an image is not used: {error}")

    # -- Before the first command --

    def _await_robot(self) -> tuple[Kinematics | None, Observer]:
        settings, node, manifest = self._settings, self._node, self.policy.manifest
        if not node.spin_until(lambda: bool(self._stamps or self._other_names), settings.peer_timeout):
            reach = variables()
            domain = reach.pop("ROS_DOMAIN_ID", "0")
            texts = ", ".join(f"{name}={value}" for name, value in reach.items())
            topic = node.node.resolve_topic_name("joint_states")
            raise NoPeerError(topic, settings.peer_timeout, domain, texts)
        node.spin_until(lambda: bool(self._urdf and self._stamps), 2.0)
        tcp = str(self._bundle.manifest["robot"]["tcp"])
        kinematics = Kinematics(self._urdf, manifest.joint_names) if self._urdf else None
        observer = Observer(manifest, tcp, kinematics)
        rest = observer.others() or (observer.needs_goal and self._inputs.goal is None)
        if rest or settings.lockstep:
            node.spin_until(lambda: bool(self._inputs.named) or self._inputs.goal is not None, 2.0)
        if manifest.images:
            node.spin_until(lambda: self._inputs.images.keys() >= manifest.images.keys(), 5.0)
        rate = None
        if not settings.lockstep:
            node.spin_until(lambda: len(self._stamps) == _RATE_MESSAGES, 2.0)
            if self._stamps:
                spent = self._stamps[-1] - self._stamps[0]
                rate = (len(self._stamps) - 1) / spent if spent > 0.0 else 0.0
        names = manifest.joint_names if self._stamps else self._other_names
        problems = list(robot_problems(self._bundle, manifest, names, kinematics, observer, self._inputs, rate))
        problem = clock_problem(self._now() - self._inputs.stamp, "--param use_sim_time:=true")
        if names and problem:
            problems.append(problem)
        self._refuse(problems)
        if rate is not None:  # jitter of the joint states must not make the node skip a step
            steps = rate * self._timestep
            self._early = self._timestep if steps < _ONE_PER_STEP else 0.5 / rate
        return kinematics, observer

    def _refuse(self, problems: list[str]) -> None:
        if problems:
            raise NotReadyError(self._bundle.path, problems)

    def _joint_limits(self) -> Limits:
        """Return the tighter of the limits in training and of the robot description."""
        joints = self._bundle.manifest["robot"]["joints"]
        known = self.kinematics.limits if self.kinematics is not None else {}
        trained = np.array([trained_limits(joint) for joint in joints])  # (dof, 4)
        rows = np.array([known.get(str(joint["name"]), row) for joint, row in zip(joints, trained, strict=True)])
        _, upper, velocity, effort = np.minimum(rows, trained).T
        settings = self._settings
        box = None if settings.workspace is None else np.array(settings.workspace, float).reshape(2, 3)
        if not 0.0 < settings.speed <= 1.0:
            raise SettingsError(f"speed is {settings.speed:g}; it must be above 0 and at most 1.")
        return Limits(
            joint_names=self.policy.manifest.joint_names,
            lower=np.maximum(rows, trained)[:, 0],
            upper=upper,
            velocity=velocity,
            effort=effort,
            acceleration=settings.acceleration,
            workspace=box,
            speed=settings.speed,
            slow_start=0.0 if settings.lockstep else settings.slow_start,
            max_age=np.inf if settings.lockstep else settings.max_age,
            deadman=settings.deadman,
        )

    def _connect_actions(self, controller: Mapping[str, Any]) -> Actions:
        limits, names = self._limits, self.policy.manifest.joint_names
        arrays = np.array([limits.lower, limits.upper, limits.velocity, limits.effort])
        parameters = dict(controller.get("parameters") or {})
        size = int(np.prod(self.policy.manifest.action.shape))
        try:
            made = Actions(controller["name"], parameters, self._laws, names, arrays, self._timestep, self.kinematics)
        except (KeyError, TypeError, ValueError) as error:
            raise NotReadyError(
                self._bundle.path, [f"its controllers are damaged ({error!r}); export it again"]
            ) from error
        if made.width != size:
            self._refuse([f"its action has {size} components, but its controllers use {made.width}; export it again"])
        return made

    def _wheel_limits(self) -> Limits:
        (law,) = self._laws
        fastest = np.array(law["max_velocity"], float)
        unlimited = np.full(2, np.inf)
        return Limits(
            joint_names=("linear", "angular"), lower=-unlimited, upper=unlimited, velocity=fastest,
            effort=unlimited, acceleration=self._settings.acceleration, speed=self._settings.speed,
            slow_start=self._limits.slow_start, max_age=self._limits.max_age, deadman=self._limits.deadman,
        )  # fmt: skip

    def _tool(self) -> Any:
        kinematics, tcp = self.kinematics, str(self._bundle.manifest["robot"]["tcp"])
        if self._settings.workspace is None:
            return None
        if self._drives or self._actions.mode == "effort":
            raise SettingsError(
                "workspace: the commands of this policy do not say where the tool moves; omit the option."
            )
        if kinematics is None or not kinematics.has_link(tcp):
            raise NotReadyError(self._bundle.path, [f"the workspace needs a robot_description with the link '{tcp}'"])
        return kinematics.chain(tcp).position

    def _connect(self) -> tuple[Any, Any]:
        """Return the publisher of the commands, and the function that makes their messages."""
        settings = self._settings
        if self._drives:
            kind, topic, message = "geometry_msgs/msg/Twist", "cmd_vel", self._twist
        elif settings.interface == "trajectory":
            topic = "joint_trajectory_controller/joint_trajectory"
            kind, message = "trajectory_msgs/msg/JointTrajectory", self._trajectory
        else:
            topic = f"forward_{self._actions.mode}_controller/commands"
            kind, message = "std_msgs/msg/Float64MultiArray", self._array
        if settings.interface == "trajectory" and self._actions.mode != "position":
            raise SettingsError("the interface trajectory requires a policy that commands positions; use forward.")
        return self._publisher_of(kind, settings.topic or topic), message

    def _publisher_of(self, kind: str, topic: str) -> Any:
        """Return a publisher to which a controller listens."""
        node = self._node
        publisher = node.publisher(kind, topic)
        if not self._settings.dry_run and not node.spin_until(lambda: publisher.get_subscription_count() > 0, 10.0):
            full = node.node.resolve_topic_name(topic)
            types = [kinds for name, kinds in node.node.get_topic_names_and_types() if name == full]
            others = sorted({*(types[0] if types else ())} - {kind})
            found = f", but it has the type {', '.join(others)}" if others else ""
            self._refuse([f"no controller listens to {full} ({kind}){found}; start it, or set --topic"])
        return publisher

    def _array(self, command: Array) -> Any:
        return message_type("std_msgs/msg/Float64MultiArray")(data=command.tolist())

    def _twist(self, command: Array) -> Any:
        twist = message_type("geometry_msgs/msg/Twist")()
        twist.linear.x, twist.angular.z = (float(value) for value in command)
        return twist

    def _trajectory(self, command: Array) -> Any:
        point = message_type("trajectory_msgs/msg/JointTrajectoryPoint")(positions=command.tolist())
        point.time_from_start.sec, rest = divmod(round(1e9 * self._timestep), 10**9)
        point.time_from_start.nanosec = rest
        names = [self.policy.manifest.joint_names[i] for i in self._arm]
        return message_type("trajectory_msgs/msg/JointTrajectory")(joint_names=names, points=[point])
