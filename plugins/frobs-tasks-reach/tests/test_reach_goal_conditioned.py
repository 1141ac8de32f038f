from __future__ import annotations

import numpy as np
import pytest

GOAL = "frobs/Irb120ReachGoal-v0"


@pytest.mark.parametrize("reward_type", ["sparse", "dense"])
def test_compute_reward_of_what_was_observed_equals_the_reward_bit_for_bit(make, reward_type):
    env = make(GOAL, 32, reward_type=reward_type, tolerance=0.4)
    env.reset(seed=0)
    task, seen = env.unwrapped.task, set()
    for action in np.random.default_rng(0).uniform(-1, 1, (30, 32, 6)).astype(np.float32):
        observation, reward, _, _, info = env.step(action)
        achieved, desired = observation["achieved_goal"], observation["desired_goal"]
        assert achieved.dtype == np.float32
        again = task.compute_reward(achieved, desired, {})
        assert (again == reward).all()
        assert (task.compute_reward(np.asfortranarray(achieved), desired, None) == reward).all()
        assert task.compute_reward(achieved[3], desired[3], {}) == reward[3]
        if reward_type == "sparse":
            assert (info["is_success"] == reward + 1.0).all()
            seen |= set(reward.tolist())
    assert reward_type == "dense" or seen == {0.0, -1.0}


def test_compute_reward_takes_any_leading_shape(make):
    task = make(GOAL, reward_type="dense").unwrapped.task
    achieved, desired = np.zeros((4, 2, 3)), np.full((4, 2, 3), 1.0)
    np.testing.assert_allclose(task.compute_reward(achieved, desired, {}), np.full((4, 2), -np.sqrt(3.0)))


def test_observation_is_a_dictionary_that_keeps_the_goal_out_of_the_state(make):
    env = make(GOAL)
    first, _ = env.reset(seed=0, options={"goal": (0.3, 0.1, 0.4), "joint_positions": np.zeros(6)})
    second, _ = env.reset(seed=0, options={"goal": (0.3, -0.1, 0.4), "joint_positions": np.zeros(6)})
    assert {name: values.shape for name, values in first.items()} == {
        "observation": (15,),
        "achieved_goal": (3,),
        "desired_goal": (3,),
    }
    assert (first["observation"] == second["observation"]).all()
    assert (first["observation"][12:] == first["achieved_goal"]).all()
    assert first["desired_goal"][1] != second["desired_goal"][1]


def test_observation_tells_how_fast_the_joints_turn(make):
    env = make(GOAL)
    env.reset(seed=0)
    for action in (np.ones(6, np.float32), -np.ones(6, np.float32)):
        observation, *_ = env.step(action)
        seen = env.observation_space["observation"]
        turning = observation["observation"][6:12]
        assert np.abs(turning).min() > 0.01
        assert seen.contains(observation["observation"])
        np.testing.assert_array_equal(
            turning, env.unwrapped.simulation.robots["robot"].joint_velocities[0].astype(np.float32)
        )


def test_reaching_the_goal_does_not_terminate(make):
    env = make(GOAL)
    env.reset(seed=0, options={"joint_positions": np.zeros(6), "goal": (0.374, 0.0, 0.63)})
    _, reward, terminated, _, info = env.step(np.zeros(6, np.float32))
    assert (reward, terminated, info["is_success"]) == (0.0, False, 1.0)
