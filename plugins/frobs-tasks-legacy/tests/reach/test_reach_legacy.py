from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.util.errors import ConfigFileError, ConfigurationError, UnknownNameError
from frobs_tasks_legacy.reach.config import FILES
from frobs_tasks_legacy.reach.task import ReachLegacy
from frobs_tasks_legacy.reach.velocity import ReachLegacyVelocity

LEGACY = "frobs/Irb120ReachLegacy-v0"
VELOCITY = "frobs/Irb140ReachVelocityLegacy-v0"
SHIPPED = Path(str(files("frobs_tasks_legacy"))) / "reach" / "tasks" / "irb120.yaml"
IRB140_LOWER = np.array([-3.14159, -1.5708, -4.01426, -3.49066, -2.0071, -6.98132])
IRB140_UPPER = np.array([3.14159, 1.91986, 0.872665, 3.49066, 2.0071, 6.98132])
LEGACY_RANGE = (IRB140_UPPER + IRB140_LOWER) / 2, (IRB140_UPPER - IRB140_LOWER) / 2
LOWER = np.array([-2.87979, -1.91986, -1.91986, -2.79253, -2.094395, -6.98132])
UPPER = np.array([2.87979, 1.91986, 1.22173, 2.79253, 2.094395, 6.98132])
STILL = (-(UPPER + LOWER) / (UPPER - LOWER)).astype(np.float32)  # what stands for a delta of 0


@pytest.fixture
def config_file(tmp_path):
    """Write the shipped task YAML with changes: (what to find, what to put in its place)."""

    def write(*changes):
        text = SHIPPED.read_text("utf-8")
        for find, put in changes:
            text, count = re.subn(find, put, text)
            assert count == 1
        path = tmp_path / "reacher_task.yaml"
        path.write_text(text, "utf-8")
        return path

    return write


def test_observation_is_direction_goal_and_joints(make):
    env = make(LEGACY)
    joints = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    observation, _ = env.reset(seed=0, options={"goal": (0.3, 0.1, 0.4), "joint_positions": joints})
    tool = env.unwrapped.robot.frame_pose("tcp")[0][0]
    offset = np.array([0.3, 0.1, 0.4]) - tool
    np.testing.assert_allclose(observation, [*offset / np.linalg.norm(offset), 0.3, 0.1, 0.4, *joints], atol=1e-6)


def test_direction_is_zero_at_the_goal_not_nan(make):
    env = make(LEGACY)
    env.reset(seed=0, options={"joint_positions": np.zeros(6)})
    tool = env.unwrapped.robot.frame_pose("tcp")[0][0].copy()
    observation, _ = env.reset(options={"joint_positions": np.zeros(6), "goal": tool})
    assert observation[:3].tolist() == [0.0, 0.0, 0.0]


def test_reaching_the_goal_pays_ten_and_terminates(make):
    env = make(LEGACY)
    env.reset(seed=0, options={"joint_positions": np.zeros(6), "goal": (0.374, 0.0, 0.63)})
    _, reward, terminated, _, info = env.step(STILL)
    assert (reward, terminated, info["is_success"]) == (10.0, True, 1.0)


def test_away_from_the_goal_the_distance_and_the_step_are_paid_for(make):
    env = make(LEGACY)
    env.reset(seed=0, options={"joint_positions": np.zeros(6), "goal": (-0.3, 0.1, 0.4)})
    _, reward, terminated, _, info = env.step(STILL)
    np.testing.assert_allclose(reward, -env.unwrapped.task.distance[0] - 0.01, rtol=1e-12)
    assert not terminated
    assert info["frobs/reward/joint_limits"] == 0.0


def test_an_action_is_a_delta_over_the_full_range_that_ends_at_the_limit_with_a_penalty(make):
    env = make(LEGACY)
    env.reset(seed=0, options={"joint_positions": np.zeros(6), "goal": (-0.3, 0.1, 0.4)})
    action = STILL.copy()
    action[5] = 1.0
    env.step(action)
    _, _, _, _, info = env.step(action)
    np.testing.assert_allclose(env.unwrapped.robot.joint_positions[0, 5], 6.98132, atol=1e-3)
    assert info["frobs/reward/joint_limits"] == -5.0


def test_a_moving_goal_never_terminates_and_is_success_inside(make):
    params = {f"{axis}_max_amplitude": 0.1 for axis in "xyz"} | {f"{axis}_max_freq": 0.5 for axis in "xyz"}
    env = make(LEGACY, pos_dynamic=True, pos_dynamic_params=params, tolerance_goal_pos=1.0)
    start, _ = env.reset(seed=0, options={"goal": (0.3, 0.1, 0.4)})
    observation, _, terminated, _, info = env.step(STILL)
    assert (terminated, info["is_success"], info["frobs/reward/reached_goal"]) == (False, 1.0, 10.0)
    assert (observation[3:6] != start[3:6]).all()


def test_without_training_the_goal_must_be_given(make):
    env = make(LEGACY, training=False)
    with pytest.raises(ConfigurationError, match="a task with training = false needs a goal"):
        env.reset(seed=0)
    env.reset(seed=0, options={"goal": (0.3, 0.1, 0.4)})


def test_a_task_file_of_frobs_rl_is_read_and_keywords_go_before_it(config_file):
    path = config_file((r"tolerance_goal_pos: 0\.05", "tolerance_goal_pos: 0.01"), (r"reward: -5\.0", "reward: -1"))
    task = ReachLegacy(config_file=path, step_reward=-0.5)
    assert task.tolerance == 0.01
    assert task.config["joint_limits_reward"] == -1.0
    assert task.config["step_reward"] == -0.5
    assert task.goal_high.tolist() == [0.5, 0.5, 1.0]


def test_the_shipped_file_is_the_default():
    assert ReachLegacy(config_file=str(SHIPPED)).config == ReachLegacy().config
    assert ReachLegacy().config["reached_goal_reward"] == 10.0


@pytest.mark.parametrize(
    ("find", "put", "message"),
    [
        (
            "step_reward:",
            "step_rewrad:",
            r"reacher_task.yaml:\d+: unknown key 'step_rewrad'. Did you mean 'step_reward'",
        ),
        (r"irb120:", "irb140:", r"reacher_task.yaml:\d+: unknown key 'irb140'; the file must contain 'irb120:'"),
        (r"pos: 0\.05", "pos: -1", r"reacher_task.yaml:\d+: tolerance_goal_pos is -1; it must be above 0"),
        (r"x_max_freq: 0.01 ", "x_max_frequency: 0.01 ", r"reacher_task.yaml:\d+: the keys of pos_dynamic_params"),
        (r"training: true", "training: 1", r"reacher_task.yaml:\d+: training is 1; it must be true or false"),
        (
            r"position_goal_min: .*",
            "position_goal_min: {x: 1}",
            r"reacher_task.yaml:\d+: the keys of position_goal_min",
        ),
    ],
)
def test_a_mistake_in_the_file_is_named_with_its_line(config_file, find, put, message):
    with pytest.raises(ConfigFileError, match=message):
        ReachLegacy(config_file=config_file((find, put)))


@pytest.mark.parametrize("profile", FILES.roots)
def test_each_reacher_of_frobs_rl_has_its_values_and_reads_its_file(profile):
    file = SHIPPED.with_name(f"{profile}.yaml")
    cls = ReachLegacyVelocity if profile == "irb140_velocity" else ReachLegacy
    assert cls(profile=profile).config == cls(profile=profile, config_file=str(file)).config
    assert set(cls(profile=profile).config) == set(FILES.used)


def test_a_file_of_another_arm_is_refused():
    with pytest.raises(ConfigFileError, match=r"ur5.yaml:2: unknown key 'ur5'; the file must contain 'irb140:'"):
        ReachLegacy(profile="irb140", config_file=str(SHIPPED.with_name("ur5.yaml")))


def test_an_unknown_profile_suggests_the_nearest():
    with pytest.raises(UnknownNameError, match="irb140"):
        ReachLegacy(profile="irb_140")


def test_the_irb140_pays_what_frobs_rl_paid(make):
    env = make("frobs/Irb140ReachLegacy-v0")
    env.reset(seed=0, options={"joint_positions": np.zeros(6), "goal": (-0.3, 0.1, 0.4)})
    middle, half = LEGACY_RANGE
    _, reward, terminated, _, _ = env.step((-middle / half).astype(np.float32))
    task = env.unwrapped.task
    np.testing.assert_allclose(reward, -100.0 * task.distance[0] - 1.0, rtol=1e-9)
    assert (terminated, task.tolerance) == (False, 0.1)


def test_the_ur5_draws_goals_in_its_own_box(make):
    env = make("frobs/Ur5ReachLegacy-v0", 64)
    env.reset(seed=0)
    goal = env.unwrapped.task.goal
    assert ((goal >= (0.0, -0.5, 0.2)) & (goal <= (0.7, 0.5, 1.0))).all()


def test_by_velocities_an_action_is_a_fifth_of_a_radian_per_second(make):
    env = make(VELOCITY)
    joints = np.array([0.0, 0.2, 0.1, 0.0, 1.2, 0.0])
    env.reset(seed=0, options={"joint_positions": joints})
    for _ in range(10):
        env.step(np.array([1.0, 0, 0, 0, 0, 0], np.float32))
    np.testing.assert_allclose(env.unwrapped.robot.joint_positions[0, 0], 0.2, rtol=0.05)


def test_by_velocities_the_observation_begins_with_the_joints(make):
    env = make(VELOCITY)
    joints = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    observation, _ = env.reset(seed=0, options={"goal": (0.3, 0.1, 0.4), "joint_positions": joints})
    offset = np.array([0.3, 0.1, 0.4]) - env.unwrapped.robot.frame_pose("tcp")[0][0]
    np.testing.assert_allclose(observation, [*joints, 0.3, 0.1, 0.4, *offset / np.linalg.norm(offset)], atol=1e-6)


def test_by_velocities_limits_cost_ten_from_afar_and_nothing_terminates(make):
    env = make(VELOCITY, pos_dynamic=False)
    near = np.array([0.0, 0.0, 0.0, 0.0, 2.0071 - 0.05, 0.0])
    env.reset(seed=0, options={"joint_positions": near, "goal": (-0.3, 0.1, 0.4)})
    _, reward, terminated, _, info = env.step(np.zeros(6, np.float32))
    np.testing.assert_allclose(reward, -env.unwrapped.task.distance[0] - 10.0, rtol=1e-9)
    assert info["frobs/reward/joint_limits"] == -10.0
    tool = env.unwrapped.robot.frame_pose("tcp")[0][0].copy()
    env.reset(options={"joint_positions": near, "goal": tool})
    _, reward, terminated, _, info = env.step(np.zeros(6, np.float32))
    assert (reward, terminated, info["is_success"]) == (90.0, False, 1.0)


@pytest.mark.parametrize(("limits", "paid"), [("reachable", -10.0), ("configured", 0.0)])
def test_limits_are_watched_where_the_joints_end_or_as_they_are_configured(make, limits, paid):
    env = make(VELOCITY, limits=limits)
    joints = np.array([0.0, 0.0, 0.82, 0.0, 0.0, 0.0])  # joint 3 ends at 0.87 rad, and the configuration says 2.44 rad
    env.reset(seed=0, options={"joint_positions": joints})
    assert env.step(np.zeros(6, np.float32))[4]["frobs/reward/joint_limits"] == paid


def test_the_margin_of_the_limits_can_be_given(make):
    env = make(VELOCITY, limit_margin=0.3)
    env.reset(seed=0, options={"joint_positions": np.array([0.0, 0.0, 0.0, 0.0, 2.0071 - 0.2, 0.0])})
    assert env.step(np.zeros(6, np.float32))[4]["frobs/reward/joint_limits"] == -10.0


def test_goals_fill_the_whole_box_and_episodes_begin_anywhere(make):
    box = {"position_goal_min": (1.9, 1.9, 1.9), "position_goal_max": (2.0, 2.0, 2.0)}  # out of reach
    with pytest.raises(ConfigurationError, match="cannot reach any part"):
        make(VELOCITY, **box)
    low, high = (-0.5, -0.5, 0.0), (2.0, 2.0, 2.0)
    env = make(VELOCITY, 64, position_goal_min=low, position_goal_max=high, goals="box", initial="random")
    env.reset(seed=0)
    goal = env.unwrapped.task.goal
    assert ((goal >= low) & (goal <= high)).all()
    assert (goal > 1.5).any(axis=0).all()
    assert (np.ptp(env.unwrapped.robot.joint_positions, axis=0) > 1.0).all()


@pytest.mark.parametrize("keyword", ["limits", "goals", "initial"])
def test_a_choice_that_there_is_not_is_refused(keyword):
    with pytest.raises(ConfigurationError, match=f"{keyword} is .*'"):
        ReachLegacyVelocity(**{keyword: "other"})


def test_joint_positions_of_another_arm_are_refused():
    with pytest.raises(
        ConfigurationError, match=r"min_joint_pos is .*; it must be 6 numbers, one for each joint of robot 'irb120'"
    ):
        gym.make(LEGACY, min_joint_pos=(-1.0, -1.0))
