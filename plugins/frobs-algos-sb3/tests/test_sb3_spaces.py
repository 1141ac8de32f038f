from __future__ import annotations

import json
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_algos.spaces import NoEnvironment, space_from_json, space_to_json
from frobs_core import plugins
from frobs_core.util.errors import CheckpointError, ConfigurationError, IncompatibleSpaceError

SPACES = [
    gym.spaces.Box(-np.inf, 0.1, (2, 3), np.float64),
    gym.spaces.Box(np.array([-0.1, 0.2], np.float32), np.array([0.3, 4.4], np.float32)),
    gym.spaces.Box(0, 255, (8, 8, 3), np.uint8),
    gym.spaces.Discrete(5, start=-2),
    gym.spaces.MultiDiscrete([2, 3]),
    gym.spaces.MultiBinary(4),
    gym.spaces.MultiBinary([2, 3]),
    gym.spaces.Dict({"b": gym.spaces.Discrete(2), "a": gym.spaces.Box(-1, 1, (3,))}),
]


@pytest.mark.parametrize("space", SPACES, ids=str)
def test_a_space_comes_back_from_json(space: gym.Space[Any]) -> None:
    assert space_from_json(json.loads(json.dumps(space_to_json(space)))) == space


@pytest.mark.parametrize(
    ("observation", "action", "message"),
    [
        (gym.spaces.Box(-1, 1, (3,)), gym.spaces.Discrete(2, start=1), "requires actions that start at 0"),
        (gym.spaces.Box(-1, 1, (3,)), gym.spaces.MultiDiscrete([2, 3], start=[0, 1]), "requires actions that start"),
        (gym.spaces.Discrete(5, start=-2), gym.spaces.Discrete(2), "values that start at 0; add the wrapper Flatten"),
    ],
)
def test_values_that_do_not_start_at_0_are_refused(
    observation: gym.Space[Any], action: gym.Space[Any], message: str
) -> None:
    with pytest.raises(IncompatibleSpaceError, match=message):
        plugins.get_record("algorithm", "ppo").load()(NoEnvironment(1, observation, action), {}, 0)


def test_other_spaces_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="cannot learn from"):
        space_to_json(gym.spaces.Dict({"a": gym.spaces.Text(3)}))


@pytest.mark.parametrize(
    "data", [{}, {"type": "Box"}, {"type": "Ball"}, {"type": "Box", "low": "x", "high": 1, "dtype": "f4"}]
)
def test_a_damaged_description_is_refused(data: dict[str, Any]) -> None:
    with pytest.raises(CheckpointError, match="saved space"):
        space_from_json(data)
