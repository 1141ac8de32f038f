"""Packages of FRobs_RL run unmodified: a real ROS master, real nodes, and behind the names of Gazebo the bridge, over MuJoCo
and over a real Gazebo."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

HERE = Path(__file__).parent
EXAMPLES = HERE.parent / "examples"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["old_gym_package", "gymnasium_package"])
def test_an_old_package_spawns_trains_saves_loads_and_predicts(name, backend, run_package, tmp_path):
    run = run_package(HERE / name, backend)
    trained = run("train.py")
    assert re.search(r"total_timesteps \| 60", trained)
    folder = tmp_path / name
    assert {path.name for path in (folder / "models" / "td3").glob("*.zip")} == {
        "td3_model_30_steps.zip",
        "td3_model_60_steps.zip",
        "trained_model.zip",
    }
    assert (folder / "logs" / "td3" / "TD3_1" / "progress.csv").is_file()
    assert "Episode: 2 success" in run("predict.py")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["abb_irb120_reacher", "kobuki_maze_rl"])
def test_the_examples_train_for_a_short_while(name, backend, run_package, tmp_path):
    run = run_package(EXAMPLES / name, backend)
    config = tmp_path / name / "config"
    text = (config / "td3.yaml").read_text()
    for key, value in (("training_steps", 60), ("learning_starts", 20), ("save_freq", 60), ("batch_size", 16)):
        text = re.sub(rf"{key}: \d+", f"{key}: {value}", text)
    (config / "short.yaml").write_text(text)
    run("train.py", "short.yaml")
    assert (tmp_path / name / "models" / "td3" / "trained_model.zip").is_file()
