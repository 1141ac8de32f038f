"""Environments whose joints are commanded by topics."""

from contextlib import closing
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from frobs_core.contracts import CommandMode
from frobs_ros2.serve.controller import ExternalCommands
from frobs_ros2.serve.robot import ServedRobot
from frobs_ros2.serve.server import Settings, served_environment

ARMS = {
    "left": {"robot": "irb120", "controller": "joint_delta_position", "pose": {"pos": [0, 0.5, 0]}},
    "right": {"robot": "ur5", "controller": "joint_velocity", "pose": {"pos": [0, -0.5, 0]}},
}


@pytest.mark.parametrize(
    ("id", "kwargs", "joints"),
    [
        ("frobs/PandaPickAndPlace-v0", {}, 8),
        ("frobs/KobukiMaze-v0", {}, 2),
        ("frobs/Env-v0", {"task": "reach_together", "robots": ARMS}, 12),
    ],
    ids=["arm with a gripper", "mobile robot", "two arms"],
)
def test_topics_command_all_joints_of_any_robots(id: str, kwargs: dict[str, Any], joints: int) -> None:
    env, _ = served_environment(Settings(id=id, kwargs=kwargs))
    with closing(env):
        env.reset(seed=0)
        controllers = list(env.control.controllers.values())
        assert all(isinstance(controller, ExternalCommands) for controller in controllers)
        assert env.action_space.shape == (joints,)
        env.step(np.zeros(joints, np.float32))


def test_commands_replace_the_action() -> None:
    env, steps = served_environment(Settings(id="frobs/Irb120Reach-v0", lockstep=True))
    with closing(env):
        env.reset(seed=0)
        assert steps == 50
        assert isinstance(env.controller, ExternalCommands)
        env.robot.set_command_mode(CommandMode.VELOCITY)
        env.controller.rows = np.array([[0.5, 0.0, 0.0, 0.0, 0.0, 0.0]])
        before = env.robot.joint_positions[0, 0]
        for _ in range(10):
            env.step(np.ones(6, np.float32))
        assert env.robot.joint_positions[0, 0] - before == pytest.approx(0.5 * 10 * env.control_timestep, rel=0.2)


def test_robot_holds_when_commands_have_not_arrived_for_0_2_s() -> None:
    env, _ = served_environment(Settings(id="frobs/Irb120Reach-v0"))
    lines: list[str] = []
    fake: Any = SimpleNamespace(subscribe=lambda *arguments: None, log=lines.append)
    with closing(env):
        env.reset(seed=0)
        controllers: Any = list(env.control.controllers.values())
        robot, time, held = ServedRobot(env.robot, controllers, fake, "", 0.2), 0.0, 0.0
        for _ in range(40):
            if time < 0.1:
                robot.set_command(CommandMode.VELOCITY, robot.arm, [0.2, 0.0, 0.0, 0.0, 0.0, 0.0])
                last = robot.time
            robot.write_rows(env.decimation, env.simulation.physics_timestep, time)
            held = held or time * robot.holding
            env.step(np.zeros(6, np.float32))
            time += env.control_timestep
        assert held - last == pytest.approx(0.2, abs=1.5 * env.control_timestep)
        assert abs(env.robot.joint_velocities[0, 0]) < 0.01
    assert "holding: no command for 0.2 s" in lines
