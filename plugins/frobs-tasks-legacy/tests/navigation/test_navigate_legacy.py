from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from frobs_core.util.errors import ConfigFileError, ConfigurationError, UnknownNameError
from frobs_tasks_legacy.navigation.config import FILES

FROBS_RL = """
kobuki_maze:
  action_space: 2
  observation_space: 15
  lidar_samples: 8
  time_step: 0.01
  update_rate_multiplier: 10
  tolerance_goal_pos: 0.5
  step_reward: 0.0
  multiplier_dist_reward: 10.0
  angle_diff_reward_multiplier: 4.0
  reached_midway_reward: 10.0
  not_reached_midway_reward: -1.0
  reached_goal_reward: 100.0
  collision_reward: -200.0
  collision_distance_threshold: 0.25
"""


def info_after(env, action) -> dict[str, float]:
    _, _, terminated, _, info = env.step(np.asarray(action))
    return {"terminated": terminated, **{name.rpartition("/")[2]: value for name, value in info.items()}}


def test_frobs_rls_file_is_read_unchanged(tmp_path):
    path = tmp_path / "kobuki_maze.yaml"
    path.write_text(FROBS_RL, encoding="utf-8")
    assert FILES.read("maze", path, {}) == FILES.read("maze", None, {})


def test_a_keyword_goes_before_the_file(tmp_path):
    path = tmp_path / "kobuki_maze.yaml"
    path.write_text("kobuki_maze:\n  step_reward: -1\n  collision_reward: -7\n", encoding="utf-8")
    config = FILES.read("maze", path, {"step_reward": -2.0, "tolerance_goal_pos": None})
    assert (config["step_reward"], config["collision_reward"], config["tolerance_goal_pos"]) == (-2.0, -7.0, 0.5)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("kobuki_maze:\n  lidar_sample: 8\n", 2, "Did you mean 'lidar_samples'"),
        ("kobuki_maze:\n  step_reward: 0\n  collision_reward: much\n", 3, "collision_reward"),
        ("kobuki_maze:\n  lidar_samples: 8.5\n", 2, "integer"),
        ("kobuki_empty:\n  step_reward: 0\n", 1, "kobuki_maze"),
        ("kobuki_maze: 3\n", 1, "mapping"),
    ],
)
def test_mistakes_are_told_with_file_and_line(tmp_path, text, line, message):
    path = tmp_path / "task.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigFileError, match=message) as failure:
        FILES.read("maze", path, {})
    assert (failure.value.path, failure.value.line) == (path, line)


def test_a_world_that_there_is_not_is_refused(make):
    with pytest.raises(UnknownNameError, match="'maze'"):
        make("frobs/KobukiMazeLegacy-v0", world="mace")


@pytest.mark.parametrize("world", FILES.roots)
def test_every_world_has_its_defaults(world):
    assert (Path(str(files("frobs_tasks_legacy"))) / "navigation" / "tasks" / f"{world}.yaml").is_file()
    assert set(FILES.read(world, None, {})) == set(FILES.used)


def test_a_step_that_reaches_nothing_is_rewarded_as_it_was(make):
    env = make("frobs/KobukiMazeLegacy-v0")
    env.reset(seed=0, options={"start": (-5.0, 7.5, 0.0)})
    info = info_after(env, (0.0, 0.0))
    offset = np.array([-8.5, 0.0]) - [-5.0, 7.5]
    bearing = abs(np.arctan2(offset[1], offset[0]))
    assert info["distance"] == pytest.approx(-10.0 * np.hypot(*offset), rel=1e-4)
    assert info["bearing"] == pytest.approx(-4.0 * min(bearing, np.pi - bearing), rel=1e-3)
    assert info["way_points"] == -7.0
    assert info["collision"] == 0.0


def test_the_last_way_point_pays_what_the_others_pay(make):
    env = make("frobs/KobukiMazeLegacy-v0", reached_midway_reward=10.0)
    env.reset(seed=0, options={"start": (-5.0, 7.5, 0.0), "goal": (-4.0, 7.5)})
    for _ in range(10):
        info = info_after(env, (1.0, 0.0))
        if info["terminated"]:
            break
    assert info["terminated"]
    assert info["is_success"] == 1.0
    assert info["reached"] == 10.0
    assert info["distance"] == 0.0


def test_the_step_reward_is_paid_at_a_way_point_too(make):
    env = make("frobs/KobukiMazeLegacy-v0", step_reward=-3.0)
    env.reset(seed=0, options={"start": (-5.0, 7.5, 0.0), "goal": (-5.0, 7.5)})
    info = info_after(env, (0.0, 0.0))
    assert (info["reached"], info["step"]) == (10.0, -3.0)


def test_a_floor_plan_replaces_that_of_the_world(make):
    plan = {"start": {"pos": [0.0, 0.0]}, "routes": [[[1.0, 0.0], [2.0, 0.0]]]}
    env = make("frobs/KobukiMazeLegacy-v0", floor_plan=plan)
    observation, _ = env.reset(seed=0)
    assert observation[0] == pytest.approx(1.0)
    assert info_after(env, (0.0, 0.0))["way_points"] == -2.0


def test_the_lidar_is_found_by_its_name(make):
    scan = {"type": "lidar", "frame": "lidar_link", "rays": 5, "range_min": 0.1, "range_max": 30.0}
    env = make("frobs/KobukiMazeLegacy-v0", lidar="scan", lidar_samples=5, sensors={"scan": scan})
    assert env.reset(seed=0)[0].shape == (12,)


def test_being_near_a_wall_costs_and_does_not_end(make):
    env = make("frobs/KobukiMazeLegacy-v0")
    env.reset(seed=0, options={"start": (-9.7, 7.5, np.pi), "goal": (-5.0, 7.5)})
    costs = []
    for _ in range(5):
        info = info_after(env, (1.0, 0.0))
        costs.append(info["collision"])
        assert not info["terminated"]
    assert costs[-1] == -200.0


def test_observations_stay_in_their_space_outside_the_area(make):
    env = make("frobs/KobukiMazeLegacy-v0")
    env.reset(seed=0)
    env.unwrapped.robot.write_base_pose(np.array([[300.0, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0, 0.0]]))
    observation, *_ = env.step(np.zeros(2))
    assert env.observation_space.contains(observation)


def test_the_lidar_must_have_as_many_rays_as_the_file_says(make):
    with pytest.raises(ConfigurationError, match="lidar_samples is 12"):
        make("frobs/KobukiMazeLegacy-v0", lidar_samples=12)


@pytest.mark.parametrize(("id", "speed"), [("frobs/KobukiEmptyLegacy-v0", 0.3), ("frobs/KobukiMazeLegacy-v0", 1.0)])
def test_actions_are_the_speeds_that_they_were(make, id, speed):
    env = make(id)
    env.reset(seed=0, options={"start": (-5.0, 6.0, -np.pi / 2)})
    for _ in range(8):
        env.step(np.array([1.0, 0.0]))
    assert np.hypot(*env.unwrapped.robot.base_twist[0][0, :2]) == pytest.approx(speed, rel=0.03)
