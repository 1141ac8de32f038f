"""Every function of ros_controllers against the bridge's controller manager."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from frobs_core.util.errors import ConfigurationError
from frobs_rl_compat.ros import ros_controllers, ros_gazebo, ros_params
from frobs_rl_compat.ros.logged_errors import or_raise

NS = "/one"
BOTH = ["joint_state_controller", "arm_controller"]


@pytest.fixture(autouse=True)
def robot(world: None) -> None:
    """A robot whose controllers are described and not loaded; the time runs, as a controller manager needs it."""
    assert ros_params.ros_load_yaml_from_pkg("tiny_arm", "controllers.yaml", NS)
    assert ros_gazebo.gazebo_spawn_urdf_pkg("tiny_arm", "arm.urdf.xacro", model_name="arm", robot_namespace=NS)[0]
    assert ros_gazebo.gazebo_unpause_physics()
    return


def states() -> dict[str, str]:
    return ros_controllers._states(NS)


@pytest.mark.ros_feature("helper functions of FRobs_RL", "mujoco", "gazebo")
def test_controllers_are_loaded_started_stopped_and_unloaded() -> None:
    assert ros_controllers.load_controller_srv("arm_controller", NS) is True
    assert states() == {"arm_controller": "initialized"}
    assert ros_controllers.load_controller_srv("arm_controller", NS) is True  # it is loaded already
    assert ros_controllers.start_controllers_srv(["arm_controller"], NS) is True
    assert states() == {"arm_controller": "running"}
    assert ros_controllers.stop_controllers_srv(["arm_controller"], NS) is True
    assert states() == {"arm_controller": "stopped"}
    assert ros_controllers.unload_controller_srv("arm_controller", NS) is True
    assert states() == {}


@pytest.mark.ros_feature("helper functions of FRobs_RL", "mujoco", "gazebo")
def test_lists_are_loaded_and_unloaded() -> None:
    assert ros_controllers.load_controller_list_srv(BOTH, NS) is None
    assert set(states()) == set(BOTH)
    assert ros_controllers.unload_controller_list_srv(BOTH, NS) is None
    assert states() == {}


@pytest.mark.ros_feature("helper functions of FRobs_RL", "mujoco", "gazebo")
def test_controllers_are_spawned_switched_reset_and_killed() -> None:
    assert ros_controllers.spawn_controllers_srv(BOTH, NS) is True
    assert set(states().values()) == {"running"}
    assert ros_controllers.reset_controllers_srv(BOTH, ns=NS) is True
    assert set(states().values()) == {"running"}
    assert ros_controllers.switch_controllers_srv([], ["arm_controller"], NS, strictness=2) is True
    assert states()["arm_controller"] == "stopped"
    assert ros_controllers.switch_controllers_srv(["arm_controller"], [], NS) is True
    assert ros_controllers.kill_controllers_srv(BOTH, NS) is True
    assert states() == {}


@pytest.mark.parametrize(
    ("controller", "reason"),
    [
        ("no_controller", "the parameter /one/no_controller/type is missing"),
        ("nonsense_controller", "there is no controller type 'nonsense_controllers/NoSuchController'"),
    ],
)
def test_a_controller_that_does_not_exist_is_refused_with_a_reason(
    controller: str, reason: str, reasons: Callable[[], str]
) -> None:
    assert ros_controllers.load_controller_srv(controller, NS, max_retries=2) is False
    assert ros_controllers.spawn_controllers_srv([controller], NS) is False
    assert reason in reasons()


def test_best_effort_does_not_hide_that_nothing_was_started(reasons: Callable[[], str]) -> None:
    assert ros_controllers.start_controllers_srv(["no_controller"], NS, strictness=1) is False
    assert "'no_controller' is not loaded but should be running" in reasons()
    assert ros_controllers.reset_controllers_srv(["no_controller"], 2, NS) is False


def test_a_controller_that_runs_is_not_unloaded(reasons: Callable[[], str]) -> None:
    assert ros_controllers.spawn_controllers_srv(["arm_controller"], NS)
    assert ros_controllers.unload_controller_srv("arm_controller", NS, max_retries=1) is False
    assert "it is running; stop it first" in reasons()
    assert ros_controllers.unload_controller_srv("no_controller", NS, max_retries=1) is False
    assert "no such controller is loaded" in reasons()


def test_strictness_is_one_of_two() -> None:
    with pytest.raises(ConfigurationError, match="it must be 1"):
        or_raise(ros_controllers.switch_controllers_srv)([], [], NS, strictness=3)
    with pytest.raises(ConfigurationError, match="timeout is"):
        or_raise(ros_controllers.switch_controllers_srv)([], [], NS, timeout=-1.0)


def test_a_namespace_without_a_robot_is_refused(reasons: Callable[[], str]) -> None:
    assert ros_controllers.load_controller_srv("arm_controller", "/nowhere") is False
    assert "service /nowhere/controller_manager/load_controller: the service is not available" in reasons()
