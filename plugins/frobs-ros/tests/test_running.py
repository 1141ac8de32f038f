from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.kernel.env import RobotEnv
from frobs_core.util.arrays import Floats
from frobs_deploy import Policy, read_bundle
from frobs_ros.errors import ClockResetError, NodeEndedError
from frobs_ros.policy_node.running import Report, act, goal_size
from frobs_train import resolve_config, train
from frobs_train.export.export import export
from frobs_train.export.pretrained import read_pretrained
from frobs_train.runs.policy import load_algorithm

REACH = "frobs/Irb120Reach-v0"
GOAL, OTHER = np.array([0.35, 0.15, 0.5]), np.array([0.3, -0.25, 0.6])


class Run:
    """A run on a simulated robot, whose clock is the time of the simulation, for 50 steps unless a test ends it."""

    def __init__(self, env: RobotEnv, policy: Policy) -> None:
        self.env, self.policy = env, policy
        self.goals: deque[Floats] = deque(maxlen=1)
        self.after: Callable[[Report], None] = lambda report: None
        self.time, self.starts = 0.0, 0
        self.after_simulation: Callable[[], None] = lambda: None
        self._simulate, env.simulation.step = env.simulation.step, self._step  # type: ignore[method-assign]
        env.after_reset.append(lambda mask: setattr(self, "starts", self.starts + 1))

    def _step(self, decimation: int) -> None:
        self._simulate(decimation)
        self.time += self.env.control_timestep
        self.after_simulation()

    def __call__(self, goal: Floats = GOAL, steps: int = 50) -> Report:
        return act(
            self.env,
            self.policy,
            clock=lambda: self.time,
            goal=goal,
            goals=self.goals,
            seconds=(steps - 0.5) * self.env.control_timestep,
            on_step=lambda report: self.after(report),
        )

    @property
    def tool(self) -> Floats:
        return self.env.robot.frame_pose("tcp")[0][0].copy()


@pytest.fixture
def run() -> Iterator[Run]:
    env = gym.make(f"frobs_core:{REACH}", disable_env_checker=True).unwrapped
    yield Run(env, Policy(read_pretrained(REACH)))  # type: ignore[arg-type]
    env.close()


def fail_once(run: Run, monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    """Make the tenth step fail, once."""
    step, count = run.env.step, iter(range(1, 1000))

    def fail(action: Any) -> Any:
        if next(count) == 10:
            raise error
        return step(action)

    monkeypatch.setattr(run.env, "step", fail)


def test_a_policy_takes_the_tool_to_the_goal_within_the_time(run: Run) -> None:
    report = run()
    assert (report.steps, report.late, report.restarts) == (50, 0, 0)
    assert report.is_success
    assert np.linalg.norm(run.tool - GOAL) < 0.05


def test_a_new_goal_begins_an_episode(run: Run) -> None:
    run.after = lambda report: run.goals.append(OTHER) if report.steps == 10 else None
    report = run(steps=60)
    assert report.restarts == 1
    assert run.starts == 2
    assert np.linalg.norm(run.tool - OTHER) < 0.05


def test_a_clock_that_goes_back_begins_an_episode(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    fail_once(run, monkeypatch, ClockResetError(1.0, 0.0))
    report = run()
    assert (report.restarts, run.starts, report.steps) == (1, 2, 50)
    assert report.is_success


def test_the_end_of_the_node_ends_the_run(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    fail_once(run, monkeypatch, NodeEndedError())
    assert run().steps == 9


def test_late_steps_are_counted(run: Run) -> None:
    run.env.after_step.append(lambda result: result[-1].update({"frobs/missed_deadlines": np.array([run.time > 0.1])}))
    assert run().late == 1


def test_a_robot_holds_after_the_end_of_an_episode_until_there_is_a_new_goal(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run.env.task, "is_terminated", lambda: np.array([run.starts == 1 and run.time > 0.4]))
    run.env._loop._can_terminate = True
    held: list[Floats] = []

    def give_a_goal_after_a_second() -> None:
        if run.starts == 1 and run.time > 1.4:
            held.append(run.env.robot.joint_velocities[0].copy())
            run.goals.append(OTHER)

    run.after_simulation = give_a_goal_after_a_second
    report = run(steps=80)
    assert np.abs(held[0]).max() < 0.02
    assert report.restarts == 1
    assert report.steps == pytest.approx(80 - 1.0 / run.env.control_timestep, abs=2)
    assert np.linalg.norm(run.tool - OTHER) < 0.05


def test_a_wheeled_robot_has_a_goal_of_two_coordinates(run: Run) -> None:
    assert goal_size(run.env) == 3
    env = gym.make("frobs_core:frobs/KobukiEmpty-v0", disable_env_checker=True).unwrapped
    assert goal_size(env) == 2  # type: ignore[arg-type]
    env.close()


@pytest.mark.slow
def test_a_policy_with_memory_acts_as_in_evaluation_and_forgets_at_a_new_goal(tmp_path: Path, run: Run) -> None:
    """The node, ``frobs-deploy`` and the algorithm itself give the same actions for the same observations."""
    settings = ["steps=20", "num_envs=1", "algorithm_config.demonstrations=pretrained"]
    settings += ["algorithm_config.demonstration_episodes=1", "algorithm_config.history=4"]
    trained = train(resolve_config(REACH, flags={"algorithm": "bc", "seed": 0}, settings=settings), tmp_path / "run")
    export(trained, tmp_path / "memory.frobs")
    read_bundle(tmp_path / "memory.frobs")
    run.policy = policy = Policy(tmp_path / "memory.frobs")
    assert policy.recurrent
    seen: list[Any] = []
    acted: list[Any] = []
    starts: list[int] = []
    choose = policy.act

    def choose_and_note(observation: Any) -> Any:
        seen.append(np.array(observation))
        starts.append(run.starts)
        acted.append(np.array(choose(observation)))
        return acted[-1]

    policy.act = choose_and_note  # type: ignore[method-assign]
    run.after = lambda report: run.goals.append(OTHER) if report.steps == 10 else None
    assert run().restarts == 1
    algorithm = load_algorithm(trained, run.env.observation_space, run.env.action_space)[0]
    state = None
    for index, (observation, action) in enumerate(zip(seen, acted, strict=True)):
        start = index == 0 or starts[index] != starts[index - 1]
        expected, state = algorithm.predict(observation[None], state, np.array([start]))
        np.testing.assert_allclose(action, expected[0], atol=1e-4)
