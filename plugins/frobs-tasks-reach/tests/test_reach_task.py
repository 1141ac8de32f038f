from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.util.errors import ConfigurationError, UnknownParameterError
from frobs_tasks_reach.reach import Reach
from frobs_tasks_reach.start import box

REACH = "frobs/Irb120Reach-v0"
IDS = [
    REACH,
    "frobs/Irb120ReachDynamic-v0",
    "frobs/Irb120ReachGoal-v0",
    "frobs/Irb120ReachLegacy-v0",
    "frobs/Irb140ReachVelocity-v0",
    "frobs/Irb140ReachVelocityLegacy-v0",
    "frobs/Ur5ReachDynamic-v0",
]


def parts(observation):
    return observation if isinstance(observation, dict) else {"all": observation}


def test_observation_is_joints_tool_goal_and_offset(make):
    env = make(REACH)
    observation, _ = env.reset(seed=0)
    task, robot = env.unwrapped.task, env.unwrapped.robot
    assert observation.dtype == np.float32
    assert [(row["name"], row["columns"]) for row in env.unwrapped.observations.describe()] == [
        ("joint_positions", [0, 5]),
        ("tcp_position", [6, 8]),
        ("goal", [9, 11]),
        ("goal_offset", [12, 14]),
        ("goal_from_shoulder", [15, 17]),
    ]
    np.testing.assert_allclose(observation[:6], robot.joint_positions[0], atol=1e-6)
    np.testing.assert_allclose(observation[6:9], robot.frame_pose("tcp")[0][0], atol=1e-6)
    env.unwrapped.robot.write_joint_state(np.array([[np.pi / 2, 0.2, 0.2, 0.0, 1.0, 0.0]]))
    task.advance(env.unwrapped.step_context)
    x, y, z = task.goal[0] - robot.frame_pose("tcp")[0][0]
    np.testing.assert_allclose(env.unwrapped.observations.observe()[0, 12:], [x, y, z, y, -x, z], atol=1e-6)
    assert env.unwrapped.observations.scale.tolist() == [1.0] * 6 + [2.0] * 9 + [5.0] * 3
    assert np.isfinite(env.observation_space.low).all()


def test_dense_reward_is_the_sum_of_its_terms_and_of_the_formula(make):
    env = make(REACH, tolerance=0.1, distance_weight=2.0, precision_weight=3.0)
    env.reset(seed=0)
    observation, reward, _, _, info = env.step(env.action_space.sample())
    d = np.linalg.norm(observation[12:15].astype(float))
    np.testing.assert_allclose(reward, -2.0 * d + 3.0 * np.exp(-((d / 0.1) ** 2)), rtol=1e-6)
    assert reward == info["frobs/reward/distance"] + info["frobs/reward/precision"]


def test_holding_a_goal_at_the_tool_is_success_and_ends_nothing(make):
    env = make(REACH, reward_type="sparse")
    env.reset(seed=0, options={"joint_positions": np.array([0.3, 0.2, 0.2, 0.0, 1.0, 0.0])})
    tool = env.unwrapped.robot.frame_pose("tcp")[0][0].copy()
    env.reset(options={"joint_positions": (0.3, 0.2, 0.2, 0.0, 1.0, 0.0), "goal": tool})
    for step in range(50):
        _, reward, terminated, truncated, info = env.step(np.zeros(6, np.float32))
        assert (reward, terminated, truncated, info["is_success"]) == (0.0, False, step == 49, 1.0)


def test_sparse_reward_is_minus_one_outside(make):
    env = make(REACH, reward_type="sparse")
    env.reset(seed=0, options={"goal": (-0.3, 0.2, 0.6)})
    _, reward, _, _, info = env.step(np.zeros(6, np.float32))
    assert (reward, info["is_success"], info["frobs/reward/outside"]) == (-1.0, 0.0, -1.0)


def test_initial_home_starts_at_home(make):
    env = make(REACH)
    observation, _ = env.reset(seed=0)
    np.testing.assert_allclose(observation[:6], env.unwrapped.robot.home[0], atol=1e-6)


@pytest.mark.parametrize("id", IDS)
def test_an_environment_of_a_vector_equals_the_single_one(make, id):
    vector, single = make(id, 7, max_episode_steps=15), make(id, max_episode_steps=15)
    batch, _ = vector.reset(seed=10)
    alone, _ = single.reset(seed=12)
    rng, space = np.random.default_rng(0), vector.single_action_space
    for _ in range(40):
        for name, values in parts(alone).items():
            assert (parts(batch)[name][2] == values).all()
        actions = rng.uniform(space.low, space.high, (7, 6)).astype(np.float32)
        batch, rewards, *_ = vector.step(actions)
        assert vector.observation_space.contains(batch)
        alone, reward, terminated, truncated, _ = single.step(actions[2])
        assert rewards[2] == reward
        if terminated or truncated:
            alone, _ = single.reset()


@pytest.mark.parametrize("id", IDS)
def test_reset_of_some_leaves_the_others_as_they_are(make, id):
    env = make(id, 4, autoreset_mode="Disabled")
    before, _ = env.reset(seed=0)
    mask = np.array([False, True, False, True])
    after, _ = env.reset(options={"reset_mask": mask})
    for name, values in parts(before).items():
        changed = (parts(after)[name] != values).any(axis=1)
        assert changed.tolist() == (mask if name in ("all", "desired_goal") else changed & mask).tolist()


@pytest.mark.parametrize("id", IDS)
def test_a_restored_snapshot_goes_on_with_the_same_bits(make, id):
    env = make(id, 2)
    env.reset(seed=0)
    actions = np.random.default_rng(0).uniform(-1, 1, (12, 2, 6)).astype(np.float32)
    for action in actions[:4]:
        env.step(action)
    snapshot = env.unwrapped.snapshot()
    first = [env.step(action)[:2] for action in actions[4:]]
    env.unwrapped.restore(snapshot)
    second = [env.step(action)[:2] for action in actions[4:]]
    for (observation, reward), (again, reward_again) in zip(first, second, strict=True):
        assert (reward == reward_again).all()
        for name, values in parts(observation).items():
            assert (parts(again)[name] == values).all()


@pytest.mark.parametrize("id", IDS)
def test_given_goal_and_joint_positions_are_observed(make, id):
    env = make(id, 2)
    joints = np.array([[0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [-0.1, 0.0, 0.1, 0.0, 0.3, 1.0]])
    env.reset(seed=0, options={"goal": (0.3, 0.1, 0.4), "joint_positions": joints})
    task = env.unwrapped.task
    np.testing.assert_allclose(task._goal, [[0.3, 0.1, 0.4]] * 2, atol=1e-12)
    np.testing.assert_allclose(env.unwrapped.robot.joint_positions, joints, atol=1e-12)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"joint_positions": (9.0, 0, 0, 0, 0, 0)},
            r"puts 'joint_1' at 9, outside its limits \[-2.87979, 2.87979\]",
        ),
        ({"joint_positions": (0.0, 0.0)}, r"shape \(2,\); it must be \(6,\), with one value for each of joint_1, "),
        ({"goal": (0.0, 5.0, 0.0)}, r"'goal' is \(0, 5, 0\) m, which is out of reach"),
        ({"goal": (0.0, 0.1)}, r"'goal' has the shape \(2,\)"),
    ],
)
def test_options_that_cannot_be_are_refused(make, options, message):
    with pytest.raises(ConfigurationError, match=message):
        make(REACH).reset(seed=0, options=options)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"tolerance": 0.0}, "tolerance is 0.0; it must be above 0"),
        ({"tolerance": "5cm"}, "tolerance is '5cm'; it must be a finite number"),
        ({"goal_low": (0, 0)}, r"goal_low is \(0, 0\); it must be 3 numbers"),
        ({"goal_low": (0, 0, float("nan"))}, r"goal_low\[2\] is nan"),
        (
            {"goal_low": (1, 1, 1), "goal_high": (0.5, 0.5, 1)},
            r"goal_low is \(1.0, 1.0, 1.0\); it must be below goal_high \(0.5, 0.5, 1\)",
        ),
        ({"initial": "Home"}, "initial is 'Home'; it must be 'home' or 'random'"),
        ({"precision_weight": float("inf")}, "precision_weight is inf"),
    ],
)
def test_bad_parameters_are_refused(parameters, message):
    with pytest.raises(ConfigurationError, match=message):
        Reach(**parameters)


def test_an_unknown_parameter_suggests_the_nearest():
    with pytest.raises(UnknownParameterError, match="tolerance"):
        gym.make(REACH, tolerence=0.1)


@pytest.mark.parametrize("id", ["frobs/Irb140Reach-v0", "frobs/Ur5Reach-v0", REACH])
def test_the_camera_sees_where_goals_are(make, id):
    env = make(id, 64)
    env.reset(seed=0)
    camera = env.unwrapped.task.scene().cameras["overview"]
    eye, target = np.array(camera.pos), np.array(camera.target)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    up = np.cross(right / np.linalg.norm(right), forward)
    to_goal = env.unwrapped.task.goal - eye
    height = np.abs((to_goal * up).sum(axis=1) / (to_goal * forward).sum(axis=1))
    assert (height < np.tan(np.radians(camera.fov_y / 2))).mean() > 0.95


def test_markers_show_goal_and_tool(make):
    env = make(REACH, 3)
    env.reset(seed=0)
    goal, tool = env.unwrapped.task.markers()
    assert goal.radius == 0.05
    assert goal.pos.shape == tool.pos.shape == (3, 3)


def test_a_box_has_its_corners_in_order() -> None:
    low, high = box("low", (0, 0, 0), "high", (1, 2, 3))
    assert (high - low).tolist() == [1.0, 2.0, 3.0]
    with pytest.raises(
        ConfigurationError, match=r"low is \(0.0, 3.0, 0.0\); it must be below high \(1, 2, 3\) on every axis"
    ):
        box("low", (0, 3, 0), "high", (1, 2, 3))
