"""Environment runners in other processes, and the episodes that they report."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from ray.rllib.core.columns import Columns
from rllib_fixtures import REACH

from frobs_ray.errors import ClusterSizeError, EnvironmentCopyError, EnvironmentRunnerError
from frobs_ray.rllib.env_runner import recipe_of
from frobs_ray.rllib.fragments import Step, fragments
from frobs_train import Progress, TrainingInterrupt, resolve_config, resume, train
from frobs_train.configuration.config import ComponentConfig
from frobs_train.environments import EnvironmentRecipe, make_vector_env
from frobs_train.logs.progress import STEPS, read_progress


def test_steps_are_cut_into_episodes_with_their_final_observations() -> None:
    steps = [
        Step(
            {Columns.ACTIONS: np.array([step, -step])},
            np.array([[100.0 if ended else step + 1.0], [11.0 + step]], np.float32),
            np.array([1.0 + step, 0.0]),
            np.array([diverged, False]),
            np.array([ended, False]),
            {0: np.array([50.0 + step], np.float32)} if ended else {},
        )
        for step, (ended, diverged) in enumerate([(False, False), (True, False), (True, True)])
    ]
    first, second, other = fragments(np.array([[0.0], [10.0]], np.float32), steps)
    assert first.get_observations().ravel().tolist() == [0.0, 1.0, 51.0]
    assert (first.is_terminated, first.is_truncated) == (False, True)
    assert first.get_rewards().tolist() == [1.0, 2.0]
    assert second.get_observations().ravel().tolist() == [100.0, 52.0]
    assert (second.is_terminated, second.is_truncated) == (True, False)
    assert other.get_observations().ravel().tolist() == [10.0, 11.0, 12.0, 13.0]
    assert not other.is_done
    assert other.get_actions().tolist() == [0, -1, -2]


@pytest.mark.slow
@pytest.mark.usefixtures("cluster")
@pytest.mark.parametrize("name", ["rllib_ppo", "rllib_sac", "rllib_appo"])
def test_the_monitor_gets_every_episode_of_remote_environments(name: str, make: Any, monitor: Any) -> None:
    algorithm = make(name, {"num_env_runners": 2, "n_steps": 25} if name != "rllib_sac" else {"num_env_runners": 2})
    algorithm.train(800, monitor)
    assert algorithm.env.steps == 0  # that of this process is not used
    episodes = sum(len(item["rewards"]) for item in monitor.episodes)
    lengths = np.concatenate([item["lengths"] for item in monitor.episodes])
    assert lengths.max() <= 50
    # What is missing are the running episodes: at most one for each of four environments.
    assert algorithm.steps - 4 * 50 <= lengths.sum() <= algorithm.steps
    assert episodes >= 8
    assert all(set(item["terms"]) == {"distance", "precision"} for item in monitor.episodes)
    rewards = np.concatenate([item["rewards"] for item in monitor.episodes])
    sums = sum(np.concatenate([item["terms"][term] for item in monitor.episodes]) for term in ("distance", "precision"))
    np.testing.assert_allclose(rewards, sums, rtol=1e-5)
    assert len(set(rewards.round(6))) == episodes  # the runners have seeds of their own


@pytest.mark.slow
@pytest.mark.usefixtures("cluster")
def test_a_run_logs_remote_episodes_and_says_that_it_does_not_resume_exactly(tmp_path: Path, caplog: Any) -> None:
    config = resolve_config(
        REACH,
        flags={"algorithm": "rllib_ppo", "num_envs": 4, "steps": 800, "seed": 1},
        settings=["algorithm_config.num_env_runners=2", "algorithm_config.n_steps=50", "log_every=200"],
    )
    seen: list[Progress] = []

    def interrupt(progress: Progress) -> None:
        seen.append(progress)
        if progress.steps == 400:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(TrainingInterrupt):
        train(config, tmp_path / "run", on_progress=interrupt)
    assert [progress.steps for progress in seen] == [200, 400]
    assert seen[-1].length == 50
    assert seen[-1].reward is not None
    run = resume(tmp_path / "run")
    log = read_progress(run.path / "progress.csv")
    assert log[STEPS][-1] == 800
    assert sum(log["episode/count"]) == 16
    assert np.isfinite(log["reward/distance"]).all()
    assert "may differ from an uninterrupted run: the algorithm rllib_ppo does not save its episodes" in caplog.text


@pytest.mark.slow
@pytest.mark.usefixtures("cluster")
def test_a_cluster_without_enough_processors_is_an_error(make: Any, monitor: Any) -> None:
    with pytest.raises(ClusterSizeError, match="is 4, but the Ray cluster has only 2 CPUs"):
        make("rllib_ppo", {"num_env_runners": 4}).train(64, monitor)


@pytest.mark.slow
@pytest.mark.usefixtures("cluster")
def test_an_environment_that_cannot_be_made_elsewhere_is_an_error(make: Any, monitor: Any) -> None:
    algorithm = make("rllib_ppo", {"num_env_runners": 1})
    algorithm.env.recipe = EnvironmentRecipe(REACH, {"no_such_keyword": 1})
    with pytest.raises(EnvironmentRunnerError, match="no_such_keyword"):
        algorithm.train(64, monitor)


@pytest.mark.parametrize(
    ("recipe", "message"),
    [
        (EnvironmentRecipe(REACH, {}, obstacle="reset_from sets"), "reset_from sets"),
        (
            EnvironmentRecipe(REACH, {}, (ComponentConfig(name="gymnasium.wrappers.vector:NormalizeObservation"),)),
            "NormalizeObservation uses statistics",
        ),
    ],
)
def test_what_would_be_lost_is_an_error(recipe: EnvironmentRecipe, message: str, make: Any) -> None:
    env = make.env()
    env.recipe = recipe
    with pytest.raises(EnvironmentCopyError, match=f"{message}.*num_env_runners to 0"):
        recipe_of(env)


def test_an_environment_without_a_run_is_an_error() -> None:
    env = make_vector_env("Pendulum-v1", 1, {})
    with pytest.raises(EnvironmentCopyError, match="no training run made the environment"):
        recipe_of(env)
    env.close()


def test_wrappers_of_a_run_are_carried_over() -> None:
    component = ComponentConfig(name="gymnasium.wrappers.vector:ClipAction")
    env = EnvironmentRecipe(REACH, {}, (component,)).make(2, 1)
    assert isinstance(env, gym.wrappers.vector.ClipAction)
    env.close()
