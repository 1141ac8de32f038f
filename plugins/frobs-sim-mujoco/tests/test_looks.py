"""Looks of MuJoCo's models, which can be changed without drawing."""

from __future__ import annotations

import subprocess
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.util.errors import ConfigurationError, RenderingUnavailableError
from frobs_sim_mujoco import rendering
from frobs_sim_mujoco.geoms import VISUAL_GROUP


def test_too_many_distractors_are_rejected_with_the_exact_limit() -> None:
    env: Any = gym.make("frobs_core:frobs/PandaPickAndPlace-v0", randomize={"distractors": {"set": [0, 8.9]}}).unwrapped
    with pytest.raises(ConfigurationError, match=r"^distractors must be in \[0, 8\.999999\]"):
        env.simulation.write_parameter("distractors", "", np.full(1, 9.0))
    env.close()


def test_the_color_of_a_link_is_that_of_its_first_drawn_shape() -> None:
    env: Any = gym.make("frobs_core:frobs/Irb120Reach-v0").unwrapped
    sim = env.simulation
    np.testing.assert_allclose(sim.parameter("color", "robot/link_1"), [[0.96, 0.42, 0.08]], atol=1e-6)
    sim.write_parameter("color", "robot/link_1", np.array([[0.1, 0.2, 0.9]]))
    drawn = sim._drawn()
    drawn.show(0)
    model = drawn.model
    link = model.geom_rgba[(model.geom_bodyid == model.body("robot/link_1").id) & (model.geom_group == VISUAL_GROUP)]
    np.testing.assert_allclose(link[:, :3], np.tile([0.1, 0.2, 0.9], (3, 1)), atol=1e-6)
    env.close()


def test_a_driver_that_hangs_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def hang(command: Any, timeout: float, **_: Any) -> None:
        raise subprocess.TimeoutExpired(command, timeout)

    monkeypatch.setattr(subprocess, "run", hang)
    with pytest.raises(RenderingUnavailableError, match="OpenGL"):
        rendering._choose_backend.__wrapped__()
