from __future__ import annotations

import sys
from pathlib import Path

import gymnasium as gym
import pytest

sys.path.insert(0, str(Path(__file__).parent))

import images


@pytest.mark.needs("pybullet")
@pytest.mark.slow
def test_every_image_takes_time() -> None:
    env = gym.make_vec("frobs_core:frobs/Irb120Reach-v0", num_envs=2, simulator="pybullet").unwrapped
    env.reset(seed=0)
    wall, processor = images.measure(env, 1, fast=True)
    assert processor > 0.0
    assert wall > 0.0
    env.close()
