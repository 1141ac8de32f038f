"""The table of CONTRIBUTING.md names what exists, and each change that it shows does what the text says."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from pages import ROOT

TEXT = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
PATH = re.compile(r"`((?:frobs_core|plugins|docs|tests|templates|cookiecutter)/[\w./-]*)`")
PATCHES = re.findall(r"```diff\n(.*?)```", TEXT, re.DOTALL)

MAKE = "import gymnasium as gym; env = gym.make('frobs_core:frobs/Irb120Reach-v0', {}).unwrapped; env.reset(seed=0)\n"

HYPERPARAMETER = """
import gymnasium as gym
from frobs_algos_sb3.ppo import PPO
env = gym.make_vec("frobs_core:frobs/Irb120Reach-v0", num_envs=2)
config = PPO.resolve_config({"stats_window_size": 7, "n_steps": 8, "batch_size": 16})
algorithm = PPO(env, config, seed=0)
assert algorithm.model._stats_window_size == 7
try:
    PPO.resolve_config({"stats_window_size": 0})
except Exception as error:
    assert "stats_window_size" in str(error)
else:
    raise AssertionError("0 was accepted")
"""

CAMERA = (
    MAKE.format("render_mode='rgb_array', camera='wrist'")
    + """
first = env.render()
for _ in range(5):
    env.step(env.action_space.high)
assert first.std() > 0 and (env.render() != first).any()
"""
)

REWARD = (
    MAKE.format("speed_weight=0.5")
    + """
*_, info = env.step(env.action_space.high)
speed = -0.5 * float((env.robot.joint_velocities**2).sum())
assert speed < 0 and abs(info["frobs/reward/speed"] - speed) < 1e-12
assert "speed" in env.task.reward_meanings
"""
)


def test_the_table_names_existing_files() -> None:
    rows = [line for line in TEXT.splitlines() if line.startswith("| ")]
    paths = [path for row in rows for path in PATH.findall(row)]
    assert len(paths) > 40
    assert [path for path in paths if not (ROOT / path).exists()] == []


def test_the_table_names_every_distribution() -> None:
    assert [path.name for path in ROOT.glob("plugins/*") if path.is_dir() and f"plugins/{path.name}/" not in TEXT] == []


@pytest.mark.parametrize(
    ("number", "code"),
    [
        pytest.param(0, HYPERPARAMETER, id="hyperparameter"),
        pytest.param(1, CAMERA, id="camera", marks=pytest.mark.needs("rendering")),
        pytest.param(2, REWARD, id="reward"),
    ],
)
def test_a_change_that_the_guide_shows_does_what_it_says(number: int, code: str, tmp_path: Path) -> None:
    names = re.findall(r"^\+\+\+ b/(.+)$", PATCHES[number], re.MULTILINE)
    assert len(names) == 1
    source = Path(*Path(names[0]).parts[:3])  # plugins/NAME/src
    shutil.copytree(ROOT / source, tmp_path / source)
    applied = subprocess.run(
        ["git", "apply", "--recount", "-"], input=PATCHES[number], text=True, cwd=tmp_path, capture_output=True
    )
    assert applied.returncode == 0, applied.stderr
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / source)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, text=True, capture_output=True)
    assert done.returncode == 0, done.stderr


def test_the_guide_shows_three_changes() -> None:
    assert len(PATCHES) == 3
