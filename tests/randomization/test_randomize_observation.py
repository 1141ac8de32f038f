from __future__ import annotations

import numpy as np
import pytest

from frobs_core.util.errors import ConfigurationError, UnknownNameError

JOINTS = slice(0, 6)


def observe(env, steps=30, seed=0):
    """Return (steps + 1, num_envs, k) observations, and what they should be."""
    observation, _ = env.reset(seed=seed)
    seen, true = [observation], [env.observations.observe()]
    for _ in range(steps):
        seen.append(env.step(np.full((env.num_envs, 6), 0.2))[0])
        true.append(env.observations.observe())
    return np.array(seen, np.float64), np.array(true, np.float64)


def test_noise_is_added_to_its_term_and_to_no_other(make):
    env = make(8, {"observation_noise": {"joint_positions": {"normal": 0.005}}})
    seen, true = observe(env)
    error = (seen - true)[:, :, JOINTS]
    assert error.std() == pytest.approx(0.005, rel=0.1)
    assert abs(error.mean()) < 5e-4
    assert len(np.unique(error.round(9))) > 0.9 * error.size  # another one for each number, environment and step
    assert (seen[:, :, 6:] == true[:, :, 6:]).all()
    assert "observation_noise" not in "".join(env.randomization.values)


def test_an_offset_holds_for_an_episode_and_is_told(make):
    env = make(3, {"observation_noise": {"tcp_position": {"uniform": [-0.02, 0.02], "when": "reset"}}})
    seen, true = observe(env, 5)
    offset = (seen - true)[:, :, 6:9]
    assert offset == pytest.approx(np.broadcast_to(offset[0], offset.shape), abs=1e-6)
    assert abs(offset).max() > 1e-3
    (told,) = env.randomization.values.values()
    assert told == pytest.approx(offset[0], abs=1e-6)


def test_the_reward_is_that_of_the_truth(make, actions):
    noisy = make(2, {"observation_noise": {"*": {"normal": 0.1}}, "observation_delay": {"steps": 2}})
    true = make(2)
    for env in (noisy, true):
        env.reset(seed=0)
    for action in actions(5, 2):
        (a, reward, *_, info), (b, expected, *_, told) = noisy.step(action), true.step(action)
        assert (a != b).any()
        assert (reward == expected).all()
        assert (info["is_success"] == told["is_success"]).all()


def test_noise_stays_inside_the_observation_space(make):
    env = make(2, {"observation_noise": {"*": {"normal": 3.0}}})
    seen, _ = observe(env, 5)
    assert all(env.observation_space.contains(each.astype(np.float32)) for each in seen)
    assert (seen[:, :, 0] == env.single_observation_space.high[0]).any()


def test_observations_are_late_by_whole_steps(make):
    env = make(4, {"observation_delay": {"steps": [0, 3]}})
    seen, true = observe(env, 8)
    delays = env.randomization.values["observation_delay"].astype(int)
    assert len(set(delays.tolist())) > 1
    for i, delay in enumerate(delays):
        expected = np.concatenate([np.repeat(true[:1, i], delay, axis=0), true[: 9 - delay, i]])
        assert (seen[:, i] == expected).all()


def test_terms_can_be_late_by_themselves(make):
    env = make(1, {"observation_delay": [{"steps": 2, "target": "tcp_position"}]})
    seen, true = observe(env, 8)
    assert (seen[2:, :, 6:9] == true[:-2, :, 6:9]).all()
    assert (seen[:, :, :6] == true[:, :, :6]).all()


def test_a_late_observation_is_what_was_measured_then(make):
    """Noise belongs to the measurement: seen again, it is the same."""
    settings = {"observation_noise": {"joint_positions": {"normal": 0.01}}}
    fresh, _ = observe(make(2, settings), 8)
    late, _ = observe(make(2, {**settings, "observation_delay": {"steps": 2}}), 8)
    assert (late[2:] == fresh[:-2]).all()


def test_goals_of_a_dictionary_are_terms_too(make):
    env = make(
        2, {"observation_noise": {"achieved_goal": {"normal": 0.01}, "tcp*": {"normal": 0.01}}}, task="reach_goal"
    )
    seen, _ = env.reset(seed=0)
    true = env.observations.observe()
    assert (seen["achieved_goal"] != true["achieved_goal"]).all()
    assert (seen["desired_goal"] == true["desired_goal"]).all()
    assert (seen["observation"][:, :12] == true["observation"][:, :12]).all()
    assert (seen["observation"][:, 12:] != true["observation"][:, 12:]).all()
    assert env.randomization.observed_keys == {"achieved_goal", "observation"}


def test_a_term_that_is_not_there_is_named(make):
    with pytest.raises(UnknownNameError, match="no observation term of randomize"):
        make(1, {"observation_noise": {"joint_position": {"normal": 1}}})
    with pytest.raises(UnknownNameError, match="Did you mean 'tcp_position'"):
        make(1, {"observation_delay": {"steps": 1, "target": "tcp_positions"}})
    with pytest.raises(ConfigurationError, match="the setting has 5 numbers for 6 columns"):
        make(1, {"observation_noise": {"joint_positions": {"normal": [0.1] * 5}}})


def test_a_reset_of_others_draws_nothing_anew(make):
    """Also where the noise of an environment would be another one if its observation were made again."""
    everything = {"observation_noise": {"*": {"normal": 0.01}}, "observation_delay": {"steps": [0, 2], "every": 2}}
    env = make(3, everything, autoreset_mode="Disabled")
    env.reset(seed=0)
    before = env.step(np.zeros((3, 6)))[0]
    after, _ = env.reset(options={"reset_mask": np.array([False, True, False])})
    assert (after[[0, 2]] == before[[0, 2]]).all()
    assert (after[1] != before[1]).any()
