"""Observation terms that the keyword ``observations`` adds."""

from __future__ import annotations

import numpy as np
import pytest

from frobs_core.description import Imu, Robot
from frobs_core.kernel.config import EnvConfig
from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.util.errors import ConfigurationError, UnknownNameError

REACH = {"task": "reach", "robot": "irb120", "controller": "joint_delta_position", "num_threads": 1}
TERMS = {
    "efforts": {"type": "joint_efforts"},
    "speeds": {"type": "joint_velocities", "robot": "robot"},
    "tool": {"type": "tcp_pose"},
    "last": {"type": "previous_action"},
}


@pytest.fixture(params=["mujoco", "pybullet"])
def simulator(request):
    return request.param


def test_vectors_follow_those_of_the_task(simulator):
    env = RobotEnv(**REACH, simulator=simulator, observations=TERMS)
    plain = RobotEnv(**REACH, simulator=simulator)
    (observation, _), (before, _) = env.reset(seed=0), plain.reset(seed=0)
    assert observation.shape == (18 + 6 + 6 + 7 + 6,)
    assert (observation[:18] == before).all()
    assert (observation[-6:] == 0.0).all()
    action = np.linspace(-2.0, 0.5, 6)
    observation = env.step(action)[0]
    assert (observation[:18] == plain.step(action)[0]).all()
    robot = env.robot
    assert observation[18:24] == pytest.approx(robot.joint_efforts[0], rel=1e-6)
    assert observation[24:30] == pytest.approx(robot.joint_velocities[0], rel=1e-6)
    assert observation[30:33] == pytest.approx(robot.frame_pose("tcp")[0][0], rel=1e-6)
    assert observation[-6:] == pytest.approx(np.clip(action, -1.0, 1.0))
    assert env.observations.columns["last"] == ("observation", slice(37, 43))
    env.close()
    plain.close()


def test_a_vector_equals_single_environments_and_continues_from_a_snapshot():
    robot = Robot(
        model="frobs_robots_abb:models/irb120.urdf.xacro",
        tcp="tool0",
        sensors={"imu": Imu(frame="tool0", noise=0.1)},
    )
    keywords = {**REACH, "robot": robot, "observations": {**TERMS, "imu": {"type": "sensor", "sensor": "imu"}}}
    env = RobotVectorEnv(num_envs=3, max_episode_steps=4, **keywords)
    single = RobotEnv(**keywords)
    batch, _ = env.reset(seed=5)
    alone, _ = single.reset(seed=6)
    actions = np.random.default_rng(0).uniform(-1, 1, (9, 3, 6))
    assert (batch[1] == alone).all()
    for k, action in enumerate(actions[:6]):
        batch = env.step(action)[0]
        alone = single.step(action[1])[0]
        if k == 3:
            alone, _ = single.reset()
        assert (batch[1] == alone).all()
    state = env.snapshot()
    expected = [env.step(action)[0] for action in actions[6:]]
    env.restore(state)
    assert all((env.step(action)[0] == before).all() for action, before in zip(actions[6:], expected, strict=True))
    env.close()
    single.close()


@pytest.mark.needs("rendering", on="mujoco")
def test_cameras_have_keys_of_their_own(simulator):
    cameras = {
        "picture": {"camera": "overview", "size": [12, 16]},
        "distance": {"camera": "overview", "size": [12, 16], "modality": "depth"},
    }
    env = RobotVectorEnv(
        num_envs=2, **REACH, simulator=simulator, observations={**cameras, "tool": {"type": "tcp_pose"}}
    )
    observation, _ = env.reset(seed=0)
    assert env.observation_space.contains(observation)
    assert {key: (value.shape, value.dtype.name) for key, value in observation.items()} == {
        "observation": ((2, 25), "float32"),
        "picture": ((2, 12, 16, 3), "uint8"),
        "distance": ((2, 12, 16, 1), "float32"),
    }
    assert np.ptp(observation["picture"]) > 0
    kept = observation["picture"].copy()
    for _ in range(3):
        env.step(np.ones((2, 6)))
    assert (observation["picture"] == kept).all()
    env.close()


@pytest.mark.needs("rendering")
@pytest.mark.parametrize(("quality", "fast"), [({}, True), ({"fast": False}, False)])
def test_one_fast_call_draws_all_environments(quality, fast):
    env = RobotVectorEnv(num_envs=3, **REACH, observations={"picture": {"camera": "overview", **quality}})
    calls, draw = [], env.simulation.render

    def render(*args, **keywords):
        calls.append((args[0], keywords["fast"]))
        return draw(*args, **keywords)

    env.simulation.render = render
    assert env.reset(seed=0)[0]["picture"].shape == (3, 84, 84, 3)
    calls.clear()
    env.step(np.zeros((3, 6)))
    assert calls == [(None, fast)]
    env.close()


@pytest.mark.needs("rendering", on="mujoco")
def test_markers_are_drawn_where_they_are_asked_for(simulator):
    goal = [0.35, 0.0, 0.4]
    eye = {"camera": "overview", "size": [48, 64]}
    env = RobotEnv(
        **REACH, simulator=simulator, tolerance=0.1, observations={"plain": eye, "marked": {**eye, "markers": True}}
    )
    observation, _ = env.reset(seed=0, options={"goal": goal})
    changed = (observation["plain"] != observation["marked"]).any(axis=-1)
    assert 10 < changed.sum() < changed.size / 3
    env.close()


def test_added_terms_can_have_noise():
    noisy = {"observation_noise": {"speeds": {"normal": 0.1}}}
    env = RobotVectorEnv(num_envs=2, **REACH, observations=TERMS, randomize=noisy)
    seen = env.reset(seed=0)[0]
    true = env.observations.observe()
    assert (seen[:, 24:30] != true[:, 24:30]).all()
    assert (np.delete(seen, range(24, 30), 1) == np.delete(true, range(24, 30), 1)).all()
    env.close()


def test_noise_in_two_places_is_rejected():
    robot = Robot(
        model="frobs_robots_abb:models/irb120.urdf.xacro", tcp="tool0", sensors={"imu": Imu(frame="tool0", noise=0.1)}
    )
    with pytest.raises(ConfigurationError, match="either for the sensor or in randomize"):
        RobotEnv(
            **{**REACH, "robot": robot},
            observations={"imu": {"type": "sensor", "sensor": "imu"}},
            randomize={"observation_noise": {"imu": {"normal": 0.1}}},
        )


@pytest.mark.parametrize(
    ("term", "message"),
    [
        ({"type": "joint_position"}, "Did you mean 'joint_positions'"),
        ({"type": "tcp_pose", "robott": "x"}, "Did you mean 'robot'"),
        ({"type": "body", "body": "cube"}, "no body"),
        ({"type": "tcp_pose", "robot": "left"}, "no robot"),
        ({"type": "contact", "contact": "floor"}, "no contact"),
        ({"type": "sensor", "sensor": "lidar"}, "no sensor"),
        ({"camera": "overwiew"}, "Did you mean 'overview'"),
        ({"camera": "overview", "modality": "normals"}, "rgb"),
        ({"camera": "overview", "size": [0, 4]}, "height, width"),
        ({"camera": "overview", "markers": 1}, "true or false"),
        ({"camera": "overview", "fast": "yes"}, "true or false"),
        ({"type": "body"}, "observations.x needs body; write the name of a body"),
        ("joint_positions", "must be a mapping"),
    ],
)
def test_errors_name_what_exists(term, message):
    with pytest.raises((ConfigurationError, UnknownNameError), match=message):
        RobotEnv(**REACH, observations={"x": term})


def test_a_name_of_the_task_is_taken():
    with pytest.raises(ConfigurationError, match="already a term of the task"):
        RobotEnv(**REACH, observations={"goal": {"type": "tcp_pose"}})


def test_none_drops_terms_of_the_task():
    env = RobotEnv(**REACH, observations={"goal_offset": None, "tool": {"type": "tcp_pose"}})
    assert list(env.observations.terms) == ["joint_positions", "tcp_position", "goal", "goal_from_shoulder", "tool"]
    assert env.reset(seed=0)[0].shape == (18 - 3 + 7,)
    env.close()
    env = RobotEnv(**REACH, observations={"*": None, "eye": {"camera": "overview", "size": [8, 8]}})
    assert list(env.observation_space) == ["eye"]
    env.close()
    for others in ({}, {"*": None}):
        with pytest.raises(UnknownNameError, match="Did you mean 'goal_offset'"):
            RobotEnv(**REACH, observations={**others, "goal_offse": None})


def test_goals_of_a_goal_conditioned_task_stay():
    keywords = {**REACH, "task": "reach_goal"}
    env = RobotEnv(**keywords, observations={"*": None, "tool": {"type": "tcp_pose"}})
    assert {key: space.shape for key, space in env.observation_space.items()} == {
        "achieved_goal": (3,),
        "desired_goal": (3,),
        "observation": (7,),
    }
    env.close()
    with pytest.raises(ConfigurationError, match="goal-conditioned"):
        RobotEnv(**keywords, observations={"desired_goal": None})


def test_they_are_plain_data():
    config = EnvConfig.from_dict({**REACH, "observations": TERMS})
    assert EnvConfig.from_dict(config.to_dict()) == config
