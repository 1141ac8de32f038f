"""A policy that sees images alone."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from frobs_core.kernel.env import RobotEnv
from frobs_train import evaluate, resolve_config, train

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "pixels.md"


@pytest.mark.slow
def test_the_settings_of_the_documentation_train_on_images_alone(tmp_path):
    settings = re.search(r'```yaml file="pixels.yaml"\n(.*?)```', PAGE.read_text(encoding="utf-8"), re.DOTALL)
    file = tmp_path / "pixels.yaml"
    file.write_text(settings[1], encoding="utf-8")
    config = resolve_config(file=file, settings=["environment=frobs/Irb120Reach-v0", "seed=0", "steps=2048"])
    run = train(config, tmp_path / "run")
    assert evaluate(run, episodes=4).steps == 2048


@pytest.mark.needs("rendering")
def test_images_differ_with_the_goal_and_with_the_arm():
    eye = {"camera": "overview", "size": [84, 84], "markers": True}
    keywords = {"task": "reach", "robot": "irb120", "controller": "tcp_delta_position", "num_threads": 1}
    env = RobotEnv(**keywords, observations={"*": None, "eye": eye})
    images = [env.reset(seed=0, options={"goal": goal})[0]["eye"] for goal in ([0.4, 0.2, 0.3], [0.4, -0.2, 0.3])]
    for _ in range(10):
        moved = env.step(np.ones(3))[0]["eye"]
    assert (images[0] != images[1]).any(axis=-1).sum() > 20
    assert (images[1] != moved).any(axis=-1).sum() > 20
    env.close()
