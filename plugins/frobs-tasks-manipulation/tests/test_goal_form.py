"""The goal-conditioned tasks: spaces, goals, rewards, success and hindsight replay."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_tasks_manipulation.goal_form import GoalForm

IDS = [f"frobs_core:frobs/{arm}{task}Goal-v0" for arm in ("Panda", "Ur5") for task in ("Push", "PickAndPlace")]
PUSH, PICK_AND_PLACE = IDS[:2]


def vector(id: str, num_envs: int, **keywords: Any) -> RobotVectorEnv:
    env = gym.make_vec(id, num_envs=num_envs, **keywords).unwrapped
    assert isinstance(env, RobotVectorEnv)
    env.reset(seed=0)
    return env


def move_cubes(env: RobotVectorEnv, offset: np.ndarray[Any, Any]) -> tuple[Any, ...]:
    """Put each cube at an offset (num_envs, 3) [m] from its goal, and step without motion."""
    env.simulation.bodies["cube"].write_pose(env.task.goal + offset)  # type: ignore[attr-defined]
    return env.step(np.zeros((env.num_envs, 4)))


@pytest.mark.parametrize("id", IDS)
def test_the_observation_is_that_of_a_goal_environment(id: str) -> None:
    with closing(gym.make(id)) as env:
        observation, _ = env.reset(seed=0)
        assert env.observation_space.contains(observation)
        assert {name: values.shape for name, values in observation.items()} == {
            "observation": (28,),
            "achieved_goal": (3,),
            "desired_goal": (3,),
        }
        task: Any = env.unwrapped.task  # type: ignore[attr-defined]
        assert np.array_equal(observation["achieved_goal"], task.cube.pos[0].astype(np.float32))
        assert np.array_equal(observation["desired_goal"], task.goal[0].astype(np.float32))


@pytest.mark.parametrize("id", [PUSH, PICK_AND_PLACE])
def test_only_the_desired_goal_depends_on_the_goal(id: str) -> None:
    with closing(gym.make(id)) as env:
        first, _ = env.reset(seed=0, options={"goal": (0.5, 0.1, 0.02)})
        second, _ = env.reset(seed=0, options={"goal": (0.4, -0.1, 0.02)})
        assert not np.array_equal(first["desired_goal"], second["desired_goal"])
        assert np.array_equal(first["observation"], second["observation"])
        assert np.array_equal(first["achieved_goal"], second["achieved_goal"])


@pytest.mark.parametrize("id", [PUSH, PICK_AND_PLACE])
@pytest.mark.parametrize("reward_type", ["sparse", "dense"])
def test_compute_reward_of_observed_goals_equals_the_reward_bit_for_bit(id: str, reward_type: str) -> None:
    with closing(vector(id, 32, reward_type=reward_type, hold_steps=1)) as env:
        task: Any = env.task
        rng = np.random.default_rng(0)
        found = set()
        for step in range(20):
            # Some cubes are near the goal, some far, and one beyond the bounds of the observation.
            offset = rng.uniform(-0.06, 0.06, (32, 3)) * [1.0, 1.0, 0.0]
            offset[0] = [5.0, 0.0, 0.0]
            observation, reward, *_, info = (
                move_cubes(env, offset) if step % 2 else env.step(rng.uniform(-1, 1, (32, 4)))
            )
            achieved, desired = observation["achieved_goal"], observation["desired_goal"]
            assert np.array_equal(task.compute_reward(achieved, desired, {}), reward)
            assert np.array_equal(task.compute_reward(np.asfortranarray(achieved), desired, None), reward)
            assert task.compute_reward(achieved[3], desired[3], {}) == reward[3]
            reached = np.linalg.norm(achieved.astype(float) - desired, axis=1) <= task.tolerance
            assert np.array_equal(info["is_success"], reached)
            if reward_type == "sparse":
                assert np.array_equal(reward, np.where(reached, 0.0, -1.0))
            found |= set(reached.tolist())
        assert found == {True, False}


def test_success_must_hold_but_the_speed_does_not_count() -> None:
    with closing(vector(PUSH, 1, hold_steps=3, max_speed=1e-9)) as env:
        successes = [bool(move_cubes(env, np.zeros((1, 3)))[-1]["is_success"][0]) for _ in range(4)]
        assert successes == [False, False, True, True]
        assert not move_cubes(env, np.array([[0.06, 0.0, 0.0]]))[-1]["is_success"][0]


def test_goals_are_drawn_anywhere_in_the_area_of_the_cube() -> None:
    with closing(vector(PUSH, 1000)) as env:
        task: Any = env.task
        assert np.abs(task.goal[:, :2] - [0.5, 0.0]).max() <= 0.15
        apart = np.linalg.norm(task.goal - task.cube.pos, axis=1)
        assert 0.05 < (apart <= task.tolerance).mean() < 0.12  # π · (5 cm)² / (30 cm)² = 0.09, less at the edges


def test_three_of_ten_goals_of_pick_and_place_are_on_the_floor() -> None:
    with closing(vector(PICK_AND_PLACE, 1000)) as env:
        heights = env.task.goal[:, 2] - 0.02  # type: ignore[attr-defined]
        assert (heights > 1e-9).mean() == pytest.approx(0.7, abs=0.05)
        assert 0.18 < heights.max() <= 0.2


@pytest.mark.needs("frobs_train")
@pytest.mark.slow
@pytest.mark.parametrize("id", [PUSH, PICK_AND_PLACE])
def test_sac_trains_with_hindsight_replay(id: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import frobs_train

    relabeled = 0
    compute_reward = GoalForm.compute_reward

    def counted(task: GoalForm, achieved_goal: Any, desired_goal: Any, info: Any) -> Any:
        nonlocal relabeled
        relabeled += len(achieved_goal)
        return compute_reward(task, achieved_goal, desired_goal, info)

    monkeypatch.setattr(GoalForm, "compute_reward", counted)
    settings = ["algorithm_config.learning_starts=210", "algorithm_config.policy_kwargs.net_arch=[16]"]
    flags = {"algorithm": "sac", "num_envs": 2, "steps": 400, "seed": 0}
    config = frobs_train.resolve_config(id.partition(":")[2], flags=flags, settings=settings)
    run = frobs_train.train(config, tmp_path / "run")
    assert run.newest_checkpoint()
    assert relabeled > 1000, "no goal was relabeled: the replay buffer is not that of hindsight replay"
