from __future__ import annotations

import json
from collections.abc import Mapping
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from frobs_core.contracts import Policy
from frobs_core.util.errors import CheckpointError, ConfigurationError, RunError
from frobs_train import Run, evaluate, open_policy, resolve_config
from frobs_train.cli.evaluate import summary
from frobs_train.configuration.config import ThreadsConfig
from frobs_train.environments import make_vector_env
from frobs_train.evaluation.evaluate import usual_num_envs, wilson_interval
from frobs_train.evaluation.playing import EpisodeCounter as _Counter
from frobs_train.evaluation.playing import goal_reader, play_episodes
from frobs_train.logs.recorder import FinishedEpisodes
from frobs_train.training.threads import processors_limited_to


def test_an_evaluation_is_written_and_repeats(copied: Run) -> None:
    first, again = evaluate(copied, 30), evaluate(copied, 30)
    assert first == again
    assert first.episodes == 30
    assert first.mean_length == 10
    assert first.steps == 2000
    assert first.success_rate is not None
    assert first.success_rate > 0.8
    (path,) = (copied.path / "evaluations").iterdir()
    found = json.loads(path.read_text())
    assert {"success_rate", "success_interval", "mean_reward", "mean_length", "steps_to_success", "episodes"} <= set(
        found
    )
    assert copied.evaluations() == [found]


def test_an_evaluation_uses_no_more_processors_than_its_job_has(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[int] = []

    def make(environment: str, num_envs: int, kwargs: Mapping[str, Any], wrappers: object) -> None:
        made.append(kwargs["num_threads"])
        raise RunError("the threads are known.")

    monkeypatch.setattr("frobs_train.evaluation.evaluate.make_vector_env", make)
    monkeypatch.setattr("frobs_train.training.threads.os.cpu_count", lambda: 8)
    monkeypatch.setattr("frobs_train.training.threads.os.sched_getaffinity", lambda _: range(8), raising=False)
    run = open_policy("frobs/Irb120Reach-v0", "pretrained")
    with pytest.raises(RunError, match="known"), processors_limited_to(3):
        evaluate(run, 20)
    run.config = run.config.model_copy(update={"threads": ThreadsConfig(simulator=2)})
    with pytest.raises(RunError, match="known"):
        evaluate(run, 20)
    assert made == [3, 2]


def test_an_evaluation_of_sampled_actions_has_a_file_of_its_own(copied: Run) -> None:
    evaluate(copied, 3)
    evaluate(copied, 3, deterministic=False)
    assert sorted(found["deterministic"] for found in copied.evaluations()) == [False, True]


def test_another_seed_gives_other_episodes(copied: Run) -> None:
    assert evaluate(copied, 20).mean_reward != evaluate(copied, 20, seed=99).mean_reward


@pytest.mark.parametrize(("episodes", "num_envs"), [(1, None), (7, 3), (3, 8), (20, 20)])
def test_exactly_so_many_episodes_count(episodes: int, num_envs: int | None, copied: Run) -> None:
    assert evaluate(copied, episodes, num_envs=num_envs).episodes == episodes


def test_short_episodes_do_not_count_more() -> None:
    counter = _Counter(num_envs=2, episodes=4, goals=None)
    for length in (1, 1, 1, 1, 1):  # environment 0 plays five short ones
        counter.add(
            FinishedEpisodes(np.array([0]), np.array([0.0]), np.array([length]), np.array([0.0]), {}),
        )
    assert not counter.complete
    for _ in range(2):
        counter.add(FinishedEpisodes(np.array([1]), np.array([9.0]), np.array([9]), np.array([1.0]), {}))
    assert counter.complete
    assert counter.lengths == [1, 1, 9, 9]
    assert counter.successes == [0.0, 0.0, 1.0, 1.0]


def test_steps_to_success_count_until_success_stays() -> None:
    counter = _Counter(num_envs=3, episodes=4)  # two episodes of the first environment
    held = np.array([[0, 1, 0, 1], [0, 0, 1, 1], [1, 1, 1, 0]], float)  # (num_envs, steps) of the first episodes

    def finish(*env_ids: int, successes: list[float]) -> None:
        n = len(env_ids)
        counter.add(FinishedEpisodes(np.array(env_ids), np.zeros(n), np.full(n, 4), np.array(successes), {}))

    for step in range(3):
        counter.after_step({"is_success": held[:, step]})
    finish(0, 1, 2, successes=[1.0, 1.0, 0.0])
    counter.after_step({"is_success": held[:, 3]})
    assert counter.steps_to_success == [4, 3]
    counter.after_step({"is_success": np.ones(3)})
    finish(0, 1, successes=[1.0, 1.0])  # the episode of the second environment does not count
    counter.after_step({})
    assert counter.steps_to_success == [4, 3, 1]


def test_success_reported_only_at_the_end_takes_the_whole_episode() -> None:
    counter = _Counter(num_envs=1, episodes=1)
    for _ in range(9):
        counter.after_step({})
    counter.add(FinishedEpisodes(np.array([0]), np.zeros(1), np.array([10]), np.ones(1), {}))
    assert counter.steps_to_success == [10]


def test_the_simulator_of_the_training_is_not_another_one() -> None:
    run = open_policy("frobs/Irb120Reach-v0", "pretrained")
    assert evaluate(run, 2, simulator="mujoco") == evaluate(run, 2)


class OnlySuccess(gym.Wrapper[Any, Any, Any, Any]):
    """An environment that reports success, as NumPy's bool, only where there is one."""

    def step(self, action: Any) -> Any:
        *result, info = self.env.step(action)
        succeeded = np.bool_(info.pop("is_success") > 0.0)
        return (*result, {**info, "is_success": succeeded} if succeeded else info)


class Rest(Policy):
    def act(self, observation: Any, episode_start: Any) -> Any:
        return np.zeros((len(observation), 1), np.float32)


def test_an_episode_that_reports_no_success_has_failed() -> None:
    plain, silent = (
        play_episodes(
            SyncVectorEnv([partial(make, "FrobsTests/Line-v0")] * 2, autoreset_mode=AutoresetMode.SAME_STEP),
            Rest(),
            40,
            0,
        )
        for make in (gym.make, lambda id: OnlySuccess(gym.make(id)))
    )
    assert 0.0 < np.mean(plain.successes) < 0.5
    assert (silent.successes, silent.steps_to_success) == (plain.successes, plain.steps_to_success)


def test_an_expert_succeeds_within_its_episodes() -> None:
    found = evaluate(open_policy("frobs/PandaLift-v0", "expert"), 4)
    assert found.success_rate == 1.0
    assert found.steps_to_success is not None
    assert 5.0 < found.steps_to_success < found.mean_length - 5.0
    assert summary(found)["steps_to_success"] == f"{found.steps_to_success:.2f} on average in successful episodes"
    failed = evaluate(open_policy("frobs/PandaLift-v0", "random"), 4)
    assert failed.steps_to_success is None
    assert "steps_to_success" not in summary(failed)


def test_a_damaged_checkpoint_is_passed_over_aloud(copied: Run, caplog: pytest.LogCaptureFixture) -> None:
    (copied.path / "checkpoints" / "step_000002000" / "algorithm" / "policy.pt").write_bytes(b"x")
    assert evaluate(copied, 4).steps == 1600
    assert "step_000002000: algorithm/policy.pt is damaged" in caplog.text


def test_without_a_checkpoint_there_is_nothing_to_evaluate(copied: Run) -> None:
    for checkpoint in copied.checkpoints:
        (checkpoint.path / "checksums.json").unlink()
    with pytest.raises(CheckpointError, match="no usable checkpoint"):
        evaluate(copied, 4)


@pytest.mark.parametrize(("keyword", "value"), [("episodes", 0), ("num_envs", 0), ("seed", -1)])
def test_a_number_out_of_range_is_named(keyword: str, value: int, copied: Run) -> None:
    with pytest.raises(ConfigurationError, match=f"{keyword} is {value}; it must be a whole number of at least"):
        evaluate(copied, **{"episodes": 4, keyword: value})  # type: ignore[arg-type]


def test_other_spaces_than_those_of_the_training_are_refused(copied: Run) -> None:
    other = Run(copied.path, copied.config.model_copy(update={"environment": "CartPole-v1"}))
    with pytest.raises(RunError, match="trained with observation space"):
        evaluate(other, 4)


def test_goals_are_sorted_into_octants() -> None:
    env = make_vector_env("frobs/Irb120Reach-v0", 4, {})
    try:
        env.reset(seed=0)
        reader = goal_reader(env)
        assert reader is not None
        goals, middle = reader
        np.testing.assert_allclose(middle, [0.0, 0.0, 0.5])
        counter = _Counter(4, 4, reader)
        counter.begin()
        ids = np.arange(4)
        counter.add(FinishedEpisodes(ids, np.zeros(4), np.ones(4, int), np.array([0.0, 1.0, 1.0, 1.0]), {}))
        octants = counter.by_octant()
        assert octants is not None
        assert sum(item.episodes for item in octants.values()) == 4
        first = "".join(
            f"{'+' if above else '-'}{axis}" for axis, above in zip("xyz", goals()[0] > middle, strict=True)
        )
        assert octants[first].success_rate < 1.0
    finally:
        env.close()


def test_a_task_without_goals_has_no_octants() -> None:
    env = make_vector_env("CartPole-v1", 1, {})
    assert goal_reader(env) is None
    env.close()


@pytest.mark.parametrize(
    ("successes", "episodes", "low", "high"),
    [(0, 10, 0.0, 0.2775), (10, 10, 0.7225, 1.0), (95, 100, 0.8882, 0.9785), (500, 1000, 0.4691, 0.5309)],
)
def test_wilson_interval_is_that_of_the_tables(successes: int, episodes: int, low: float, high: float) -> None:
    np.testing.assert_allclose(wilson_interval(successes, episodes), (low, high), atol=5e-5)


@pytest.mark.parametrize("episodes", [1, 50, 250, 1000])
def test_wilson_interval_holds_what_was_seen(episodes: int) -> None:
    assert wilson_interval(episodes, episodes)[1] == 1.0
    assert wilson_interval(0, episodes)[0] == 0.0


def test_vectors_reset_in_the_same_step_whatever_the_id_has() -> None:
    for name in ("CartPole-v1", "Pendulum-v1", "frobs/Irb120Reach-v0"):
        env = make_vector_env(name, 2, {})
        assert env.metadata["autoreset_mode"] == gym.vector.AutoresetMode.SAME_STEP
        env.close()


def test_few_are_stepped_together_where_each_is_an_engine_of_its_own() -> None:
    config = resolve_config("frobs/Irb120Reach-v0")
    assert usual_num_envs(config, 1000) == 256
    assert usual_num_envs(config, 1000, "gazebo") == 16
    assert usual_num_envs(config, 1000, "pybullet") == 16
    assert usual_num_envs(config, 3, "gazebo") == 3
