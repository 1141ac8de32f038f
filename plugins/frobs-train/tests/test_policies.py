"""Policies of run folders, bundles and IDs, opened by name or path."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_cli.errors import CommandLineError
from frobs_core import load_policy
from frobs_core.plugins.registry import pretrained_path
from frobs_core.util.errors import ModelMismatchError, RunError, UnknownParameterError
from frobs_deploy import BundleMismatchError
from frobs_train import PolicyRun, Run, evaluate, open_policy
from frobs_train.evaluation.evaluate import Evaluation
from frobs_train.runs.evaluation_files import is_as_trained
from frobs_train.runs.policy import TrainedPolicy, load_algorithm

REACH, LINE = "frobs/Irb120Reach-v0", "FrobsTests/Line-v0"
START = np.ones(2, bool)


@pytest.fixture
def line() -> Iterator[Any]:
    env = gym.make_vec(LINE, num_envs=2, vectorization_mode="sync")
    yield env
    env.close()


def test_a_run_folder_acts_as_its_algorithm(trained: Run, line: Any) -> None:
    observation, _ = line.reset(seed=0)
    algorithm, steps = load_algorithm(trained, line.single_observation_space, line.single_action_space)
    policy = load_policy(str(trained.path), line)
    assert isinstance(policy, TrainedPolicy)
    assert policy.steps == steps
    assert np.array_equal(policy.act(observation, START), algorithm.predict(observation)[0])
    earlier = load_policy(trained.path, line, checkpoint=1600)
    assert isinstance(earlier, TrainedPolicy)
    assert earlier.steps == 1600
    sampled = load_policy(trained.path, line, deterministic=False)
    assert not np.array_equal(sampled.act(observation, START), policy.act(observation, START))


def test_a_bundle_is_the_pretrained_policy_of_its_id() -> None:
    env = gym.make_vec(REACH, num_envs=2)
    observation, _ = env.reset(seed=0)
    actions = [load_policy(name, env).act(observation, START) for name in ("pretrained", pretrained_path(REACH))]
    assert np.array_equal(actions[0], actions[1])
    assert env.action_space.contains(actions[0])
    env.close()


def test_a_bundle_refuses_checkpoints_sampling_and_other_spaces(line: Any) -> None:
    env, path = gym.make(REACH), pretrained_path(REACH)
    for options, reason in (
        ({"checkpoint": "best"}, "only one policy"),
        ({"deterministic": False}, "cannot be sampled"),
    ):
        with pytest.raises(RunError, match=reason):
            load_policy(path, env, **options)
    with pytest.raises(CommandLineError, match="is not a model file"):
        load_policy(path, env, algorithm="ppo")
    with pytest.raises(BundleMismatchError, match="observation space differs"):
        load_policy(path, line)
    env.close()


def test_a_policy_opens_with_the_settings_of_its_training(trained: Run) -> None:
    run = open_policy(LINE, trained.path)
    assert run.config == trained.config
    with pytest.raises(ModelMismatchError, match=f"was trained with the ID '{LINE}'"):
        open_policy(REACH, trained.path)
    with pytest.raises(CommandLineError, match="stores its own settings"):
        open_policy(LINE, trained.path, settings=["seed=1"])


def test_a_trained_policy_takes_only_settings_of_the_simulator(copied: Run) -> None:
    assert evaluate(open_policy(copied.path), 2).simulator_kwargs is None
    run = open_policy(copied.path, settings=["environment_kwargs.simulator_kwargs.iterations=50"])
    assert run.config.environment_kwargs == {"simulator_kwargs": {"iterations": 50}}
    assert copied.config.environment_kwargs == {}
    run.config = copied.config  # this environment has no simulator
    assert evaluate(run, 2).simulator_kwargs == {"iterations": 50}
    assert sorted(is_as_trained(result) for result in copied.evaluations()) == [False, True]
    with pytest.raises(CommandLineError, match=r"only environment_kwargs\.simulator_kwargs can be set"):
        open_policy(copied.path, settings=["environment_kwargs.width=2.0"])


def test_a_policy_without_training_takes_settings_and_writes_no_result(
    tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run = open_policy(LINE, "random", settings=["seed=4", "environment_kwargs.width=2.0"])
    assert isinstance(run, PolicyRun)
    assert (run.config.seed, run.config.environment_kwargs) == (4, {"width": 2.0})
    first, again = (evaluate(run, 6) for _ in range(2))
    assert isinstance(first, Evaluation)
    assert first == again
    assert (first.steps, first.success_rate is not None) == (0, True)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(UnknownParameterError, match="policy 'random' has no parameter 'deterministic'"):
        evaluate(run, 2, deterministic=False)
