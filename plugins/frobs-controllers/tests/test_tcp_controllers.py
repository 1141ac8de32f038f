import numpy as np
import pytest

from frobs_controllers.tcp_delta_pose import TcpDeltaPose
from frobs_controllers.tcp_delta_position import TcpDeltaPosition
from frobs_core.util.errors import ConfigurationError


def drive(controller, robot, action, steps):
    """Apply one action for some steps; return how far the tool has moved [m]."""
    start = robot.frame_pose("tcp")[0].copy()
    action = np.tile(np.asarray(action, dtype=float), (robot.num_envs, 1))
    for _ in range(steps):
        robot.command(controller.apply(action))
        robot.step()
    return robot.frame_pose("tcp")[0] - start


def settle(controller, robot, steps=40):
    return drive(controller, robot, np.zeros(controller.action_space.shape), steps)


def turned_by(robot, before):
    """Return the rotation vectors from some orientations to the present ones [rad], for small turns."""
    change = robot.rotation @ before.transpose(0, 2, 1)
    twice_sin = np.stack(
        [change[:, 2, 1] - change[:, 1, 2], change[:, 0, 2] - change[:, 2, 0], change[:, 1, 0] - change[:, 0, 1]], -1
    )
    sin = np.linalg.norm(twice_sin, axis=-1, keepdims=True) / 2
    return twice_sin / 2 * np.arcsin(sin) / np.maximum(sin, 1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2], ids="xyz")
@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["forth", "back"])
@pytest.mark.parametrize("make", [TcpDeltaPosition, TcpDeltaPose])
@pytest.mark.parametrize("share", [1.0, 0.4], ids=["quick joints", "slow joints"])
def test_the_tool_moves_by_what_was_asked(fake_arm, bound, make, axis, sign, share):
    robot = fake_arm(share=share)
    controller = bound(make(max_delta=0.02), robot)
    action = np.zeros(controller.action_space.shape)
    action[axis] = sign
    moved = drive(controller, robot, action, 4) + settle(controller, robot)
    asked = np.zeros(3)
    asked[axis] = sign * 0.08
    assert np.abs(moved - asked).max() < 1e-3


@pytest.mark.parametrize("make", [TcpDeltaPosition, TcpDeltaPose])
def test_a_closed_path_ends_where_it_began(fake_arm, bound, make):
    robot = fake_arm(share=0.5, sag=0.003)
    controller = bound(make(), robot)
    settle(controller, robot)
    start = robot.frame_pose("tcp")[0].copy()
    for _ in range(5):
        for x, z in [(1, 0), (0, -1), (-1, 0), (0, 1)]:
            action = np.zeros(controller.action_space.shape)
            action[[0, 2]] = x, z
            drive(controller, robot, action, 2)
    settle(controller, robot)
    assert np.abs(robot.frame_pose("tcp")[0] - start).max() < 1e-3


@pytest.mark.parametrize("make", [TcpDeltaPosition, TcpDeltaPose])
def test_an_action_of_zero_holds_the_tool_though_gravity_pulls(fake_arm, bound, make):
    robot = fake_arm(sag=0.01)
    controller = bound(make(), robot)
    robot.command(controller.apply(np.zeros((1, *controller.action_space.shape))))
    robot.step()
    hanging = robot.frame_pose("tcp")[0].copy()
    assert np.abs(settle(controller, robot, 100)).max() < 1e-3
    assert np.abs(robot.frame_pose("tcp")[0] - hanging).max() < 1e-3


@pytest.mark.parametrize("axis", [0, 1, 2], ids="xyz")
def test_the_tool_turns_by_what_was_asked_and_stays_in_place(fake_arm, bound, axis):
    robot = fake_arm(share=0.5)
    controller = bound(TcpDeltaPose(max_rotation=0.1), robot)
    before = robot.rotation.copy()
    action = np.zeros(6)
    action[3 + axis] = 1.0
    moved = drive(controller, robot, action, 4) + settle(controller, robot)
    asked = np.zeros(3)
    asked[axis] = 0.4
    assert np.abs(turned_by(robot, before) - asked).max() < 2e-3
    assert np.abs(moved).max() < 1e-3


def test_moving_the_pose_keeps_the_orientation(fake_arm, bound):
    robot = fake_arm()
    controller = bound(TcpDeltaPose(), robot)
    before = robot.rotation.copy()
    drive(controller, robot, [-1, 0, 0, 0, 0, 0], 3)
    settle(controller, robot)
    assert np.abs(turned_by(robot, before)).max() < 1e-3


@pytest.mark.parametrize("make", [TcpDeltaPosition, TcpDeltaPose])
def test_pulling_beyond_reach_stays_inside_the_limits_and_the_arm_comes_back(fake_arm, bound, make):
    robot = fake_arm(share=0.5)
    controller = bound(make(), robot)
    out = np.zeros(controller.action_space.shape)
    out[0] = 1.0
    for _ in range(100):
        command = controller.apply(out[None])
        assert ((command >= robot.position_lower) & (command <= robot.position_upper)).all()
        robot.command(command)
        robot.step()
    stretched = robot.frame_pose("tcp")[0].copy()
    assert drive(controller, robot, -out, 8)[0, 0] < -0.03
    assert stretched[0, 0] > 0.55  # of 0.71 m at this height


def test_a_joint_at_its_limit_leaves_its_part_to_the_others(fake_arm, bound):
    home = np.array([0.0, 0.2, 1.22173, 0.0, 0.6, 0.0])  # the elbow at its limit; lowering the tool would bend it more
    robot = fake_arm(home=home)
    controller = bound(TcpDeltaPosition(max_delta=0.02), robot)
    moved = drive(controller, robot, [0, 0, -1], 3) + settle(controller, robot)
    assert np.abs(moved - [0, 0, -0.06]).max() < 2e-3


def test_no_joint_is_asked_to_go_faster_than_its_limit(fake_arm, bound):
    straight = np.zeros(6)  # the wrist is singular here
    robot = fake_arm(home=straight)
    controller = bound(TcpDeltaPose(damping=1e-6), robot)
    rng, last = np.random.default_rng(0), robot.home.copy()
    for _ in range(50):
        command = controller.apply(rng.uniform(-1, 1, (1, 6))).copy()
        assert (np.abs(command - last) <= robot.velocity_limit * 0.04 + 1e-12).all()
        last = command
        robot.command(command)
        robot.step()


@pytest.mark.parametrize("make", [TcpDeltaPosition, TcpDeltaPose])
@pytest.mark.parametrize("name", ["max_delta", "damping"])
@pytest.mark.parametrize("value", [0.0, -0.1, np.nan, np.inf, "1 cm"], ids=repr)
def test_parameters_must_be_positive_and_finite(make, name, value):
    with pytest.raises(ConfigurationError, match=rf"{name} is .*; it must be"):
        make(**{name: value})


@pytest.mark.parametrize("value", [0.0, 1.5, np.nan], ids=repr)
def test_a_turn_must_be_at_most_a_radian(value):
    with pytest.raises(ConfigurationError, match="max_rotation"):
        TcpDeltaPose(max_rotation=value)


def test_posture_brings_a_redundant_arm_back_without_moving_its_tool(fake_arm, bound):
    robot = fake_arm()
    controller = bound(TcpDeltaPosition(), robot)
    robot.write_joint_state(robot.home + np.array([0.0, 0.0, 0.0, 0.5, 0.0, 1.0]))
    controller.reset(None)
    moved = settle(controller, robot, 300)
    assert np.abs(moved).max() < 1e-3
    assert abs(robot.joint_positions[0, 5] - robot.home[0, 5]) < 0.01


def test_posture_leaves_joints_alone_that_do_not_move_the_tool(fake_arm, bound):
    robot = fake_arm()
    robot.tcp = "link_5"  # the last joint turns it in place
    controller = bound(TcpDeltaPosition(), robot)
    robot.write_joint_state(robot.home + 0.3)
    controller.reset(None)
    before = robot.joint_positions.copy()
    command = controller.apply(np.zeros((1, 3)))
    assert np.array_equal(command[:, 5], before[:, 5])
    assert not np.array_equal(command[:, :5], before[:, :5])


@pytest.mark.parametrize("make", [TcpDeltaPosition, TcpDeltaPose])
@pytest.mark.parametrize("value", [-0.1, 1.0, np.nan], ids=repr)
def test_posture_gain_must_be_a_share(make, value):
    with pytest.raises(ConfigurationError, match="posture_gain"):
        make(posture_gain=value)


@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 0, 1), (0, -1, 0), (1, 1, 0)], ids=str)
def test_the_arm_is_still_where_it_is_asked_beyond_its_reach(fake_arm, bound, direction):
    robot = fake_arm()
    controller = bound(TcpDeltaPosition(), robot)
    drive(controller, robot, direction, 80)
    assert np.abs(drive(controller, robot, direction, 1)).max() < 1e-3


def test_the_tool_holds_the_axes_that_an_action_does_not_have(fake_arm, bound):
    robot, whole = fake_arm(), fake_arm()
    reduced, controller = bound(TcpDeltaPose(axes=["x", "z"]), robot), bound(TcpDeltaPose(), whole)
    assert reduced.action_space.shape == (2,)
    drive(reduced, robot, [0.5, -0.25], 5)
    drive(controller, whole, [0.5, 0.0, -0.25, 0.0, 0.0, 0.0], 5)
    assert np.array_equal(robot.joint_positions, whole.joint_positions)


def test_the_target_stays_in_its_box_and_comes_back_at_once(fake_arm, bound):
    robot = fake_arm()
    start = robot.frame_pose("tcp")[0][0]
    low, high = start - 0.1, start + np.array([0.1, 0.1, 0.03])
    controller = bound(TcpDeltaPose(max_delta=0.02, target_low=low.tolist(), target_high=high.tolist()), robot)
    up = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    moved = drive(controller, robot, up, 10) + settle(controller, robot)
    assert moved[:, 2] == pytest.approx(0.03, abs=1e-3)
    back = drive(controller, robot, [0.0, 0.0, -1.0, 0.0, 0.0, 0.0], 1) + settle(controller, robot)
    assert back[:, 2] == pytest.approx(-0.02, abs=1e-3)


def test_interpolated_commands_rise_evenly_to_the_usual_ones(fake_arm, bound):
    smooth, controller = bound(TcpDeltaPose(interpolate=True), fake_arm()), bound(TcpDeltaPose(), fake_arm())
    before = np.zeros((1, 1, 1))
    for i in range(3):
        action = np.tile([0.5, -0.25, 0.1, 0.0, 0.0, 0.3], (len(controller.snapshot()["commanded"]), 1))
        rows, command = smooth.apply(action), controller.apply(action).copy()
        assert rows[:, -1] == pytest.approx(command, abs=1e-12)
        changes = np.diff(rows, axis=1)
        assert changes == pytest.approx(np.repeat(changes[:, :1], changes.shape[1], axis=1), abs=1e-12)
        if i > 0:
            assert rows[:, 0] - before == pytest.approx(changes[:, 0], abs=1e-12)
        before = command


@pytest.mark.parametrize(
    "given", [{"axes": []}, {"axes": ["z", "x"]}, {"axes": ["x", "x"]}, {"axes": ["yaw"]}, {"target_low": [0, 0]},
              {"target_low": [0, 0, 1], "target_high": [1, 1, 1]}], ids=str
)  # fmt: skip
def test_axes_and_boxes_are_checked(given):
    with pytest.raises(ConfigurationError, match=r"axes|target_low"):
        TcpDeltaPose(**given)
