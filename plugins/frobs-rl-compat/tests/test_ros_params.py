from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from frobs_rl_compat.ros import ros_params

NUMBERS = Path(__file__).parent / "packages" / "tiny_arm" / "config"


@pytest.mark.parametrize("ns", ["/", "/robot1", "robot1/inner/"])
@pytest.mark.ros_feature("parameters", "ros")
@pytest.mark.ros_feature("helper functions of FRobs_RL", "ros")
def test_a_file_of_a_package_is_loaded_below_its_namespace(own_master: str, ns: str) -> None:
    import rospy

    assert ros_params.ros_load_yaml_from_pkg("tiny_arm", "numbers.yaml", ns) is True
    found = rospy.get_param(f"/{ns.strip('/')}/arm".replace("//", "/"))
    assert found == {
        "reach": 0.6,
        "angle": pytest.approx(1.5708, abs=1e-4),
        "names": ["one", "two"],
        "deep": {"deeper": True},
    }


@pytest.mark.ros_feature("parameters", "ros")
@pytest.mark.ros_feature("helper functions of FRobs_RL", "ros")
def test_a_file_is_loaded_and_what_stands_beside_stays(own_master: str) -> None:
    import rospy

    rospy.set_param("/beside/arm/mass", 2.0)
    assert ros_params.ros_load_yaml_from_path(str(NUMBERS / "numbers.yaml"), "/beside")
    assert rospy.get_param("/beside/arm/mass") == 2.0
    assert rospy.get_param("/beside/arm/reach") == 0.6


@pytest.mark.parametrize(
    ("file", "reason"),
    [("none.yaml", "has no file"), ("broken.yaml", "broken.yaml:2"), ("list.yaml", "the file must contain a mapping")],
)
def test_a_file_that_cannot_be_used_is_refused_with_a_reason(
    own_master: str, reasons: Callable[[], str], file: str, reason: str
) -> None:
    assert ros_params.ros_load_yaml_from_pkg("tiny_arm", file) is False
    assert reason in reasons()


def test_a_package_that_is_nowhere_is_refused_and_the_nearest_named(
    own_master: str, reasons: Callable[[], str]
) -> None:
    assert ros_params.ros_load_yaml_from_pkg("tiny_harm", "numbers.yaml") is False
    assert "Did you mean 'tiny_arm'?" in reasons()


def test_without_a_master_nothing_is_loaded(lonely: str, reasons: Callable[[], str]) -> None:
    assert ros_params.ros_load_yaml_from_path(str(NUMBERS / "numbers.yaml")) is False
    assert f"no ROS master responds at {lonely}" in reasons()
