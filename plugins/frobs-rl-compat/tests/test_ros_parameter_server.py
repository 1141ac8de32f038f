from __future__ import annotations

import pytest

from frobs_rl_compat.training.parameters import parameter_server


def test_without_a_master_there_is_no_parameter_server(lonely: str) -> None:
    assert parameter_server() is None


@pytest.mark.needs("frobs_algos_sb3")
@pytest.mark.parametrize("algorithm", ["a2c", "ddpg", "dqn", "ppo", "sac", "td3"])
def test_the_algorithms_parameters_go_through_the_parameter_server(own_master: str, algorithm: str) -> None:
    import rospy

    from frobs_rl_compat.training.config_files import DEFAULTS
    from frobs_rl_compat.training.parameters import current_parameters, load_parameters

    mapping = load_parameters(DEFAULTS / f"{algorithm}_config.yaml", "/robot1")
    assert rospy.get_param("/robot1/model_params/training_steps") == mapping["model_params"]["training_steps"]
    assert current_parameters(mapping, "/robot1") is mapping
    rospy.set_param("/robot1/model_params/training_steps", 7)
    assert current_parameters(mapping, "/robot1")["model_params"]["training_steps"] == 7
