from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from frobs_core.util.errors import ConfigurationError, SimulationError, UnknownNameError
from frobs_tasks_navigation import terms

ROOM = {
    "walls": {"pieces": [{"from": [2, -3], "to": [2, 3]}]},
    "start": {"pos": [0, 0], "yaw": 0},
    "routes": [[[0.8, 0], [0.8, 1.5], [0, 1.5]]],
}
SIMULATORS = [
    "mujoco",
    "pybullet",
]


def drive_to(env: Any) -> np.ndarray:
    """Return an action that drives towards the way-point."""
    task = env.unwrapped.task
    offset = task._course.target - env.unwrapped.robot.base_pose[0][:, :2]
    angle = terms.bearing(offset, terms.yaw_of(env.unwrapped.robot.base_pose[1]))
    return np.stack([np.clip(1.0 - np.abs(angle), 0.0, 1.0), np.clip(1.5 * angle, -1.0, 1.0)], axis=-1)


@pytest.mark.parametrize("simulator", SIMULATORS)
def test_a_route_is_driven_way_point_by_way_point(make, simulator):
    env = make("frobs/Navigate-v0", robot="kobuki", floor_plan=ROOM, tolerance=0.3, simulator=simulator)
    env.reset(seed=0)
    passed, infos = 0, []
    for _ in range(150):
        _, reward, terminated, _, info = env.step(drive_to(env)[0])
        terms_ = {name: value for name, value in info.items() if name.startswith("frobs/reward/")}
        assert reward == pytest.approx(sum(terms_.values()))
        passed += info["frobs/reward/way_point"] > 0
        infos.append(info)
        if terminated:
            break
    assert passed == 2
    assert info["is_success"] == 1.0
    assert info["frobs/reward/goal"] == 10.0
    assert sum(i["is_success"] for i in infos) == 1.0


@pytest.mark.parametrize("simulator", SIMULATORS)
def test_bumping_into_a_wall_ends_the_episode(make, simulator):
    env = make("frobs/Navigate-v0", robot="kobuki", floor_plan=ROOM, simulator=simulator)
    env.reset(seed=0, options={"goal": (5.0, 0.0)})
    for _ in range(40):
        _, _, terminated, _, info = env.step(np.array([1.0, 0.0]))
        if terminated:
            break
    assert terminated
    assert info["frobs/reward/collision"] == -15.0
    assert info["is_success"] == 0.0
    assert env.unwrapped.robot.base_pose[0][0, 0] == pytest.approx(2.0 - 0.075 - 0.178, abs=0.1)


def test_bumping_may_only_cost(make):
    env = make("frobs/Navigate-v0", robot="kobuki", floor_plan=ROOM, collision_ends=False, collision_penalty=1.0)
    env.reset(seed=0, options={"goal": (5.0, 0.0)})
    rewards = [env.step(np.array([1.0, 0.0]))[1:3] for _ in range(40)]
    assert not any(terminated for _, terminated in rewards)
    assert sum(reward < -0.9 for reward, _ in rewards) > 5


def test_leaving_the_area_ends_the_episode(make):
    plan = {**ROOM, "area": {"low": [-1, -3], "high": [3, 3]}}
    env = make("frobs/Navigate-v0", robot="kobuki", floor_plan=plan, observation=("position",))
    env.reset(seed=0)
    for _ in range(30):
        observation, _, terminated, _, info = env.step(np.array([-1.0, 0.0]))
        if terminated:
            break
    assert terminated
    assert info["frobs/reward/collision"] == -15.0
    assert -1.4 < observation[0] < -1.0


def test_the_mazes_observation_is_its_fifteen_numbers(make):
    env = make("frobs/KobukiMaze-v0")
    observation, _ = env.reset(seed=1)
    assert observation.shape == (15,)
    distance, bearing, x, y, yaw, way_x, way_y, *nearness = observation.tolist()
    assert (x, y, way_x, way_y) == pytest.approx((-5.0, 7.5, -8.5, 0.0), abs=1e-3)
    assert distance == pytest.approx(np.hypot(way_x - x, way_y - y), abs=1e-3)
    difference = np.arctan2(way_y - y, way_x - x) - yaw - bearing
    assert np.cos(difference) == pytest.approx(1.0)
    ranges = env.unwrapped.robot.lidar("lidar")[0]
    assert 0.1 < ranges.min() < ranges.max() < 30.0
    assert nearness == pytest.approx(1.0 / (1.0 + ranges))
    assert env.observation_space.contains(observation)


def test_the_lidar_sees_boxes_where_they_are(make):
    plan = {
        "start": {"pos": [0, 0], "yaw": 0},
        "routes": [[[9, 9]]],
        "boxes": [{"pos": [3, 0], "size": [1, 1, 0.5], "yaw": 0, "max_speed": 0.5, "turn_every": 100}],
    }
    env = make("frobs/Navigate-v0", robot="kobuki", floor_plan=plan, observation=("lidar",))
    first, _ = env.reset(seed=3)
    assert first[4] == pytest.approx(2.5, abs=0.01)  # the fifth of eight rays looks ahead
    for _ in range(10):
        last = env.step(np.zeros(2))[0]
    speed = env.unwrapped.task._boxes._velocity[0, 0, 0]
    assert speed > 0.01
    assert last[4] - first[4] == pytest.approx(2.0 * speed, abs=0.02)


def test_boxes_differ_between_episodes_and_repeat_with_the_seed(make):
    env = make("frobs/KobukiMaze-v0")
    boxes = env.unwrapped.task._boxes
    seen = []
    for seed in (0, None, 0):
        env.reset(seed=seed)
        seen.append((boxes.yaw.copy(), boxes._velocity.copy()))
    assert (seen[0][0] != seen[1][0]).all()
    assert (seen[0][0] == seen[2][0]).all()
    assert (seen[0][1] == seen[2][1]).all()


def test_all_routes_of_the_maze_are_drawn(make):
    env = make("frobs/KobukiMaze-v0", num_envs=64)
    env.reset(seed=0)
    ends = {tuple(way[-1]) for way in env.unwrapped.task._course.way}
    assert ends == {(3.0, 0.0), (-8.5, -11.5), (-8.7, -7.0), (0.0, -2.0)}


def test_goals_keep_clear_of_walls_boxes_and_the_start(make):
    plan = {
        "walls": {"pieces": [{"from": [1, -2], "to": [1, 2], "thickness": 0.2}]},
        "boxes": [{"pos": [-1, 0], "size": [1.5, 0.3, 0.5], "yaw": 90}],
        "start": {"pos": [0, 0]},
        "goals": {"low": [-2, -2], "high": [2, 2]},
    }
    env = make("frobs/Navigate-v0", robot="kobuki", floor_plan=plan, tolerance=0.2, num_envs=256)
    env.reset(seed=0)
    goals = env.unwrapped.task._course.target
    assert np.abs(goals[:, 0] - 1.0).min() >= 0.6 - 1e-9
    assert terms.distance(goals).min() >= 0.9 - 1e-9
    box = terms.distance_to_rectangles(goals[:, None], np.array([[-1.0, 0.0]]), np.zeros(1), np.array([[0.15, 0.75]]))
    assert box.min() >= 0.5 - 1e-9


def test_a_given_start_and_goal_are_taken(make):
    env = make("frobs/KobukiEmpty-v0")
    observation, _ = env.reset(seed=0, options={"start": (1.0, 2.0, np.pi / 2), "goal": (1.0, 5.0)})
    assert observation == pytest.approx([3.0, 0.0], abs=1e-3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"goal": (99.0, 0.0)}, "outside the floor plan's area"),
        ({"goal": (1.0, 2.0, 3.0)}, "expected the shape .2,."),
        ({"start": (1.0, 2.0)}, "expected the shape .3,."),
        ({"start": (1.0, 99.0, 0.0)}, "outside the floor plan's area"),
    ],
)
def test_an_impossible_start_or_goal_is_refused(make, options, message):
    with pytest.raises(ConfigurationError, match=message):
        make("frobs/KobukiEmpty-v0").reset(options=options)


def test_the_sparse_reward_is_for_the_goal_alone(make):
    env = make("frobs/KobukiEmpty-v0", reward_type="sparse")
    env.reset(seed=0, options={"start": (0.0, 0.0, 0.0), "goal": (1.0, 0.0)})
    rewards = []
    for _ in range(20):
        _, reward, terminated, _, _ = env.step(np.array([1.0, 0.0]))
        rewards.append(reward)
        if terminated:
            break
    assert rewards == [0.0] * (len(rewards) - 1) + [1.0]


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"observation": ("distanse",)}, UnknownNameError, "'distance'"),
        ({"observation": ()}, ConfigurationError, "at least one"),
        ({"observation": "distance"}, ConfigurationError, "observation is 'distance'; it must be a list of names"),
        ({"observation": None}, ConfigurationError, "observation is None; it must be a list of names"),
        ({"observation": [1]}, UnknownNameError, "no term of the observation is named '1'"),
        ({"floor_plan": 5}, ConfigurationError, "floor_plan is 5; it must be the name of a built-in plan"),
        ({"lidar": None}, UnknownNameError, "Available: lidar"),
        ({"observation": ("yaw", "yaw")}, ConfigurationError, "without duplicates"),
        ({"tolerance": 0.0}, ConfigurationError, "tolerance"),
        ({"time_penalty": -1.0}, ConfigurationError, "time_penalty"),
        ({"collision_ends": 1}, ConfigurationError, "collision_ends"),
        ({"lidar": "scan"}, UnknownNameError, "Available: lidar"),
        ({"bumper": "bump"}, UnknownNameError, "'bumper'"),
    ],
)
def test_impossible_parameters_are_refused(make, parameters, error, message):
    with pytest.raises(error, match=message):
        make("frobs/Navigate-v0", robot="kobuki", **parameters)


def test_an_arm_cannot_drive(make):
    with pytest.raises(ConfigurationError):
        make("frobs/Navigate-v0", robot="irb120", controller="joint_velocity", bumper="link_1")


@pytest.mark.parametrize("simulator", SIMULATORS)
def test_many_bodies_are_moved_in_one_call(make, simulator):
    env = make("frobs/KobukiMaze-v0", num_envs=3, simulator=simulator, num_threads=1)
    env.reset(seed=0)
    sim = env.unwrapped.simulation
    mask = np.array([True, False, True])
    before = sim.bodies["box_1"].pose[0].copy()
    pos = np.arange(12.0).reshape(2, 2, 3) * 0.1
    turned = np.broadcast_to(terms.quat_of(np.array([0.3, 0.6])), (2, 2, 4))
    sim.write_body_poses(["box_0", "box_1"], pos, turned, mask)
    for k, name in enumerate(("box_0", "box_1")):
        found = sim.bodies[name].pose
        assert found[0][mask] == pytest.approx(pos[:, k])
        assert found[1][mask] == pytest.approx(turned[:, k])
    assert (sim.bodies["box_1"].pose[0][1] == before[1]).all()
    with pytest.raises(SimulationError, match="'wall_0' is static"):
        sim.write_body_poses(["box_0", "wall_0"], pos, None, mask)


def test_a_thousand_robots_drive_together(make):
    env = make("frobs/KobukiMaze-v0", num_envs=1024)
    env.reset(seed=0)
    for _ in range(3):
        observation, reward, *_ = env.step(env.action_space.sample())
    assert observation.shape == (1024, 15)
    assert np.isfinite(reward).all()
    assert len(np.unique(observation[:, 7:], axis=0)) == 1024
