"""The command that makes a run anew."""

from __future__ import annotations

import json
import math
import shlex
from pathlib import Path

import pytest

from frobs_train import Run, RunConfig, resolve_config
from frobs_train.configuration.command import training_command

REACH = "frobs/Irb120Reach-v0"


@pytest.mark.parametrize(
    "words",
    [
        f"frobs train {REACH} --seed 3",
        f"frobs train {REACH} --controller tcp_delta_position --seed 0",
        f"frobs train {REACH} --algorithm sac --simulator pybullet --steps 5000 --seed 1",
        f"frobs train {REACH} --simulator mujoco --num-envs mujoco=3,pybullet=1 --seed 0",
        "frobs train CartPole-v1 --num-envs 4 --seed 2 --set algorithm_config.gamma=0.9 --set evaluate_every=500",
        f"frobs train {REACH} --seed 1 --set environment_kwargs.tolerance=0.02 --set 'wrappers=[]'",
        "frobs train CartPole-v1 --seed 2 --set algorithm_config.target_kl=.inf",
    ],
)
def test_the_command_resolves_to_the_configuration(words: str) -> None:
    config = resolve(words)
    command = training_command(config)
    assert command is not None
    assert resolve(command) == config
    assert len(command) <= len(words)


def test_infinite_settings_are_kept_by_a_run(tmp_path: Path) -> None:
    config = RunConfig(environment="X-v0", seed=0, environment_kwargs={"limits": [-math.inf, math.inf, 1.0]})
    Run.create(tmp_path / "run", config)
    assert Run.open(tmp_path / "run").config == config
    history = (tmp_path / "run/history.json").read_text()
    assert json.loads(history, parse_constant=pytest.fail)["config"]["environment_kwargs"] == {
        "limits": ["-.inf", ".inf", 1.0]
    }


def test_the_shortest_command_is_told() -> None:
    assert training_command(resolve(f"frobs train {REACH} --algorithm ppo --seed 0 --steps 400000")) == (
        f"frobs train {REACH} --seed 0"
    )


def test_a_configuration_that_lacks_what_is_tuned_has_no_command(tmp_path: Path) -> None:
    config = resolve(f"frobs train {REACH} --algorithm dqn --seed 0")
    assert training_command(config.model_copy(update={"environment_kwargs": {}})) is None
    assert training_command(config.model_copy(update={"algorithm": "absent"})) is None


def resolve(command: str) -> RunConfig:
    """Resolve what a command line says, as ``frobs train`` does."""
    words = shlex.split(command)
    assert words[:2] == ["frobs", "train"]
    flags: dict[str, object] = {}
    settings = []
    for flag, value in zip(words[3::2], words[4::2], strict=True):
        if flag == "--set":
            settings.append(value)
        else:
            number = flag in ("--seed", "--steps")
            flags[flag.removeprefix("--").replace("-", "_")] = int(value) if number else value
    return resolve_config(words[2], flags=flags, settings=settings)
