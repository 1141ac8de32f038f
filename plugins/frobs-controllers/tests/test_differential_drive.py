import dataclasses

import numpy as np
import pytest

from frobs_controllers.differential_drive import DifferentialDrive
from frobs_core.util.errors import ConfigurationError

LEFT, MAST, RIGHT = range(3)


def test_full_speed_ahead_turns_both_wheels_alike(fake_cart, bound):
    wheels = bound(DifferentialDrive(), fake_cart()).apply(np.array([[1.0, 0.0]]))
    assert np.allclose(wheels, [[0.7 / 0.035, 0.0, 0.7 / 0.035]])


def test_turning_to_the_left_turns_the_right_wheel_forward(fake_cart, bound):
    wheels = bound(DifferentialDrive(), fake_cart()).apply(np.array([[0.0, 1.0]]))
    assert np.allclose(wheels, [[-3.0 * 0.115 / 0.035, 0.0, 3.0 * 0.115 / 0.035]])


def test_own_velocities_replace_the_robots(fake_cart, bound):
    controller = bound(DifferentialDrive(max_linear_velocity=0.35, max_angular_velocity=1.0), fake_cart())
    wheels = controller.apply(np.array([[2.0, 2.0]]))[0]
    assert (wheels[LEFT] + wheels[RIGHT]) / 2 * 0.035 == pytest.approx(0.35)
    assert (wheels[RIGHT] - wheels[LEFT]) / 0.23 * 0.035 == pytest.approx(1.0)


def test_acceleration_limits_make_the_velocity_ramp(fake_cart, bound):
    controller = bound(DifferentialDrive(max_linear_acceleration=1.0, max_angular_acceleration=5.0), fake_cart())
    linear, angular = [], []
    for _ in range(20):
        wheels = controller.apply(np.array([[1.0, -1.0]]))[0]
        linear.append((wheels[LEFT] + wheels[RIGHT]) / 2 * 0.035)
        angular.append((wheels[RIGHT] - wheels[LEFT]) / 0.23 * 0.035)
    assert np.allclose(linear, np.minimum(0.04 * np.arange(1, 21), 0.7))
    assert np.allclose(angular, np.maximum(-0.2 * np.arange(1, 21), -3.0))


def test_reset_stands_still_in_the_masked_environments_only(fake_cart, bound):
    controller = bound(DifferentialDrive(max_linear_acceleration=1.0), fake_cart(2))
    for _ in range(5):
        controller.apply(np.tile([1.0, 0.0], (2, 1)))
    controller.reset(np.array([True, False]))
    assert np.allclose(controller.apply(np.tile([1.0, 0.0], (2, 1)))[:, LEFT] * 0.035, [0.04, 0.24])


def test_wheels_at_their_limit_keep_the_curve(fake_cart, bound):
    robot = fake_cart(wheel_velocity=10.0)
    wheels = bound(DifferentialDrive(), robot).apply(np.array([[1.0, 1.0]]))[0]
    free = bound(DifferentialDrive(), fake_cart()).apply(np.array([[1.0, 1.0]]))[0]
    assert np.abs(wheels).max() == 10.0
    assert wheels[LEFT] / wheels[RIGHT] == pytest.approx(free[LEFT] / free[RIGHT])


def test_a_robot_without_differential_drive_is_refused(fake_arm, bound):
    with pytest.raises(ConfigurationError, match="has no differential drive"):
        bound(DifferentialDrive(), fake_arm())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"left": ("wheel",)}, "has no actuated joint 'wheel'"),
        ({"right": ()}, "has no wheels"),
        ({"wheel_radius": 0.0}, "wheel_radius"),
        ({"separation": -1.0}, "separation"),
        ({"max_linear_velocity": np.inf}, "max_linear_velocity"),
        ({"max_angular_acceleration": -1.0}, "max_angular_acceleration"),
    ],
    ids=["unknown wheel", "no wheel", "radius", "separation", "velocity", "acceleration"],
)
def test_an_impossible_drive_is_refused(fake_cart, bound, change, message):
    robot = fake_cart()
    drive = dataclasses.replace(robot.robot.differential_drive, **change)
    robot.robot = dataclasses.replace(robot.robot, differential_drive=drive)
    with pytest.raises(ConfigurationError, match=message):
        bound(DifferentialDrive(), robot)


@pytest.mark.parametrize(
    "name",
    ["max_linear_velocity", "max_angular_velocity", "max_linear_acceleration", "max_angular_acceleration"],
)
def test_parameters_must_be_positive(name):
    with pytest.raises(ConfigurationError, match=name):
        DifferentialDrive(**{name: 0.0})


def test_the_robots_accelerations_hold_where_none_is_given(fake_cart, bound):
    robot = fake_cart()
    drive = dataclasses.replace(
        robot.robot.differential_drive, max_linear_acceleration=1.0, max_angular_acceleration=5.0
    )
    robot.robot = dataclasses.replace(robot.robot, differential_drive=drive)
    wheels = bound(DifferentialDrive(), robot).apply(np.array([[1.0, 1.0]]))[0]
    assert (wheels[LEFT] + wheels[RIGHT]) / 2 * 0.035 == pytest.approx(0.04)
    assert (wheels[RIGHT] - wheels[LEFT]) / 0.23 * 0.035 == pytest.approx(0.2)
    wheels = bound(DifferentialDrive(max_linear_acceleration=2.0), robot).apply(np.array([[1.0, 0.0]]))[0]
    assert wheels[LEFT] * 0.035 == pytest.approx(0.08)
