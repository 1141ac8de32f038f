import gymnasium as gym
import numpy as np
import pytest

from frobs_controllers.discrete import Discrete
from frobs_controllers.plugin import frobs_controllers
from frobs_core.contracts import CommandMode
from frobs_core.util.errors import ConfigurationError, InvalidActionError, UnknownNameError, UnknownParameterError

RECORDS = {record.name: record for record in frobs_controllers()}


def test_each_component_has_a_move_down_and_one_up(fake_arm, bound):
    robot = fake_arm()
    controller = Discrete(controller=RECORDS["joint_delta_position"], controller_kwargs={"max_delta": 0.1})
    bound(controller, robot)
    assert controller.action_space == gym.spaces.Discrete(13)
    for move in range(13):
        controller.reset(None)
        expected = np.zeros(6)
        if move:
            expected[(move - 1) // 2] = -0.1 if move % 2 else 0.1
        assert np.allclose(controller.apply(np.array([move])) - robot.home, expected)


def test_environments_move_each_by_their_own(fake_arm, bound):
    robot = fake_arm(3)
    controller = bound(Discrete(controller=RECORDS["joint_delta_position"], magnitude=0.5), robot)
    moved = controller.apply(np.array([0, 1, 4])) - robot.home
    assert np.allclose(moved[:, :2], [[0, 0], [-0.075, 0], [0, 0.075]])


@pytest.mark.parametrize(("name", "mode"), [("joint_velocity", "velocity"), ("joint_effort", "effort")])
def test_commands_mean_what_those_of_the_wrapped_controller_mean(name, mode):
    assert Discrete(controller=RECORDS[name]).command_mode is CommandMode(mode)


def test_the_state_is_that_of_the_wrapped_controller(fake_arm, bound):
    controller = bound(Discrete(controller=RECORDS["tcp_delta_position"]), fake_arm(2))
    before = controller.snapshot()
    controller.apply(np.array([1, 2]))
    assert not np.array_equal(controller.snapshot()["target"], before["target"])
    controller.restore(before)
    assert np.array_equal(controller.snapshot()["target"], before["target"])


@pytest.mark.parametrize("action", [-1, 13])
def test_a_move_that_does_not_exist_is_refused(fake_arm, bound, action):
    controller = bound(Discrete(controller=RECORDS["joint_delta_position"]), fake_arm())
    with pytest.raises(InvalidActionError, match=r"\[0, 12\]"):
        controller.apply(np.array([action]))


def test_a_discrete_of_a_discrete_is_refused(fake_arm, bound):
    inner = {"controller": RECORDS["joint_delta_position"]}
    with pytest.raises(ConfigurationError, match="only controllers with a bounded, one-dimensional Box"):
        bound(Discrete(controller=RECORDS["discrete"], controller_kwargs=inner), fake_arm())


def test_an_unknown_parameter_of_the_wrapped_controller_is_named():
    with pytest.raises(UnknownParameterError, match="Did you mean 'max_delta'"):
        Discrete(controller=RECORDS["joint_delta_position"], controller_kwargs={"max_dleta": 1.0})


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"magnitude": 0.0}, "magnitude"),
        ({"magnitude": 1.5}, r"\(0, 1\]"),
        ({"controller": 3}, "name or record"),
        ({"controller_kwargs": [1]}, "must be a mapping"),
    ],
    ids=["zero", "too far", "no controller", "no mapping"],
)
def test_bad_parameters_are_refused(parameters, message):
    with pytest.raises(ConfigurationError, match=message):
        Discrete(**{"controller": RECORDS["joint_delta_position"], **parameters})


def test_the_wrapped_controller_is_found_by_its_name(fake_arm, bound):
    controller = bound(Discrete(controller="tcp_delta_position"), fake_arm())
    assert controller.action_space == gym.spaces.Discrete(7)


def test_a_wrapped_controller_that_does_not_exist_is_named_with_its_nearest():
    with pytest.raises(UnknownNameError, match="Did you mean 'tcp_delta_position'"):
        Discrete(controller="tcp_delta_positon")
