import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from frobs_core.util.errors import ConfigurationError
from frobs_rl_compat.wrappers import NormalizeActionWrapper, NormalizeObservationWrapper


class Show(gym.Env):
    """Observes a given array, whatever happens."""

    action_space = gym.spaces.Box(-1.0, 1.0, (1,))

    def __init__(self, space, observation):
        self.observation_space, self._observation = space, observation

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self._observation, {"seed": seed, "options": options}

    def step(self, action):
        return self._observation, 0.0, False, False, {}


SPACE = gym.spaces.Box(np.array([-2.0, 0.0, 5.0], np.float32), np.array([2.0, 10.0, 5.0], np.float32))
MIDDLE = np.array([0.0, 5.0, 5.0], np.float32)


def wrapped(observation=MIDDLE, **parameters):
    return NormalizeObservationWrapper(Show(SPACE, observation), **parameters)


def test_the_bounds_become_minus_one_and_one():
    assert wrapped().observation_space == gym.spaces.Box(-1.0, 1.0, (3,), np.float32)
    assert np.array_equal(wrapped().scale_observation(SPACE.low), [-1.0, -1.0, 0.0])
    assert np.array_equal(wrapped().scale_observation(SPACE.high), [1.0, 1.0, 0.0])


def test_reset_and_step_return_float32_inside_the_space():
    env = wrapped(SPACE.high)
    for observation in (env.reset()[0], env.step(np.zeros(1))[0]):
        assert observation.dtype == np.float32
        assert observation in env.observation_space


def test_a_component_without_range_becomes_zero():
    assert wrapped().scale_observation([0.0, 0.0, 99.0])[2] == 0.0


def test_observations_beyond_are_clipped_only_on_request():
    assert np.array_equal(wrapped().scale_observation([4.0, 20.0, 5.0]), [2.0, 3.0, 0.0])
    assert np.array_equal(wrapped(clip=True).scale_observation([4.0, 20.0, 5.0]), [1.0, 1.0, 0.0])


def test_the_inner_info_of_a_reset_is_kept():
    _, info = wrapped().reset(seed=3, options={"goal": 1})
    assert info == {"seed": 3, "options": {"goal": 1}}


def test_the_environments_own_space_stays_as_it_is():
    env = wrapped()
    assert env.unwrapped.observation_space is SPACE
    assert SPACE.high[1] == 10.0


def test_pictures_are_scaled_too():
    space = gym.spaces.Box(0, 255, (4, 4, 3), np.uint8)
    env = NormalizeObservationWrapper(Show(space, np.full((4, 4, 3), 255, np.uint8)))
    assert np.array_equal(env.reset()[0], np.ones((4, 4, 3), np.float32))


def test_an_observation_of_the_wrong_shape_is_refused():
    with pytest.raises(ValueError, match=r"\(3,\), but it has \(2,\)"):
        wrapped().scale_observation(np.zeros(2))


def test_a_space_that_is_no_box_is_refused():
    with pytest.raises(ConfigurationError, match="requires a Box observation space"):
        NormalizeObservationWrapper(Show(gym.spaces.Discrete(3), 0))


def test_unbounded_components_are_named():
    with pytest.raises(ConfigurationError, match=r"2 of 4 observation components.*TransformObservation"):
        NormalizeObservationWrapper(gym.make("CartPole-v1"))


def test_the_spec_rebuilds_the_wrapper():
    again = gym.make(NormalizeObservationWrapper(gym.make("Pendulum-v1"), clip=True).spec)
    assert isinstance(again, NormalizeObservationWrapper)
    assert again.clip is True


@pytest.mark.filterwarnings("ignore:.*is different from the unwrapped version:UserWarning")
def test_gymnasiums_checker_passes():
    env = NormalizeActionWrapper(gym.make("Pendulum-v1"))
    check_env(NormalizeObservationWrapper(env, clip=True), skip_render_check=True)
