"""Provides a simulation that follows a real robot, so that a policy's task and controller can be used on the robot.

The training environment defines the observations and actions. To avoid defining observations and actions again for ROS,
the environment's simulation is set to the robot's measured state. The environment's task then returns the observation,
and the environment's controller converts the action into a joint command.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np

from frobs_core.contracts import CommandMode
from frobs_core.description import Lidar, Robot
from frobs_core.kernel.env import RobotEnv
from frobs_core.sensing.sensors import Instrument
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError, ParameterValueError
from frobs_deploy import Bundle


@dataclass(frozen=True, kw_only=True)
class MeasuredLidar(Lidar):
    """A lidar whose readings are set from a real robot's scans.

    Attributes:
        reading: Measured ranges [m], as a writable array of shape (rays,).
    """

    type_name: ClassVar[str] = "measured lidar"
    instrument: ClassVar[str] = "frobs_ros.policy_node.mirror:Measured"
    needs: ClassVar[str] = ""

    reading: Floats = field(compare=False, repr=False)

    @classmethod
    def like(cls, lidar: Lidar) -> MeasuredLidar:
        """Return a measured lidar with the same rays as ``lidar``, but without noise and faults."""
        same = {each.name: getattr(lidar, each.name) for each in fields(Lidar)}
        same |= {"rate": None, "noise": 0.0, "resolution": 0.0, "delay": 0.0, "dropout": 0.0}
        return cls(**same, reading=np.full(lidar.rays, lidar.range_max))


class Measured(Instrument):
    """An instrument that returns the readings of a measured lidar."""

    def measure(self) -> Floats:
        """Return the measured ranges, (1, rays) [m]."""
        return np.array(self.sensor.reading[None])  # type: ignore[attr-defined]


@dataclass(frozen=True)
class State:
    """Measured state of a robot, in the order of the policy's joints.

    Attributes:
        positions: Joint positions, (dof,) [rad or m].
        velocities: Joint velocities, (dof,) [rad/s or m/s].
        base: None for a fixed base, or the state of a moving base: pos (3,) [m], quat_wxyz (4,), lin_vel_world (3,)
            [m/s] and ang_vel_world (3,) [rad/s].
        scans: Scan of each lidar, (rays,) [m], by the lidar's name.
    """

    positions: Floats
    velocities: Floats
    base: tuple[Floats, Floats, Floats, Floats] | None = None
    scans: Mapping[str, Floats] = field(default_factory=dict)


@dataclass(frozen=True)
class Command:
    """A joint command, which applies until the next command.

    Attributes:
        mode: Type of the values: positions [rad or m], velocities [rad/s or m/s] or efforts [N·m or N].
        values: Commanded value of each joint, (dof,).
    """

    mode: CommandMode
    values: Floats


class Mirror:
    """The environment that a policy was trained in, with a simulation that follows a real robot.

    Args:
        bundle: Bundle that contains the policy.
        simulator: Simulator that represents the robot's state. Any simulator can be used.
        speed: Fraction of the joints' velocity limits that commands may use, in (0, 1].

    Attributes:
        lidars: Lidars whose scans must be measured, by name.
        measured_pose: Measured pose in the world frame at the last call of :meth:`observe`, as pos (3,) [m] and
            quat_wxyz (4,). This is the pose of the base if the base moves, and the pose of the tool otherwise.

    Raises:
        ConfigurationError: The policy was trained with wrappers or uses images, or ``speed`` is out of range.
    """

    def __init__(self, bundle: Bundle, simulator: str = "mujoco", speed: float = 1.0) -> None:
        if not 0.0 < speed <= 1.0:
            raise ParameterValueError("speed", speed, "above 0 and at most 1")
        trained = bundle.manifest["environment"]
        if trained["wrappers"]:
            raise ConfigurationError(
                f"{bundle.path} was trained with the wrappers {', '.join(map(str, trained['wrappers']))}, which policy "
                "bundles do not contain; train with the algorithm's normalization instead, and export the policy again."
            )
        images = bundle.manifest["observation"].get("images") or {}
        if images:  # the mirror's camera would show the simulation, not the view of the robot's camera
            names = ", ".join(f"'{name}'" for name in images)
            raise ConfigurationError(
                f"{bundle.path} uses the images {names}, but this command does not support images; run the policy with "
                "frobs_deploy.Policy and pass the images of the robot's camera to act()."
            )
        keywords = {**trained["keywords"], "simulator": simulator, "num_threads": 1}
        keywords.pop("randomize", None)
        self.env = _make(trained["id"], keywords)
        robot = self.env.robot.robot
        if robot.lidars:
            self.env.close()
            keywords.pop("sensors", None)  # the robot's description already contains the sensors
            self.env = _make(trained["id"], {**keywords, "robot": _measuring(robot)})
        handle = self.env.robot
        self.lidars: Mapping[str, Any] = handle.robot.lidars
        self._speed = speed
        self.measured_pose: tuple[Floats, Floats] = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joint names, in the order of all joint arrays."""
        return self.env.robot.joint_names

    @property
    def moves(self) -> bool:
        """Whether the robot's base moves, so that its state must be measured."""
        return self.env.robot.robot.base != "fixed"

    @property
    def goal_size(self) -> int:
        """Number of goal coordinates: 2 for a robot whose only joints are drive wheels, and 3 for other robots."""
        drive = self.env.robot.robot.differential_drive
        wheels = drive.left + drive.right if drive is not None else ()
        return 2 if set(wheels) == set(self.joint_names) else 3

    def begin(self, state: State, options: Mapping[str, Any] | None = None) -> None:
        """Start an episode in the robot's measured state.

        Args:
            state: Measured state of the robot.
            options: Reset options of the task, such as ``{"goal": …}`` with an array of shape (goal_size,).

        Raises:
            UnknownParameterError: The task does not support an option.
            ConfigurationError: The value of an option is invalid.
        """
        self._follow(state)  # the reset reads lidars
        self.env.reset(seed=0, options=dict(options or {}))
        self._follow(state)

    def observe(self, state: State) -> Any:
        """Return the task's observation for the measured state."""
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
        """Return the joint command for an action, clipped to the joint limits.

        A commanded position is also clipped to the range that the joint can reach in one control step without exceeding
        its velocity limit.
        """
        handle = self.env.robot
        measured = handle.joint_positions[0].copy()
        batch = np.asarray(action)[None]
        values = self.env.controller.apply(batch if batch.dtype.kind in "iu" else batch.astype(np.float64))
        handle.command(values)
        self.env.simulation.step(self.env.decimation)  # updates the contacts and the time for the task
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
        """Return a command that stops the robot: the measured positions, zero velocities, or zero efforts."""
        mode = self.env.robot.command_mode
        still = state.positions if mode is CommandMode.POSITION else np.zeros_like(state.positions)
        return Command(mode, still.copy())

    def is_success(self) -> bool:
        """Return whether the task is currently successful."""
        return bool(self.env.task.is_success()[0])

    def close(self) -> None:
        """Close the environment. Further calls have no effect."""
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
