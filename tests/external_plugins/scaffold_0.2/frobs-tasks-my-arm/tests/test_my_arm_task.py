"""Tests of the task: the conformance checks and your own tests."""

import gymnasium as gym

from frobs_devkit.testing import check_env, check_plugin, check_task, pytest_checks

ID = "frobs_core:acme/MyArmReach-v0"

test_plugin = pytest_checks(check_plugin("tasks_my_arm"))
test_environment = pytest_checks(check_env(ID))
test_task = pytest_checks(check_task("my_arm_reach"))


def test_the_goal_can_be_set() -> None:
    env = gym.make(ID)
    env.reset(seed=0, options={"goal": [0.3, 0.2, 0.4]})
    _, reward, _, _, info = env.step(env.action_space.sample())
    assert info["is_success"] in (0.0, 1.0)
    assert sum(value for key, value in info.items() if key.startswith("frobs/reward/")) == reward
    env.close()
