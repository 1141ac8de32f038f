"""A task for tests: a rover drives between walls, and observes nothing but its sensors."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np

from frobs_core.contracts import Control, Simulation, Snapshot, StepContext, Task  # fmt: skip
from frobs_core.description import (
    Body,
    Bumper,
    DifferentialDrive,
    DriveGains,
    Imu,
    Lidar,
    ObservationTerm,
    Robot,
    Scene,
)
from frobs_core.models import Box, Pose
from frobs_core.plugins.records import TaskRecord
from frobs_core.sensing.sensors import Sensors
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.random import RandomSource
from frobs_core.util.rotations import quat_from_axis_angle

FILE = Path(__file__).parents[2] / "templates" / "my_rover.urdf.xacro"
ROVER = Robot(
    model=str(FILE),
    name="rover",
    base="wheeled",
    tcp="base_link",
    gains=DriveGains(stiffness=0.0, damping=0.2),
    friction={"front_foot": 0.0, "back_foot": 0.0},
    differential_drive=DifferentialDrive(
        left=("left_wheel_joint",),
        right=("right_wheel_joint",),
        separation=0.3,
        wheel_radius=0.06,
        max_linear_velocity=0.8,
        max_angular_velocity=2.5,
    ),
    sensors={
        "scan": Lidar(frame="base_link", rays=6, range_min=0.1, range_max=3.0, offset=(0.0, 0.0, 0.2)),
        "imu": Imu(frame="base_link"),
        "bumper": Bumper(frame="base_link"),
    },
)


def _wall(x: float, y: float, dx: float, dy: float) -> Body:
    return Body(geometry=Box((dx, dy, 1.0)), pose=Pose(pos=(x, y, 0.5)))


class Seeing(Task):
    control_timestep: ClassVar[float] = 0.1
    physics_timestep: ClassVar[float] = 0.01
    reset_options: ClassVar[tuple[str, ...]] = ()

    def scene(self) -> Scene:
        walls = {"east": (0.6, 0.0, 0.1, 2.0), "north": (0.0, 0.8, 2.0, 0.1), "west": (-0.5, 0.0, 0.1, 2.0)}
        return Scene(bodies={name: _wall(*place) for name, place in walls.items()})

    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        self.robot = control.robot("robot")
        self.start = [part.copy() for part in self.robot.base_pose]
        self.sensors = Sensors(simulation, control_timestep)

    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        rows = slice(None) if mask is None else mask
        heading = rng.uniform("heading", -np.pi, np.pi, mask=mask)
        quat = quat_from_axis_angle(np.array([0.0, 0.0, 1.0]), heading)
        self.robot.write_base_pose(self.start[0][rows], quat, mask)
        self.begin_sensors(mask, rng)

    def begin_sensors(self, mask: Mask | None, rng: RandomSource) -> None:
        self.sensors.reset(mask, rng)

    def advance(self, context: StepContext) -> None:
        self.sensors.advance(context.rng)

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        return {name: self.sensors.term(name) for name in self.sensors.names}

    def reward(self, context: StepContext) -> Floats:
        return self.robot.base_pose[0][:, 0].copy()

    def is_success(self) -> Mask:
        return np.zeros(self.robot.num_envs, np.bool_)

    def snapshot(self) -> Snapshot:
        return dict(self.sensors.snapshot())

    def restore(self, snapshot: Snapshot) -> None:
        self.sensors.restore(snapshot)


class Forgetful(Seeing):
    """Its snapshot is complete only while every sensor is ideal."""

    def snapshot(self) -> Snapshot:
        return {key: values for key, values in super().snapshot().items() if "/read/" not in key}

    def restore(self, snapshot: Snapshot) -> None:
        """Take what is there."""
        super().restore({**super().snapshot(), **snapshot})


class Careless(Seeing):
    """It takes first samples where no episode begins."""

    def begin_sensors(self, mask: Mask | None, rng: RandomSource) -> None:
        for instrument in self.sensors._instruments.values():
            instrument.reset(mask)
        for name, channel in self.sensors._channels.items():
            channel.reset(rng, self.sensors._instruments[name].measure(), np.ones(self.robot.num_envs, np.bool_))
        self.sensors._readings.clear()


def record(cls: type[Task] = Seeing) -> TaskRecord:
    return TaskRecord(name="seeing", summary="a rover sees", entry_point=f"seeing:{cls.__name__}")


PARTS: dict[str, Any] = {"task": record(), "robot": ROVER, "controller": "differential_drive"}

for _cls in (Seeing, Forgetful, Careless):
    gym.register(
        f"seeing/{_cls.__name__}-v0",
        entry_point="frobs_core.kernel.env:RobotEnv",
        vector_entry_point="frobs_core.kernel.vector_env:RobotVectorEnv",
        max_episode_steps=30,
        kwargs={**PARTS, "task": record(_cls)},
    )
