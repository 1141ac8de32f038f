"""Several arms that reach at the same time."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from frobs_core.kernel.env import RobotEnv
from frobs_core.util.errors import ParameterValueError
from frobs_devkit.testing import check_env, pytest_checks

LEFT = {"robot": "irb120", "controller": "joint_delta_position", "pose": {"pos": [0.0, 0.8, 0.0]}}
RIGHT = {"robot": "ur5", "controller": "tcp_delta_position", "pose": {"pos": [0.0, -0.8, 0.0]}}
KEYWORDS: dict[str, Any] = {"task": "reach_together", "robots": {"left": LEFT, "right": RIGHT}}

test_the_kit_finds_no_fault = pytest.mark.slow(
    pytest_checks(check_env("frobs/Env-v0", **KEYWORDS, max_episode_steps=50))
)


@pytest.mark.parametrize("simulator", ["mujoco", "pybullet"])
def test_each_arm_reaches_as_it_would_alone(simulator: str) -> None:
    env = RobotEnv(**KEYWORDS, simulator=simulator)
    env.reset(seed=0)
    goal = env.task.parts["left"].goal[0].tolist()
    alone = RobotEnv(task="reach", robots={"robot": LEFT}, simulator=simulator)
    alone.reset(seed=0, options={"goal": goal})
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (20, env.action_space.shape[0]))
    for action in actions:
        observation, reward, _, _, info = env.step(action)
        expected = alone.step(action[:6])[0]
        assert observation[: len(expected)] == pytest.approx(expected, abs=1e-5)
        terms = [
            info[f"frobs/reward/{name}/{term}"] for name in ("left", "right") for term in ("distance", "precision")
        ]
        assert reward == pytest.approx(sum(terms))
    assert not np.allclose(env.task.parts["right"].goal, goal)
    env.close()
    alone.close()


def test_success_is_that_of_all_arms() -> None:
    env = RobotEnv(**KEYWORDS, tolerance=0.2)
    env.reset(seed=0)
    for near in ([], ["left"], ["right"], ["left", "right"]):
        for name, part in env.task.parts.items():
            part.goal[:] = env.simulation.robots[name].frame_pose("tcp")[0] + (0.0 if name in near else 1.0)
        assert env.step(np.zeros(9))[4]["is_success"] == (len(near) == 2)
    env.close()


def test_a_wrong_value_names_the_keyword() -> None:
    with pytest.raises(ParameterValueError, match="tolerance"):
        RobotEnv(**KEYWORDS, tolerance=-1.0)
