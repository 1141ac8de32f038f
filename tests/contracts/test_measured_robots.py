"""Real robots as simulations."""

from __future__ import annotations

import numpy as np
import pytest

from frobs_core.contracts import CommandMode, MeasuredRobot, MeasuredSimulation, Pacer
from frobs_core.description import Placement
from frobs_core.plugins import get_record
from frobs_core.util.errors import SimulationError


class StuckArm(MeasuredSimulation):
    """An arm controlled by velocities that does not move, on a clock of its own."""

    num_envs, physics_timestep, homing, seconds = 1, 0.01, (0.5, 0.1), 0.0

    def __init__(self) -> None:
        description = get_record("robot", "irb120").load()
        model = description.read_model()
        arm = MeasuredRobot()
        arm.describe("robot", Placement(robot=description, model=model, command_mode=CommandMode.VELOCITY), 1)
        arm.measured = np.zeros((3, 1, arm.dof))
        arm.measured[0] = arm.home + 1.0
        self.robots, self.bodies, self.pacer = {"robot": arm}, {}, Pacer(lambda: self.seconds, self._sleep)

    def _sleep(self, seconds: float) -> None:
        self.seconds += seconds

    def send(self, decimation: int, duration: float) -> None:
        """Send nothing."""

    def receive(self, start: bool = False) -> None:
        """Receive nothing."""

    def close(self) -> None:
        """Nothing is open."""


def test_a_robot_that_does_not_come_home_keeps_the_mode_of_its_controller() -> None:
    simulation = StuckArm()
    robot = simulation.robots["robot"]
    for _ in range(2):
        with pytest.raises(SimulationError, match=r"did not stop at their home positions.*joint_1 by 1"):
            simulation.reset()
        assert robot.command_mode is CommandMode.VELOCITY
        assert not robot._take_commands(1).any()


def test_a_robot_beyond_its_limits_returns_slowly() -> None:
    simulation = StuckArm()
    robot = simulation.robots["robot"]
    robot.set_command_mode(CommandMode.POSITION)
    robot.measured[0] = robot.position_upper + 0.5
    robot.command(robot.home)
    np.testing.assert_allclose(
        robot.limited_command(1, 0.01, 0.5), (robot.position_upper + 0.5 - 0.005 * robot.velocity_limit)[0]
    )
    robot.measured[0] = robot.position_upper
    robot.command(robot.position_upper + 9.0)
    np.testing.assert_allclose(robot.limited_command(1, 0.01, 0.5), robot.position_upper[0])
