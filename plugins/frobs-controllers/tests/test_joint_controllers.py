from dataclasses import replace

import numpy as np
import pytest

from frobs_controllers.gripper import GripperDelta
from frobs_controllers.joint_delta_position import JointDeltaPosition
from frobs_controllers.joint_effort import JointEffort
from frobs_controllers.joint_position import JointPosition
from frobs_controllers.joint_velocity import JointVelocity
from frobs_core.description import EndEffector, Robot
from frobs_core.util.errors import ConfigurationError, UnsuitableRobotError

JOINTS = tuple(f"joint_{i}" for i in range(1, 7))


def arrive(controller, action):
    """Return the command once the velocity limits have let it arrive."""
    for _ in range(60):
        command = controller.apply(action)
    return command


def test_joint_position_maps_the_ends_of_the_action_to_the_limits(fake_arm, bound):
    robot = fake_arm()
    controller = bound(JointPosition(), robot)
    assert np.allclose(arrive(controller, np.ones((1, 6))), robot.position_upper)
    assert np.allclose(arrive(controller, -np.ones((1, 6))), robot.position_lower)
    assert np.allclose(arrive(controller, np.zeros((1, 6))), (robot.position_lower + robot.position_upper) / 2)


def test_joint_position_clips_actions(fake_arm, bound):
    robot = fake_arm()
    assert np.array_equal(arrive(bound(JointPosition(), robot), np.full((1, 6), 7.0)), robot.position_upper)


def test_joint_position_goes_no_faster_than_the_velocity_limits(fake_arm, bound):
    robot = fake_arm()
    controller = bound(JointPosition(), robot)
    moved = controller.apply(np.ones((1, 6))) - robot.home
    assert np.allclose(moved, 0.04 * robot.velocity_limit)


def test_joint_position_turns_a_continuous_joint_half_a_turn_each_way(fake_arm, bound):
    robot = fake_arm()
    robot.position_lower[:, 5], robot.position_upper[:, 5] = -np.inf, np.inf
    assert arrive(bound(JointPosition(), robot), np.full((1, 6), 2.0))[0, 5] == np.pi


def test_joint_position_refuses_a_prismatic_joint_without_limits(fake_cart, bound):
    with pytest.raises(ConfigurationError, match="no position limits for the prismatic joint 'mast_lift'"):
        bound(JointPosition(), fake_cart())


def test_joint_delta_position_moves_each_joint_by_its_step(fake_arm, bound):
    robot = fake_arm()
    controller = bound(JointDeltaPosition(max_delta=0.1), robot)
    action = np.array([[1.0, -1.0, 0.5, 0.0, 2.0, -2.0]])
    assert np.allclose(controller.apply(action) - robot.home, [[0.1, -0.1, 0.05, 0.0, 0.1, -0.1]])


def test_joint_delta_position_goes_no_faster_than_the_velocity_limits(fake_arm, bound):
    robot = fake_arm()
    controller = bound(JointDeltaPosition(max_delta=9.0), robot)
    assert np.allclose(controller.apply(np.ones((1, 6))) - robot.home, 0.04 * robot.velocity_limit)


def test_joint_delta_position_does_not_sink_where_the_joints_hang_below_the_command(fake_arm, bound):
    robot = fake_arm(sag=0.01)
    controller = bound(JointDeltaPosition(), robot)
    for _ in range(50):
        robot.command(controller.apply(np.zeros((1, 6))))
        robot.step()
    assert np.allclose(robot.joint_positions, robot.home - 0.01)


def test_joint_delta_position_stays_inside_the_limits_and_comes_back_at_once(fake_arm, bound):
    robot = fake_arm()
    controller = bound(JointDeltaPosition(), robot)
    for _ in range(100):
        target = controller.apply(np.ones((1, 6)))
    assert np.array_equal(target, robot.position_upper)
    assert (controller.apply(-np.ones((1, 6))) < robot.position_upper).all()


def test_full_range_stands_for_the_limits_and_adds_to_the_measured_positions(fake_arm, bound):
    robot = fake_arm()
    controller = bound(JointDeltaPosition(full_range=True), robot)
    robot.write_joint_state(np.full((1, 6), 0.25))
    middle, half = (robot.position_upper + robot.position_lower) / 2, (robot.position_upper - robot.position_lower) / 2
    assert np.allclose(controller.apply((0.5 - middle) / half), 0.75)
    assert np.array_equal(controller.apply(np.full((1, 6), 100.0)), robot.position_upper)


def test_joint_velocity_scales_to_the_limits(fake_arm, bound):
    robot = fake_arm()
    assert np.allclose(bound(JointVelocity(), robot).apply(np.full((1, 6), 0.5)), 0.5 * robot.velocity_limit)
    slow = bound(JointVelocity(max_velocity=0.2), robot)
    assert np.allclose(slow.apply(np.full((1, 6), 2.0)), 0.2)


def test_joint_velocity_stops_at_a_position_limit_and_lets_go_of_it(fake_arm, bound):
    robot = fake_arm()
    controller = bound(JointVelocity(), robot)
    robot.write_joint_state(robot.position_upper - 0.004)
    assert np.allclose(controller.apply(np.ones((1, 6))), 0.1)  # 4 mrad in 40 ms
    robot.write_joint_state(robot.position_upper)
    assert np.array_equal(controller.apply(np.ones((1, 6))), np.zeros((1, 6)))
    assert np.array_equal(controller.apply(-np.ones((1, 6))), -robot.velocity_limit)


def test_joint_velocity_does_not_throw_back_a_joint_beyond_its_limit(fake_arm, bound):
    robot = fake_arm()
    controller = bound(JointVelocity(), robot)
    robot.write_joint_state(robot.position_upper + 1.0)
    assert np.array_equal(controller.apply(np.ones((1, 6))), -robot.velocity_limit)


@pytest.mark.parametrize(
    ("controller", "message"),
    [(JointVelocity(), "set max_velocity="), (JointEffort(), "set max_effort=")],
    ids=["velocity", "effort"],
)
def test_a_missing_limit_must_be_given_as_a_parameter(fake_cart, bound, controller, message):
    with pytest.raises(ConfigurationError, match=message):
        bound(controller, fake_cart())


def test_joint_effort_scales_to_the_limits(fake_arm, fake_cart, bound):
    robot = fake_arm()
    assert np.allclose(bound(JointEffort(), robot).apply(np.full((1, 6), -0.5)), -0.5 * robot.effort_limit)
    assert np.allclose(bound(JointEffort(max_effort=3.0), fake_cart()).apply(np.full((1, 3), 9.0)), 3.0)


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf, "0.1", True, None], ids=repr)
def test_steps_must_be_positive_and_finite(value):
    with pytest.raises(ConfigurationError, match=r"joint_delta_position: max_delta is .*; it must be"):
        JointDeltaPosition(max_delta=value)


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf, "fast"], ids=repr)
def test_own_limits_must_be_positive_and_finite(value):
    with pytest.raises(ConfigurationError, match="max_velocity"):
        JointVelocity(max_velocity=value)
    with pytest.raises(ConfigurationError, match="max_effort"):
        JointEffort(max_effort=value)


def test_full_range_must_be_a_flag():
    with pytest.raises(ConfigurationError, match=r"full_range is .*; it must be true or false"):
        JointDeltaPosition(full_range="yes")


def test_a_finger_that_does_not_move_is_refused(fake_arm, bound):
    tool = EndEffector(tcp="link_6", group="all", open=dict.fromkeys(JOINTS, 0.5), closed=dict.fromkeys(JOINTS, 0.0))
    still = replace(tool, closed={**tool.closed, "joint_2": 0.5})
    robot = Robot(model="fake.urdf", name="fake_gripper", groups={"all": JOINTS}, end_effectors={"all": still})
    with pytest.raises(UnsuitableRobotError, match="different open and closed positions for the finger 'joint_2'"):
        bound(GripperDelta(), fake_arm(robot=robot))
