"""The experts solve their tasks, with both arms and on two engines."""

from __future__ import annotations

from contextlib import closing
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from expert_runs import expert_of, made, success_rate

from frobs_core import load_policy
from frobs_core.contracts import Expert
from frobs_core.util.errors import ConfigurationError
from frobs_devkit.testing import CheckFailure, check_env

TASKS = (
    "Push",
    "Slide",
    "Lift",
    "PickAndPlace",
    "Stack",
    "PegInsertion",
    "PegInsertionTight",
    "OpenDrawer",
    "OpenDoor",
    "PushGoal",
    "PickAndPlaceGoal",
    "SlideGoal",
)
IDS = [f"frobs_core:frobs/{arm}{task}-v0" for arm in ("Panda", "Ur5") for task in TASKS]
LIFT = "frobs_core:frobs/PandaLift-v0"


@pytest.mark.slow
@pytest.mark.parametrize("id", IDS)
def test_the_expert_succeeds_from_200_random_starts(id: str) -> None:
    with made(id, num_envs=200) as env:
        assert success_rate(env) >= 0.98


@pytest.mark.needs("pybullet")
@pytest.mark.slow
@pytest.mark.parametrize("id", IDS)
def test_the_expert_succeeds_on_pybullet(id: str) -> None:
    with made(id, num_envs=10, simulator="pybullet") as env:
        assert success_rate(env) >= 0.9


@pytest.mark.needs("pybullet")
@pytest.mark.slow
def test_pybullets_fingers_press_with_the_effort_of_their_drive() -> None:
    with made(LIFT, num_envs=8, simulator="pybullet") as env:
        assert success_rate(env) == 1.0  # a gripper that presses less hard drops some of the cubes


def test_a_pushed_cube_is_not_kicked_away() -> None:
    with made(IDS[0], num_envs=20) as env:
        expert, fastest = expert_of(env), 0.0
        env.reset(seed=0)
        for step in range(60):
            env.step(expert.act(None, np.full(20, step == 0)))
            fastest = max(fastest, env.task.speed.max())  # type: ignore[attr-defined]
        assert 0.2 < fastest < 0.6  # the tool moves at 0.25 m/s


def test_an_expert_acts_alike_alone_and_among_others() -> None:
    with made(LIFT, num_envs=3) as env, closing(gym.make(LIFT)) as alone:
        expert, single = expert_of(env), expert_of(alone.unwrapped)  # type: ignore[arg-type] # a batch of one
        env.reset(seed=5)
        alone.reset(seed=7)
        for step in range(40):
            action = expert.act(None, np.full(3, step == 0))
            one = single.act(None, np.array([step == 0]))
            assert np.array_equal(one[0], action[2])
            env.step(action)
            alone.step(one[0])


@pytest.mark.parametrize("task", ["Push", "Slide", "PegInsertion"])
def test_an_expert_acts_in_a_wrapped_environment(task: str) -> None:
    with closing(gym.make(f"frobs_core:frobs/Panda{task}-v0")) as env:
        expert = load_policy("expert", env)
        env.reset(seed=0)
        assert expert.act(np.zeros((1, 0)), np.ones(1, bool)).shape == (1, *env.action_space.shape)  # type: ignore[misc]


def test_an_expert_reports_its_phase() -> None:
    with made(LIFT, num_envs=2) as env:
        expert, phases = expert_of(env), []
        env.reset(seed=0)
        for step in range(60):
            env.step(expert.act(None, np.full(2, step == 0)))
            phases.append(expert.info()["phase"].tolist())
    assert phases[0] == [0, 0]
    assert min(phases[-1]) >= 2  # closes the gripper, or carries the cube


def test_an_expert_needs_a_controller_that_moves_the_tool() -> None:
    with (
        made(IDS[0], num_envs=1, controller="joint_delta_position", controller_kwargs={}) as env,
        pytest.raises(ConfigurationError, match="tcp_delta_pose"),
    ):
        expert_of(env)


def test_an_expert_knows_every_kind_of_gripper_controller() -> None:
    for gripper in ("gripper_position", "gripper_binary"):
        controllers = {"arm": "tcp_delta_pose", "gripper": gripper}
        kwargs = {"arm": {"max_delta": 0.02, "axes": ["x", "y", "z"]}}
        with made(LIFT, num_envs=8, controller=controllers, controller_kwargs=kwargs) as env:
            assert success_rate(env) == 1.0


class Lazy(Expert):
    """Does nothing."""

    def bind(self, env: Any) -> None:
        self._shape = env.action_space.shape

    def act(self, observation: Any, episode_start: Any) -> Any:
        return np.zeros((len(episode_start), self._shape[-1]))


def test_the_kit_finds_an_expert_that_always_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    (check,) = [each for each in check_env(LIFT) if each.name == "success_comes_and_goes"]
    check.run()
    monkeypatch.setattr("frobs_tasks_manipulation.lift.Lift.expert", f"{__name__}:Lazy")
    with pytest.raises(CheckFailure, match="does not succeed in any of 5 episodes"):
        check.run()
