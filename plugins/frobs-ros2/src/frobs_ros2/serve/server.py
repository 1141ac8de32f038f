"""The loop that serves an environment: clock, topics, services and episodes."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, cast

import gymnasium as gym
import numpy as np

from frobs_core.description import ALL, VECTORS
from frobs_core.kernel.compose import plan
from frobs_core.kernel.config import EnvConfig
from frobs_core.kernel.env import RobotEnv
from frobs_core.util.errors import ConfigurationError
from frobs_ros2.ros import PEER_TIMEOUT, Node, advice, message_type, stamp_of
from frobs_ros2.serve.controller import RECORD, ExternalCommands
from frobs_ros2.serve.measurements import CameraPublisher, Publishers
from frobs_ros2.serve.robot import ServedRobot

_REPEAT = 0.25  # [s] time after which the measurements are published again while a lockstep server waits
_MOST_LAG = 0.1  # [s] lag above which a slow simulation no longer tries to catch up


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Settings of a server.

    Attributes:
        id: ID of the environment.
        kwargs: Keywords of the environment that replace those of the ID.
        lockstep: Whether each command advances the simulation by one control step, instead of real time.
        rate: Rate of the measurements in real time [Hz].
        watchdog: Time without a forwarded command after which the robot holds [s].
        episodes: Number of episodes after which the server ends, or 0 for no limit and no automatic resets.
        seed: Seed of the first episode; each further episode adds 1.
        camera_size: Height and width of the images [pixels].
        camera_rate: Rate of the images [Hz].
    """

    id: str
    kwargs: Mapping[str, Any] = field(default_factory=dict)
    lockstep: bool = False
    rate: float = 100.0
    watchdog: float = 0.2
    episodes: int = 0
    seed: int = 0
    camera_size: tuple[int, int] = (240, 320)
    camera_rate: float = 10.0


def served_environment(settings: Settings) -> tuple[RobotEnv, int]:
    """Build an environment whose joints are commanded by topics.

    Returns:
        The environment, and the maximum number of steps of an episode (0: unlimited).
    """
    import_module("frobs_core")  # registers the IDs
    spec = gym.spec(settings.id)
    given = {**spec.kwargs, **settings.kwargs}
    planned = plan(EnvConfig.from_dict(given), 1)
    kwargs: dict[str, Any] = dict(settings.kwargs)
    controllers = {
        robot: dict.fromkeys(planned.everything[robot].robot.groups or (ALL,), RECORD) for robot in planned.controllers
    }
    if given.get("robots"):
        robots = {}
        for robot, value in given["robots"].items():
            one = dict(value) if isinstance(value, Mapping) else {"robot": value}
            robots[robot] = {**one, "controller": controllers[robot], "controller_kwargs": {}}
        kwargs["robots"] = robots
    else:
        kwargs |= {"controller": next(iter(controllers.values())), "controller_kwargs": {}}
    timestep = planned.control_timestep
    if not settings.lockstep:
        physics = planned.physics_timestep
        timestep = max(1, round(1.0 / (settings.rate * physics))) * physics
    steps = round((spec.max_episode_steps or 0) * planned.control_timestep / timestep)
    env = gym.make(settings.id, disable_env_checker=True, **kwargs, control_timestep=timestep).unwrapped
    return cast(RobotEnv, env), steps


class Server:
    """A served environment. Everything runs in the thread that calls :meth:`run`.

    Time never runs backward: a reset begins a new episode, but does not set the clock back. The topic ``observation``
    contains all numbers that the task observes, by name, and the number of the episode.

    Args:
        node: Node of the server.
        settings: The settings.

    Attributes:
        env: The environment.
        successes: Success of each finished episode.
    """

    def __init__(self, node: Node, settings: Settings) -> None:
        self.node, self.settings = node, settings
        self.env, self._episode_steps = served_environment(settings)
        self.successes: list[bool] = []
        self._action = np.zeros(self.env.action_space.shape or (), np.float32)
        self._time_ns, self._paused, self._episode, self._steps = 0, False, -1, 0
        self._step_ns = round(self.env.control_timestep * 1e9)
        self._next_image_ns = 0
        self._seen: list[int] | None = None
        self._alone_until = time.monotonic() + PEER_TIMEOUT
        self._clock = node.publisher("rosgraph_msgs/msg/Clock", "/clock")
        self._observation = node.publisher("sensor_msgs/msg/JointState", "observation")
        node.parameter("real_time_factor", 1.0)
        node.parameter("seed", settings.seed)
        self.env.reset(seed=settings.seed)
        names = list(self.env.control.robots)
        prefixes = {name: "" if len(names) == 1 else f"{name}/" for name in names}
        self.robots = [
            ServedRobot(
                control.robot,
                [cast(ExternalCommands, one) for one in control.controllers.values()],
                node,
                prefixes[name],
                0.0 if settings.lockstep else settings.watchdog,
            )
            for name, control in self.env.control.robots.items()
        ]
        self._publishers = [Publishers(self.env, name, node, prefixes[name]) for name in names]
        cameras = list(self.env.scene.cameras) if "rgb" in self.env.simulation.render_modalities else []
        self._cameras = [CameraPublisher(self.env, name, settings.camera_size, node) for name in cameras]
        self._offer_services()
        self._begin()

    def run(self, on_episode: Callable[[int, bool], None] = lambda number, success: None) -> None:
        """Serve until the node is shut down, or until all episodes have ended.

        Args:
            on_episode: Function that is called at the end of each episode, with its number and success.
        """
        self._publish()
        due = time.monotonic()
        while self.node.ok():
            if self.settings.lockstep:
                self._await_commands()
                if not self.node.ok():
                    return
            else:
                factor = max(1e-3, float(self.node.parameter("real_time_factor", 1.0)))
                due = max(due + self.env.control_timestep / factor, time.monotonic() - _MOST_LAG)
                self.node.spin_for(due - time.monotonic())
                self.node.spin()
            if not self._paused:
                self._advance()
                if self._episode_steps and self.settings.episodes and self._steps >= self._episode_steps:
                    self.successes.append(self._success)
                    on_episode(len(self.successes) - 1, self._success)
                    if len(self.successes) >= self.settings.episodes:
                        self._publish()
                        return
                    self._reset()
            self._publish()
            if time.monotonic() > self._alone_until:
                self._alone_until = math.inf
                if not self.node.has_peer():
                    self.node.log(f"no other node was seen in {PEER_TIMEOUT:g} s; {advice()}")

    def close(self) -> None:
        """Close the environment."""
        self.env.close()

    def _advance(self) -> None:
        for robot in self.robots:
            robot.write_rows(self.env.decimation, self.env.simulation.physics_timestep, 1e-9 * self._time_ns)
        observation, _, terminated, truncated, info = self.env.step(self._action)
        self._success = bool(info["is_success"])
        self._read(observation)
        self._time_ns += self._step_ns
        self._steps += 1
        if terminated or truncated:
            self._steps = max(self._steps, self._episode_steps)
            if not self.settings.episodes:
                self._reset()

    def _await_commands(self) -> None:
        seen = [robot.count_steps() for robot in self.robots] if self._seen is None else self._seen
        repeat = time.monotonic() + _REPEAT
        while self.node.ok() and any(
            robot.count_steps() <= before for robot, before in zip(self.robots, seen, strict=True)
        ):
            self.node.spin(0.05)
            if time.monotonic() > repeat:
                self._publish()
                repeat = time.monotonic() + _REPEAT
        self._seen = [before + 1 for before in seen]

    def _reset(self) -> None:
        """Begin the next episode. The clock continues."""
        self.env.reset(seed=int(self.node.parameter("seed", self.settings.seed)) + self._episode + 1)
        for robot in self.robots:
            robot.reset()
        self._begin()

    def _begin(self) -> None:
        self._episode, self._steps, self._success = self._episode + 1, 0, False
        self._seen = None
        self._time_ns += self._step_ns  # so that measurements of two episodes never have the same stamp
        self._read(self.env.observations.observe())

    def _read(self, observation: Any) -> None:
        """Store the numbers of an observation by name."""
        flat = observation.get(VECTORS) if isinstance(observation, dict) else observation
        self._names, self._values = ["episode", "success"], [float(self._episode), float(self._success)]
        parts = observation if isinstance(observation, dict) else {VECTORS: flat}
        for name, (key, columns) in self.env.observations.columns.items():
            term = self.env.observations.terms[name]
            if term.is_vector:
                values = np.asarray(parts[key], float).reshape(-1)[columns].tolist()
                self._names += [f"{name}/{i}" for i in range(len(values))]
                self._values += values

    def _publish(self) -> None:
        stamp = stamp_of(self._time_ns)
        self._clock.publish(message_type("rosgraph_msgs/msg/Clock")(clock=stamp))
        header = message_type("std_msgs/msg/Header")(stamp=stamp)
        kind = message_type("sensor_msgs/msg/JointState")
        self._observation.publish(kind(header=header, name=self._names, position=self._values))
        if self._time_ns >= self._next_image_ns or self.settings.lockstep:
            self._next_image_ns = self._time_ns + round(1e9 / self.settings.camera_rate)
            for camera in self._cameras:
                camera.publish(stamp)
        for publisher in self._publishers:
            publisher.publish(stamp)

    def _offer_services(self) -> None:
        def reset(_: Any, response: Any) -> Any:
            try:
                self._reset()
            except ConfigurationError as error:
                self.node.log(str(error))
                if hasattr(response, "success"):
                    response.success, response.message = False, str(error)
                return response
            self._publish()
            if hasattr(response, "success"):
                response.success, response.message = True, f"episode {self._episode}"
            return response

        def pause(paused: bool) -> Callable[[Any, Any], Any]:
            def answer(_: Any, response: Any) -> Any:
                self._paused = paused
                return response

            return answer

        def set_paused(request: Any, response: Any) -> Any:
            self._paused, response.success = bool(request.data), True
            return response

        self.node.service("std_srvs/srv/Trigger", "reset", reset)
        self.node.service("std_srvs/srv/SetBool", "pause", set_paused)
        for name in ("reset_simulation", "reset_world"):
            self.node.service("std_srvs/srv/Empty", name, reset)
        self.node.service("std_srvs/srv/Empty", "pause_physics", pause(True))
        self.node.service("std_srvs/srv/Empty", "unpause_physics", pause(False))
