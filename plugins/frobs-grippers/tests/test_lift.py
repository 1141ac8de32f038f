"""Proof: an arm with a gripper lifts a cube from the floor, holds it while the arm shakes, and drops it when it opens."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from frobs_core.contracts import Control, Simulation, StepContext, Task
from frobs_core.description import Body, ObservationTerm, Robot, Scene
from frobs_core.kernel.env import RobotEnv
from frobs_core.models import Box, Pose
from frobs_core.plugins.records import TaskRecord
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.random import RandomSource

CUBE, PLACE = 0.04, (0.45, 0.0, 0.02)  # [m]
HOLD = 2.0  # [s]
ENGINES: dict[str, dict[str, Any]] = {"mujoco": {"cone": "elliptic", "impratio": 10.0}, "pybullet": {}}


class CubeOnFloor(Task):
    """A cube of 100 g; nothing is rewarded."""

    def scene(self) -> Scene:
        return Scene(bodies={"cube": Body(geometry=Box((CUBE,) * 3), pose=Pose(PLACE), mass=0.1)})

    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        self.simulation, self.robot = simulation, control.robot("robot")

    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        pass

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        robot, far = self.robot, np.full(3, np.inf)
        return {"tcp": ObservationTerm(read=lambda: robot.frame_pose("tcp")[0], low=-far, high=far, unit="m")}

    def reward(self, context: StepContext) -> Floats:
        return np.zeros(self.simulation.num_envs)

    def is_success(self) -> Mask:
        return np.zeros(self.simulation.num_envs, bool)


class CubeRecord(TaskRecord):
    """A record whose implementation needs no import."""

    def load(self) -> type[Task]:
        return CubeOnFloor


class Script:
    """Moves the tool of an environment by hand.

    Args:
        robot: The robot with a gripper.
        simulator: The engine.
        gripper: Controller of the gripper.
        physics_timestep: [s]
    """

    def __init__(self, robot: str | Robot, simulator: str, gripper: str, physics_timestep: float) -> None:
        self.env = RobotEnv(
            task=CubeRecord(name="cube_on_floor", summary="", entry_point="nowhere:CubeOnFloor"),
            robot=robot,
            controller={"arm": "tcp_delta_pose", "gripper": gripper},
            controller_kwargs={"arm": {"max_delta": 0.02}},
            simulator=simulator,
            simulator_kwargs=ENGINES[simulator],
            physics_timestep=physics_timestep,
            control_timestep=0.04,
        )
        self.env.reset(seed=0)
        self.robot, self.cube = self.env.robot, self.env.simulation.bodies["cube"]
        self.deepest = 0.0

    def step(self, move: np.ndarray, opening: float) -> None:
        self.env.step(np.concatenate([np.clip(move, -1.0, 1.0), np.zeros(3), [opening]]))
        gap = self.robot.frame_pose("gripper_left_finger")[0] - self.robot.frame_pose("gripper_right_finger")[0]
        offset = np.abs(self.in_hand()).max()
        if offset < CUBE / 2:
            self.deepest = max(self.deepest, CUBE - float(np.linalg.norm(gap)))

    def go_to(self, target: np.ndarray, opening: float, steps: int = 80) -> None:
        for _ in range(steps):
            self.step(10.0 * (target - self.tcp), opening)

    @property
    def tcp(self) -> np.ndarray:
        pos: np.ndarray = self.robot.frame_pose("tcp")[0][0]
        return pos.copy()

    @property
    def height(self) -> float:
        return float(self.cube.pose[0][0, 2])

    def in_hand(self) -> np.ndarray:
        """Return where the cube is, seen from the tool [m]."""
        offset: np.ndarray = self.cube.pose[0][0] - self.tcp
        return offset


def lift_shake_and_drop(
    robot: str | Robot, simulator: str, physics_timestep: float = 0.002, opened: float = 1.0
) -> None:
    script = Script(robot, simulator, "gripper_delta" if opened < 1.0 else "gripper_position", physics_timestep)
    place = np.array(PLACE)
    above = np.add(PLACE, (0.0, 0.0, 0.15))
    script.go_to(above, opened)
    script.go_to(place, 0.0 if opened < 1.0 else opened)
    assert np.abs(script.tcp - place).max() < 0.005
    script.go_to(place, -1.0, 30)
    script.go_to(above, -1.0)
    assert script.height > 0.14
    before = script.in_hand()
    for i in range(round(HOLD / script.env.control_timestep)):
        script.step(0.5 * np.sin(0.6 * i + np.arange(3)), -1.0)
    assert np.linalg.norm(script.in_hand() - before) < 0.01  # it slips by millimetres at most
    assert script.height > 0.1
    assert script.deepest < 0.002
    script.go_to(above, 1.0, 40)
    assert script.height == pytest.approx(CUBE / 2, abs=0.002)
    script.env.close()


@pytest.mark.parametrize("physics_timestep", [0.002, 0.004])
@pytest.mark.parametrize("robot", ["panda", "ur5_gripper"])
def test_a_robot_lifts_a_cube_and_holds_it_while_it_shakes(robot: str, physics_timestep: float) -> None:
    lift_shake_and_drop(robot, "mujoco", physics_timestep)


@pytest.mark.slow
@pytest.mark.parametrize("simulator", list(ENGINES))
@pytest.mark.parametrize("tool", ["two_finger_hand", "parallel_gripper"])
@pytest.mark.parametrize("arm", ["irb120", "irb140", "ur5", "panda_arm"])
def test_every_arm_lifts_with_every_gripper(arm: str, tool: str, simulator: str) -> None:
    lift_shake_and_drop(f"{arm}+{tool}", simulator)


def test_a_gripper_that_moves_by_increments_lifts_too() -> None:
    lift_shake_and_drop("panda", "mujoco", opened=0.5)
