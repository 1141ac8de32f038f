from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import stable_baselines3 as sb3
import stock_models
from typer.testing import CliRunner, Result

from frobs_algos_sb3.model_files.policy import open_policy
from frobs_cli.program import program
from frobs_core.util.errors import ConfigurationError, RunError
from frobs_train import ModelFile, evaluate

REACH = "frobs/Irb120Reach-v0"


@pytest.fixture(scope="module")
def reach(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model of stable-baselines3 that was trained on a robot without us."""
    path = tmp_path_factory.mktemp("models") / "reach.zip"
    sb3.SAC("MlpPolicy", f"frobs_core:{REACH}", policy_kwargs={"net_arch": [8]}, **stock_models.SMALL).save(path)
    return path


def frobs(*args: object) -> Result:
    return CliRunner().invoke(program(), [str(arg) for arg in args], prog_name="frobs", catch_exceptions=False)


def test_a_model_file_is_evaluated_without_a_run(reach: Path) -> None:
    before = list(reach.parent.iterdir())
    result = frobs("evaluate", REACH, "--model", reach, "--episodes", 4, "--json")
    assert result.exit_code == 0, result.stderr
    found = json.loads(result.stdout)
    assert (found["episodes"], found["environment"], found["model"]) == (4, REACH, str(reach))
    assert list(reach.parent.iterdir()) == before
    same = evaluate(ModelFile(reach, REACH, "sac", ["seed=0"]), 4)
    assert same.mean_reward == pytest.approx(found["mean_reward"])


def test_the_environment_is_made_as_the_settings_say(reach: Path) -> None:
    result = frobs("evaluate", REACH, "--model", reach, "--set", "environment_kwargs.controller=tcp_delta_position")
    assert result.exit_code == 2
    assert "was trained with action_space" in result.stderr
    assert "--set environment_kwargs.controller" in result.stderr


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["--trust"], "--trust: this option requires --model FILE"),
        (["--algorithm", "ppo"], "--algorithm: this option requires --model FILE"),
        (["--model", "nothing.zip"], "nothing.zip does not exist"),
        (["--model", "model.onnx"], "model files with these suffixes: .zip"),
        (["--model", "nothing.zip", "--algorithm", "poo"], "Did you mean 'ppo'"),
        (["--model", "nothing.zip", "--set", "stepz=3"], "Did you mean 'steps'"),
    ],
)
def test_mistakes_are_told_in_one_line(args: list[str], message: str) -> None:
    result = frobs("evaluate", "CartPole-v1", *args)
    assert result.exit_code == 2
    assert message in result.stderr


def test_what_needs_trust_says_so_and_opens_with_it(tmp_path: Path) -> None:
    class Policy(sb3.ppo.MlpPolicy):
        """Not the library's."""

    path = tmp_path / "custom.zip"
    sb3.PPO(Policy, "CartPole-v1", n_steps=64).save(path)
    refused = frobs("evaluate", "CartPole-v1", "--model", path, "--episodes", 1)
    assert refused.exit_code == 2
    assert "'policy_class' is stored as a pickle, which can execute code when it is opened" in refused.stderr
    assert "--trust" in refused.stderr
    assert frobs("evaluate", "CartPole-v1", "--model", path, "--episodes", 1, "--trust").exit_code == 0


def test_bounds_are_the_environment_s_own(tmp_path: Path) -> None:
    path = stock_models.write("td3-pictures", tmp_path)
    env = stock_models.Pictures()
    policy, steps = open_policy(path, env.observation_space, env.action_space)
    assert steps == 0
    assert policy.model.policy.action_space is env.action_space
    observation = {key: value[None] for key, value in env.observation_space.sample().items()}
    stock = sb3.TD3.load(path).predict(observation, deterministic=True)[0]
    np.testing.assert_array_equal(policy.predict(observation)[0], stock)


def test_pictures_may_have_their_channels_last(tmp_path: Path) -> None:
    path = stock_models.write("ppo-image", tmp_path)
    env = stock_models.image()
    policy, _ = open_policy(path, env.observation_space, env.action_space)
    assert policy.predict(env.observation_space.sample()[None])[0].shape == (1,)
    with pytest.raises(RunError, match="trained with action_space"):
        open_policy(path, env.observation_space, gym.spaces.Discrete(3))


def test_an_algorithm_that_reads_no_files_says_so(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"algorithm 'ppo' reads only model files with these suffixes: \.zip"):
        ModelFile(tmp_path / "model.pt", "CartPole-v1", "ppo")


def test_a_model_file_plays(reach: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[Any] = []
    monkeypatch.setattr("frobs_train.evaluation.view.view", lambda run, **kwargs: opened.append(run))
    assert frobs("play", REACH, "--model", reach).exit_code == 0
    assert isinstance(opened[0], ModelFile)
