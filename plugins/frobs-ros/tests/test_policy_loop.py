from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.util.arrays import Floats
from frobs_deploy import Policy, read_bundle
from frobs_ros.policy_node import policy_loop
from frobs_ros.policy_node.mirror import Command, Mirror, State
from frobs_ros.policy_node.policy_loop import RobotSilentError, act
from frobs_train import resolve_config, train
from frobs_train.export.export import export
from frobs_train.export.pretrained import read_pretrained
from frobs_train.runs.policy import load_algorithm

REACH = "frobs/Irb120Reach-v0"


class PlayedRobot:
    """An arm that a simulation plays: its clock goes on while nobody waits for anything else."""

    def __init__(self) -> None:
        self.env = gym.make(f"frobs_core:{REACH}", disable_env_checker=True, controller="joint_position").unwrapped
        self.env.reset(seed=1)
        self.period = self.env.control_timestep
        self.time, self.silence, self.commands = 0.0, 0.0, []
        self.goals: list[Floats] = []
        self.after: Callable[[PlayedRobot], None] = lambda robot: None

    @property
    def tool(self) -> Floats:
        return self.env.robot.frame_pose("tcp")[0][0].copy()

    def now(self) -> float:
        self.time += 0.3 * self.period
        return self.time

    def state(self) -> State:
        robot = self.env.robot
        return State(robot.joint_positions[0].copy(), robot.joint_velocities[0].copy())

    def silent(self) -> tuple[str, float]:
        return "joint states", self.silence

    def new_goal(self) -> Floats | None:
        return self.goals.pop() if self.goals else None

    def send(self, command: Command, seconds: float) -> None:
        self.commands.append(command)
        robot = self.env.robot
        low, high = robot.position_lower[0], robot.position_upper[0]
        self.env.step(2.0 * (command.values - low) / (high - low) - 1.0)
        self.after(self)

    hold = send

    def is_over(self) -> bool:
        return len(self.commands) >= 60


@pytest.fixture
def parts(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Any, Mirror, Policy]]:
    monkeypatch.setattr(policy_loop.time, "sleep", lambda seconds: None)
    bundle = read_pretrained(REACH)
    robot, mirror = PlayedRobot(), Mirror(bundle)
    yield robot, mirror, Policy(bundle)
    mirror.close()
    robot.env.close()


def test_a_policy_takes_the_tool_to_the_goal_and_then_lets_the_robot_stay(parts: Any) -> None:
    robot, mirror, policy = parts
    goal = np.array([0.35, 0.15, 0.5])
    report = act(robot, mirror, policy, goal=goal)
    assert report.steps == 60
    assert report.late == 0
    assert report.is_success
    assert np.linalg.norm(robot.tool - goal) < 0.05
    assert len(robot.commands) == 61  # the last is to stay


def test_it_acts_once_in_a_control_step_by_the_robots_clock(parts: Any) -> None:
    robot, mirror, policy = parts
    report = act(robot, mirror, policy, seconds=10 * mirror.env.control_timestep)
    assert report.steps == pytest.approx(10, abs=2)


def test_a_new_goal_begins_an_episode(parts: Any) -> None:
    robot, mirror, policy = parts
    goal = np.array([0.3, -0.25, 0.6])
    robot.after = lambda robot: robot.goals.append(goal) if len(robot.commands) == 10 else None
    report = act(robot, mirror, policy, goal=np.array([0.35, 0.15, 0.5]))
    assert report.restarts == 1
    assert np.linalg.norm(robot.tool - goal) < 0.05


def test_a_clock_that_goes_back_begins_an_episode_and_hangs_nothing(parts: Any) -> None:
    robot, mirror, policy = parts

    def reset(robot: Any) -> None:
        if len(robot.commands) == 10:
            robot.time = 0.0

    robot.after = reset
    report = act(robot, mirror, policy)
    assert report.restarts == 1
    assert report.steps == 60


def test_a_robot_that_falls_silent_is_told_to_stay(parts: Any) -> None:
    robot, mirror, policy = parts

    def fall_silent(robot: Any) -> None:
        robot.silence = 0.8 * (len(robot.commands) >= 5)

    robot.after = fall_silent
    with pytest.raises(
        RobotSilentError, match=r"no joint states received for 0\.8 s; the robot was commanded to hold its position"
    ):
        act(robot, mirror, policy)
    assert len(robot.commands) == 6
    here = robot.state().positions
    assert robot.commands[-1].values == pytest.approx(here, abs=0.1)


def test_an_interrupt_leaves_the_robot_told_to_stay(parts: Any) -> None:
    robot, mirror, policy = parts

    def interrupt(robot: Any) -> None:
        if len(robot.commands) == 5:
            raise KeyboardInterrupt

    robot.after = interrupt
    with pytest.raises(KeyboardInterrupt):
        act(robot, mirror, policy)
    assert len(robot.commands) == 6


@pytest.mark.slow
def test_a_policy_with_memory_acts_as_in_evaluation_and_forgets_at_a_new_goal(tmp_path: Path, parts: Any) -> None:
    """The node, ``frobs-deploy`` and the algorithm itself give the same actions for the same observations."""
    settings = ["steps=20", "num_envs=1", "algorithm_config.demonstrations=pretrained"]
    settings += ["algorithm_config.demonstration_episodes=1", "algorithm_config.history=4"]
    run = train(resolve_config(REACH, flags={"algorithm": "bc", "seed": 0}, settings=settings), tmp_path / "run")
    export(run, tmp_path / "memory.frobs")
    robot = parts[0]
    mirror, policy = Mirror(read_bundle(tmp_path / "memory.frobs")), Policy(tmp_path / "memory.frobs")
    assert policy.recurrent
    seen: list[Any] = []
    observe = mirror.observe
    mirror.observe = lambda state: seen.append(observe(state)) or seen[-1]  # type: ignore[method-assign, func-returns-value]
    acted: list[Any] = []
    step = mirror.act
    mirror.act = lambda action: acted.append(np.array(action)) or step(action)  # type: ignore[method-assign, func-returns-value]
    restarts: list[int] = []
    goal = np.array([0.3, -0.25, 0.6])
    robot.after = lambda robot: robot.goals.append(goal) if len(robot.commands) == 10 else None
    act(
        robot, mirror, policy, goal=np.array([0.35, 0.15, 0.5]), on_step=lambda report: restarts.append(report.restarts)
    )
    mirror.close()
    assert restarts[-1] == 1
    algorithm = load_algorithm(run, mirror.env.observation_space, mirror.env.action_space)[0]
    state = None
    for index, (observation, action) in enumerate(zip(seen, acted, strict=True)):
        start = index == 0 or restarts[index] != restarts[index - 1]
        expected, state = algorithm.predict(np.asarray(observation)[None], state, np.array([start]))
        np.testing.assert_allclose(action, expected[0], atol=1e-4)
