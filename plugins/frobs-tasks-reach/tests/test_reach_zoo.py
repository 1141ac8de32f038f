"""The hyper-parameters for rl_zoo3, and the real one with them."""

from __future__ import annotations

import subprocess
import sys
from importlib import resources
from pathlib import Path
from typing import Any

import pytest
import yaml
from torch import nn

from frobs_train import resolve_config

ID = "frobs/Irb120Reach-v0"
FILE = Path(str(resources.files("frobs_tasks_reach").joinpath("zoo/ppo.yml")))


def test_they_are_those_that_were_tuned() -> None:
    theirs: dict[str, Any] = yaml.safe_load(FILE.read_text("utf-8"))[ID]
    ours = resolve_config(ID)
    assert theirs.pop("n_envs") == ours.num_envs
    assert theirs.pop("n_timesteps") == ours.steps
    assert theirs.pop("policy") == "MlpPolicy"
    policy = eval(theirs.pop("policy_kwargs"), {"nn": nn})  # as rl_zoo3 does
    tuned = ours.algorithm_config["policy_kwargs"]
    assert policy.pop("activation_fn").__name__.lower() == tuned["activation_fn"]
    assert policy == {key: tuned[key] for key in policy}
    assert theirs == {key: ours.algorithm_config[key] for key in theirs}
    defaults = resolve_config("CartPole-v1").algorithm_config
    scaling = {"policy_kwargs", "learning_rate"}
    left_out = {key for key, value in ours.algorithm_config.items() if value != defaults[key]} - set(theirs) - scaling
    assert not left_out, "tuned, and not in the file"


@pytest.mark.slow
def test_rl_zoo3_trains_with_them(tmp_path: Path) -> None:
    program = Path(sys.executable).with_name("rl_zoo3")
    command = [str(program)] if program.exists() else [sys.executable, "-m", "rl_zoo3.cli"]
    command += ["train", "--algo", "ppo", "--env", ID, "--gym-packages", "frobs_core", "--conf-file", str(FILE)]
    command += ["--n-timesteps", "5000", "--eval-freq", "-1", "--num-threads", "1", "--seed", "0"]
    done = subprocess.run(
        [*command, "--log-folder", "logs"], cwd=tmp_path, text=True, capture_output=True, timeout=300, check=False
    )
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    assert "total_timesteps      | 6144" in done.stdout  # whole iterations of 128 × 16
    assert (tmp_path / "logs" / "ppo" / "frobs-Irb120Reach-v0_1" / "frobs-Irb120Reach-v0.zip").is_file()
