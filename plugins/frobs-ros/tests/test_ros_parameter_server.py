from __future__ import annotations

from pathlib import Path

import pytest

from frobs_ros.ros.parameter_server import parameter_server


def test_without_a_master_there_is_no_parameter_server(lonely: str) -> None:
    assert parameter_server() is None


@pytest.mark.needs("frobs_algos_sb3")
@pytest.mark.parametrize("algorithm", ["a2c", "ddpg", "dqn", "ppo", "sac", "td3"])
def test_the_algorithms_parameters_go_through_the_parameter_server(own_master: str, algorithm: str) -> None:
    import rospy

    import frobs_algos_sb3.frobs_rl as models
    from frobs_algos_sb3.frobs_rl.parameters import current_parameters, load_parameters

    file = Path(models.__file__).parent / "config" / f"{algorithm}_config.yaml"
    mapping = load_parameters(file, "/robot1")
    assert rospy.get_param("/robot1/model_params/training_steps") == mapping["model_params"]["training_steps"]
    assert current_parameters(mapping, "/robot1") is mapping
    rospy.set_param("/robot1/model_params/training_steps", 7)
    assert current_parameters(mapping, "/robot1")["model_params"]["training_steps"] == 7
