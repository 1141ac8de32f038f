"""A simulation that follows a real robot, so that a policy's own task observes it and its own controller commands it.

What a policy observes and what its actions mean is said in one place, the environment that it was trained in. Instead of
saying it again for ROS, this environment's simulation is put into the state that the robot measures; its task then tells
the observation, and its controller turns the action into a command for the joints.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np

from frobs_core.arrays import Floats
from frobs_core.env import RobotEnv
from frobs_core.errors import ConfigurationError, ParameterValueError
from frobs_core.interfaces import CommandMode, Lidar, Robot
from frobs_core.sensors import Instrument
from frobs_deploy import Bundle


@dataclass(frozen=True, kw_only=True)
class MeasuredLidar(Lidar):
    """A lidar that reads what it is told.

    Attributes:
        reading: (rays,) [m], to be written into.
    """

    type_name: ClassVar[str] = "measured lidar"
    instrument: ClassVar[str] = "frobs_ros.mirror:Measured"
    needs: ClassVar[str] = ""

    reading: Floats = field(compare=False, repr=False)

    @classmethod
    def like(cls, lidar: Lidar) -> MeasuredLidar:
        """Return one with the rays of another, and without its faults: the real one has faults enough."""
        same = {each.name: getattr(lidar, each.name) for each in fields(Lidar)}
        same |= {"rate": None, "noise": 0.0, "resolution": 0.0, "delay": 0.0, "dropout": 0.0}
        return cls(**same, reading=np.full(lidar.rays, lidar.range_max))


class Measured(Instrument):
    """Measures what was written into its sensor."""

    def measure(self) -> Floats:
        """Return (1, rays) [m]."""
        return np.array(self.sensor.reading[None])  # type: ignore[attr-defined]


@dataclass(frozen=True)
class State:
    """What a robot measures of itself, in the order of the policy's joints.

    Attributes:
        positions: (dof,) [rad or m]
        velocities: (dof,) [rad/s or m/s]
        base: pos (3,) [m], quat_wxyz (4,), lin_vel_world (3,) [m/s] and ang_vel_world (3,) [rad/s] of a base that moves.
        scans: (rays,) [m] by name of the lidar.
    """

    positions: Floats
    velocities: Floats
    base: tuple[Floats, Floats, Floats, Floats] | None = None
    scans: Mapping[str, Floats] = field(default_factory=dict)


@dataclass(frozen=True)
class Command:
    """What the joints are to do until the next one.

    Attributes:
        mode: Positions [rad or m], velocities [rad/s or m/s] or efforts [N·m or N].
        values: (dof,)
    """

    mode: CommandMode
    values: Floats


class Mirror:
    """The environment of a policy bundle, following a robot.

    Args:
        simulator: Which shall hold the picture of the robot; nothing is learned here, so any does.
        speed: Share of the joints' velocity limits that commands may use, in (0, 1].

    Attributes:
        lidars: Those that must be measured, by name.
        measured_pose: Pose in the world at the last :meth:`observe`, of the base if it moves and else of the tool: pos (3,)
            [m] and quat_wxyz (4,).

    Raises:
        ConfigurationError: The policy was trained behind wrappers, or sees images, or ``speed`` is out of range.
    """

    def __init__(self, bundle: Bundle, simulator: str = "mujoco", speed: float = 1.0) -> None:
        if not 0.0 < speed <= 1.0:
            raise ParameterValueError("speed", speed, "above 0 and at most 1")
        trained = bundle.manifest["environment"]
        if trained["wrappers"]:
            raise ConfigurationError(
                f"{bundle.path} was trained behind wrappers ({', '.join(map(str, trained['wrappers']))}), which are not in "
                "the bundle; train with the algorithm's own normalisation, and export again."
            )
        images = bundle.manifest["observation"].get("images") or {}
        if images:  # the mirror's own camera would draw the simulation, not what the robot's camera sees
            names = ", ".join(f"'{name}'" for name in images)
            raise ConfigurationError(
                f"{bundle.path} sees the images {names}, which a ROS node does not pass on; run it with frobs_deploy.Policy "
                "and give the images of the robot's camera to act()."
            )
        keywords = {**trained["keywords"], "simulator": simulator, "num_threads": 1}
        keywords.pop("randomize", None)
        self.env = _make(trained["id"], keywords)
        robot = self.env.robot.robot
        if robot.lidars:
            self.env.close()
            keywords.pop("sensors", None)  # they are in the description by now
            self.env = _make(trained["id"], {**keywords, "robot": _measuring(robot)})
        handle = self.env.robot
        self.lidars: Mapping[str, Any] = handle.robot.lidars
        self._speed = speed
        self.measured_pose: tuple[Floats, Floats] = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Of every joint array, in order."""
        return self.env.robot.joint_names

    @property
    def moves(self) -> bool:
        """Whether the base moves, so that it must be measured."""
        return self.env.robot.robot.base != "fixed"

    @property
    def goal_size(self) -> int:
        """Number of coordinates of a goal: 2 for a robot that has no joints but its wheels, else 3."""
        drive = self.env.robot.robot.differential_drive
        wheels = drive.left + drive.right if drive is not None else ()
        return 2 if set(wheels) == set(self.joint_names) else 3

    def begin(self, state: State, options: Mapping[str, Any] | None = None) -> None:
        """Begin an episode where the robot is.

        Args:
            state: What it measures.
            options: Of the task's reset: ``{"goal": (goal_size,)}``.

        Raises:
            UnknownParameterError: The task understands no such option.
            ConfigurationError: An option cannot be used.
        """
        self._follow(state)  # lidars are read in the reset
        self.env.reset(seed=0, options=dict(options or {}))
        self._follow(state)

    def observe(self, state: State) -> Any:
        """Return what the policy is to see: the observation of its task, at what the robot measures."""
        context = self.env.step_context
        context.rng.clock += 1
        self._follow(state)
        handle = self.env.robot
        pos, quat = handle.base_pose if self.moves else handle.frame_pose("tcp")
        self.measured_pose = pos[0].copy(), quat[0].copy()
        self.env.task.advance(context)
        observation = self.env.observations.observe()
        if isinstance(observation, dict):
            return {key: values[0] for key, values in observation.items()}
        return observation[0]

    def act(self, action: Any) -> Command:
        """Return what an action means for the joints, kept inside of their limits.

        A position is no farther from where the joint is than its velocity limit allows in a control step.
        """
        handle = self.env.robot
        measured = handle.joint_positions[0].copy()
        batch = np.asarray(action)[None]
        values = self.env.controller.apply(batch if batch.dtype.kind in "iu" else batch.astype(np.float64))
        handle.command(values)
        self.env.simulation.step(self.env.decimation)  # what is touched, and the time, are the task's to know
        last = np.asarray(values if values.ndim == 2 else values[:, -1])[0]
        fastest = self._speed * handle.velocity_limit[0]
        mode = handle.command_mode
        if mode is CommandMode.POSITION:
            reach = fastest * self.env.control_timestep
            last = np.clip(last, measured - reach, measured + reach)
            last = np.clip(last, handle.position_lower[0], handle.position_upper[0])
        elif mode is CommandMode.VELOCITY:
            last = np.clip(last, -fastest, fastest)
        else:
            last = np.clip(last, -handle.effort_limit[0], handle.effort_limit[0])
        return Command(mode, last)

    def hold(self, state: State) -> Command:
        """Return the command to stay: the present positions, or no velocity, or no effort."""
        mode = self.env.robot.command_mode
        still = state.positions if mode is CommandMode.POSITION else np.zeros_like(state.positions)
        return Command(mode, still.copy())

    def is_success(self) -> bool:
        """Whether the task is done by now."""
        return bool(self.env.task.is_success()[0])

    def close(self) -> None:
        """Release the simulation; twice is harmless."""
        self.env.close()

    def _follow(self, state: State) -> None:
        handle = self.env.robot
        handle.write_joint_state(state.positions[None], state.velocities[None])
        if state.base is not None:
            pos, quat, lin_vel, ang_vel = (part[None] for part in state.base)
            handle.write_base_pose(pos, quat)
            handle.write_base_twist(lin_vel, ang_vel)
        for name, lidar in self.lidars.items():
            if name in state.scans:
                ranges = np.nan_to_num(state.scans[name], nan=lidar.range_max, posinf=lidar.range_max)
                lidar.reading[:] = np.clip(ranges, lidar.range_min, lidar.range_max)


def _make(id: str, keywords: Mapping[str, Any]) -> RobotEnv:
    env = gym.make(f"frobs_core:{id}", disable_env_checker=True, **keywords).unwrapped
    assert isinstance(env, RobotEnv)
    return env


def _measuring(robot: Robot) -> Robot:
    sensors = {
        name: MeasuredLidar.like(sensor) if isinstance(sensor, Lidar) else sensor
        for name, sensor in robot.sensors.items()
    }
    return replace(robot, sensors=sensors)
