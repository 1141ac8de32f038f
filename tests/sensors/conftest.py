from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frobs_core.contracts import CommandMode
from frobs_core.description import Body, Placement, Robot, Scene, Sensor
from frobs_core.models import Box, Pose
from frobs_core.sensing.sensors import Sensors, with_contacts
from frobs_core.util.random import RandomSource
from frobs_devkit.testing.simulator.robots import ROVER, model_of
from frobs_sim_mujoco.simulation import MujocoSimulation

sys.path.insert(0, str(Path(__file__).parent))  # where seeing.py is

STEP = 0.02  # [s] of control
WALL = Body(geometry=Box((0.2, 4.0, 1.0)), pose=Pose(pos=(2.0, 0.0, 0.5)))  # its near face is 1.9 m away


class World:
    """A rover with sensors before a wall, and a source of random numbers: what an environment would hold."""

    def __init__(self, num_envs: int, sensors: Mapping[str, Sensor], seed: int, robot: Robot, scene: Scene) -> None:
        placement = Placement(
            robot=replace(robot, sensors=sensors),
            model=model_of(robot.model),
            pose=Pose(pos=(0.0, 0.0, 0.05)),
            command_mode=CommandMode.VELOCITY,
        )
        robots = {"robot": placement}
        self.simulation = MujocoSimulation(
            robots, with_contacts(scene, robots), num_envs=num_envs, physics_timestep=0.005
        )
        self.robot = self.simulation.robots["robot"]
        self.sensors = Sensors(self.simulation, STEP)
        self.rng = RandomSource(num_envs)
        self.rng.seed([seed + i for i in range(num_envs)])
        self.reset()

    def reset(self, mask: Any = None) -> None:
        self.rng.begin_episode(mask)
        self.simulation.reset(mask)
        self.sensors.reset(mask, self.rng)

    def step(self, times: int = 1) -> None:
        for _ in range(times):
            self.rng.clock += 1
            self.simulation.step(4)
            self.sensors.advance(self.rng)

    def watch(self, name: str, steps: int) -> Any:
        """Return what a sensor reads in the reset and in each step after it, (steps + 1, num_envs, width)."""
        read = [self.sensors.read(name).copy()]
        for _ in range(steps):
            self.step()
            read.append(self.sensors.read(name).copy())
        return np.stack(read)


@pytest.fixture
def world() -> Iterator[Callable[..., World]]:
    """Build a world: ``world(num_envs, scan=Lidar(…))``; it is closed after the test."""
    made = []

    def build(
        num_envs: int, seed: int = 0, robot: Robot = ROVER, scene: Scene | None = None, **sensors: Sensor
    ) -> World:
        made.append(World(num_envs, sensors, seed, robot, scene or Scene(bodies={"wall": WALL})))
        return made[-1]

    yield build
    for one in made:
        one.simulation.close()
