"""What holds for each controller of this distribution."""

import json

import gymnasium as gym
import numpy as np
import pytest

from frobs_controllers.plugin import frobs_controllers

RECORDS = {record.name: record for record in frobs_controllers()}
CASES = [(name, {}) for name in RECORDS if name != "discrete"]
CASES += [("joint_delta_position", {"full_range": True})]
CASES += [("differential_drive", {"max_linear_acceleration": 0.5, "max_angular_acceleration": 2.0})]
CASES += [("discrete", {"controller": RECORDS["tcp_delta_position"]})]


@pytest.fixture(params=CASES, ids=[f"{name} {' '.join(parameters)}".strip() for name, parameters in CASES])
def case(request, fake_arm, fake_cart, fake_gripper, bound):
    name, parameters = request.param

    def make(num_envs):
        if name == "differential_drive":
            robot = fake_cart(num_envs, wheel_velocity=20.0)
        else:
            robot = fake_gripper(num_envs) if name.startswith("gripper") else fake_arm(num_envs, share=0.5)
        return bound(RECORDS[name].load()(**parameters), robot), robot

    return make


def actions(controller, num_envs, steps, seed=0):
    space, rng = controller.action_space, np.random.default_rng(seed)
    if isinstance(space, gym.spaces.Discrete):
        return rng.integers(0, space.n, (steps, num_envs))
    return rng.uniform(1.2 * space.low, 1.2 * space.high, (steps, num_envs, *space.shape))


def run(controller, robot, all_actions):
    commands = []
    for action in all_actions:
        commands.append(controller.apply(action).copy())
        robot.command(commands[-1])
        robot.step()
    return np.stack(commands)


def test_commands_are_finite_and_of_the_right_shape(case):
    controller, robot = case(3)
    commands = run(controller, robot, actions(controller, 3, 50))
    assert commands.shape == (50, 3, robot.dof)
    assert np.isfinite(commands).all()


def test_the_action_is_left_as_it_is(case):
    controller, _ = case(2)
    action = actions(controller, 2, 1)[0]
    before = action.copy()
    controller.apply(action)
    assert np.array_equal(action, before)


def test_each_environment_of_many_equals_the_single_one_bit_for_bit(case):
    controller, robot = case(7)
    all_actions = actions(controller, 7, 60)
    together = run(controller, robot, all_actions)
    for i in range(7):
        single, its_robot = case(1)
        assert np.array_equal(run(single, its_robot, all_actions[:, i : i + 1])[:, 0], together[:, i])


def test_a_restored_snapshot_continues_bit_for_bit(case):
    controller, robot = case(2)
    all_actions = actions(controller, 2, 40)
    run(controller, robot, all_actions[:20])
    state, positions = controller.snapshot(), robot.joint_positions.copy()
    assert all(len(array) == 2 for array in state.values())
    expected = run(controller, robot, all_actions[20:])
    other, its_robot = case(2)
    its_robot.write_joint_state(positions)
    other.restore(state)
    assert np.array_equal(run(other, its_robot, all_actions[20:]), expected)


def test_reset_forgets_in_the_masked_environments_only(case):
    controller, robot = case(3)
    run(controller, robot, actions(controller, 3, 20))
    before = controller.snapshot()
    mask = np.array([True, False, True])
    robot.write_joint_state(robot.home[mask], mask=mask)
    controller.reset(mask)
    after, (fresh, _) = controller.snapshot(), case(3)
    for name, start in fresh.snapshot().items():
        assert np.array_equal(after[name][mask], start[mask])
        assert np.array_equal(after[name][~mask], before[name][~mask])


def test_the_law_can_be_written_as_json(case):
    controller, robot = case(2)
    law = controller.law()
    assert json.loads(json.dumps(law)) == law
    if law:
        assert law["law"] in RECORDS
        assert law["joints"] == list(robot.joint_names)
