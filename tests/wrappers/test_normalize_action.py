import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from frobs_core.util.errors import ConfigurationError, InvalidActionError
from frobs_rl_compat.wrappers import NormalizeActionWrapper


class Box(gym.Env):
    """Takes actions of some Box and shows them in its info."""

    observation_space = gym.spaces.Box(-1.0, 1.0, (1,))

    def __init__(self, action_space):
        self.action_space = action_space

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return np.zeros(1, np.float32), {}

    def step(self, action):
        return np.zeros(1, np.float32), 0.0, False, False, {"action": action}


SPACE = gym.spaces.Box(np.array([-2.0, 0.0, 5.0], np.float32), np.array([2.0, 10.0, 5.0], np.float32))


def test_the_agent_acts_in_minus_one_to_one():
    env = NormalizeActionWrapper(Box(SPACE))
    assert env.action_space == gym.spaces.Box(-1.0, 1.0, (3,), np.float32)


def test_the_environments_own_space_stays_as_it_is():
    inner = Box(SPACE)
    NormalizeActionWrapper(inner)
    assert inner.action_space is SPACE
    assert inner.action_space.high[1] == 10.0


def test_the_ends_and_the_middle_meet_the_bounds():
    env = NormalizeActionWrapper(Box(SPACE))
    assert np.array_equal(env.rescale_action(-np.ones(3)), SPACE.low)
    assert np.array_equal(env.rescale_action(np.ones(3)), SPACE.high)
    assert np.array_equal(env.rescale_action(np.zeros(3)), [0.0, 5.0, 5.0])


def test_the_environment_gets_the_rescaled_action_in_its_own_dtype():
    env = NormalizeActionWrapper(Box(SPACE))
    env.reset()
    action = env.step(np.array([0.5, 0.5, 0.5]))[4]["action"]
    assert action.dtype == np.float32
    assert np.allclose(action, [1.0, 7.5, 5.0])


def test_actions_beyond_are_clipped_only_on_request():
    assert np.allclose(NormalizeActionWrapper(Box(SPACE)).rescale_action(np.full(3, 2.0)), [4.0, 15.0, 5.0])
    assert np.array_equal(NormalizeActionWrapper(Box(SPACE), clip=True).rescale_action(np.full(3, 2.0)), SPACE.high)


def test_the_widest_range_does_not_overflow():
    widest = np.finfo(np.float32).max
    env = NormalizeActionWrapper(Box(gym.spaces.Box(-widest, widest, (1,), np.float32)))
    assert np.array_equal(env.rescale_action([1.0]), [widest])
    widest = np.finfo(np.float64).max
    env = NormalizeActionWrapper(Box(gym.spaces.Box(-widest, widest, (1,), np.float64)))
    assert np.isfinite(env.rescale_action([1.0])).all()


def test_an_action_of_the_wrong_shape_is_refused():
    with pytest.raises(InvalidActionError, match=r"\(3,\), but it has \(2,\)"):
        NormalizeActionWrapper(Box(SPACE)).rescale_action(np.zeros(2))


def test_a_space_that_is_no_box_is_refused():
    with pytest.raises(ConfigurationError, match=r"requires a Box action space.*Discrete\(2\)"):
        NormalizeActionWrapper(gym.make("CartPole-v1"))


def test_an_unbounded_component_is_named():
    space = gym.spaces.Box(np.array([-1.0, -np.inf], np.float32), np.ones(2, np.float32))
    with pytest.raises(ConfigurationError, match=r"1 of 2 action components.*component 1 with the range \[-inf, 1.0\]"):
        NormalizeActionWrapper(Box(space))


def test_the_spec_rebuilds_the_wrapper():
    env = NormalizeActionWrapper(gym.make("Pendulum-v1"), clip=True)
    again = gym.make(env.spec)
    assert isinstance(again, NormalizeActionWrapper)
    assert again.clip is True


@pytest.mark.filterwarnings("ignore:.*is different from the unwrapped version:UserWarning")
def test_gymnasiums_checker_passes():
    check_env(NormalizeActionWrapper(gym.make("Pendulum-v1")), skip_render_check=True)
