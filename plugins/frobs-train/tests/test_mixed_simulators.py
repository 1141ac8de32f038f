"""Training on several simulators; that it resumes exactly is in test_resume.py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from frobs_core.util.errors import ParameterValueError
from frobs_train import RunConfig, evaluate, train
from frobs_train.cli.provider import TrainProvider
from frobs_train.cli.training_report import describe_training
from frobs_train.configuration.config import ComponentConfig
from frobs_train.environments import make_vector_env
from frobs_train.errors import ComponentError
from frobs_train.export.bundle_run import open_run_or_bundle
from frobs_train.export.export import export
from frobs_train.training.session import make_training_env, training_recipe

pytestmark = pytest.mark.needs("pybullet")

REACH = "frobs/Irb120Reach-v0"
NUM_ENVS = {"pybullet": 1, "mujoco": 2}
FAST = {"n_steps": 8, "batch_size": 16, "n_epochs": 1, "policy_kwargs": {"net_arch": [8]}}


def config(**changes: Any) -> RunConfig:
    values: dict[str, Any] = {"environment": REACH, "num_envs": NUM_ENVS, "steps": 48, "seed": 0}
    return RunConfig(**{**values, "algorithm_config": FAST, **changes})


def test_a_run_is_evaluated_and_described_on_its_first_simulator(tmp_path: Path) -> None:
    wanted = config(evaluate_every=48, evaluation_episodes=2)
    run = train(wanted, tmp_path / "run")
    here, named = evaluate(run, 3), evaluate(run, 3, simulator="pybullet")
    assert here.mean_reward == named.mean_reward != evaluate(run, 3, simulator="mujoco").mean_reward
    bundle = open_run_or_bundle(export(run).path)
    assert bundle.config.num_envs == NUM_ENVS
    assert evaluate(bundle, 3).mean_reward == pytest.approx(here.mean_reward)
    provider = TrainProvider()
    shown = provider.readable(provider.describe(str(run.path)))
    assert shown["simulator"] == "trained on 1 × pybullet, 2 × mujoco; evaluated on pybullet"
    assert "3 environments (1 on pybullet, 2 on mujoco)" in describe_training(wanted, "training", "run")


def test_wrappers_of_the_vector_environment_wrap_all_simulators() -> None:
    wrapper = ComponentConfig(name="gymnasium.wrappers.vector:NormalizeReward")
    env = make_training_env(config(wrappers=[wrapper]))
    assert env.reset(seed=0)[0].shape[0] == 3
    env.close()


@pytest.mark.parametrize(
    ("environment", "wrappers", "error", "message"),
    [
        ("CartPole-v1", [], ParameterValueError, "'CartPole-v1' is not an environment of FRobs"),
        (REACH, ["gymnasium.wrappers:ClipReward"], ComponentError, "several simulators do not support"),
    ],
)
def test_what_cannot_run_on_several_simulators_is_an_error(
    environment: str, wrappers: list[str], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        make_vector_env(environment, NUM_ENVS, {}, [ComponentConfig(name=name) for name in wrappers])


def test_other_processes_do_not_get_a_recipe_for_several_simulators() -> None:
    assert "several simulators" in training_recipe(config()).obstacle
    assert not training_recipe(config(num_envs=3)).obstacle
