"""The environment type in LeRobot itself, which needs an environment of its own; see docs/how-to/lerobot.md.

$ lerobot/bin/python -m pytest -c /dev/null --rootdir . --noconftest plugins/lerobot_env_frobs/tests/test_lerobot.py
"""

from __future__ import annotations

import warnings
from typing import Any

import pytest

pytestmark = pytest.mark.needs("lerobot")


def config(**settings: Any) -> Any:
    from lerobot.envs.factory import make_env_config
    from lerobot.utils.import_utils import register_third_party_plugins

    register_third_party_plugins()
    return make_env_config("frobs", **settings)


def test_features_are_those_of_recorded_data_sets() -> None:
    from lerobot.envs.utils import env_to_policy_features

    features = env_to_policy_features(config(task="PandaLift-v0", cameras="overview", image_size=[48, 64]))
    assert {name: (feature.type.value, feature.shape) for name, feature in features.items()} == {
        "action": ("ACTION", (4,)),
        "observation.state": ("STATE", (7,)),
        "observation.environment_state": ("ENV", (18,)),
        "observation.images.overview": ("VISUAL", (3, 48, 64)),
    }


def test_settings_survive_a_configuration_file() -> None:
    import draccus
    from lerobot.envs.configs import EnvConfig

    given = config(task="PandaLift-v0", fps=50, kwargs={"reward_type": "sparse"})
    assert draccus.decode(EnvConfig, draccus.encode(given, EnvConfig)) == given
    assert given.fps == 50


@pytest.mark.parametrize("asynchronous", [False, True])
def test_lerobot_makes_and_steps_environments(asynchronous: bool) -> None:
    from lerobot.envs.factory import make_env
    from lerobot.envs.utils import check_env_attributes_and_types, preprocess_observation

    env = make_env(config(task="PandaLift-v0"), n_envs=2, use_async_envs=asynchronous)["frobs"][0]
    observation, _ = env.reset(seed=[0, 1], options={"lerobot_new_rollout": True})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env_attributes_and_types(env)
    assert set(preprocess_observation(observation)) == {"observation.state", "observation.environment_state"}
    *_, info = env.step(env.action_space.sample())
    assert info["is_success"].tolist() == [False, False]
    env.close()
