"""A mirror on one simulation follows a robot that another one plays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.util.errors import ConfigurationError
from frobs_deploy import Policy
from frobs_ros.policy_node.mirror import Mirror, State
from frobs_train.export.pretrained import read_pretrained

REACH, MAZE = "frobs/Irb120Reach-v0", "frobs/KobukiMaze-v0"


def played(id: str, **keywords: Any) -> Any:
    """Return the environment that plays the robot."""
    return gym.make(f"frobs_core:{id}", disable_env_checker=True, **keywords)


def state_of(env: Any) -> State:
    """Return what its robot would measure."""
    robot = env.unwrapped.robot
    base = None
    if robot.robot.base != "fixed":
        base = tuple(part[0].copy() for part in (*robot.base_pose, *robot.base_twist))
    scans = {name: robot.lidar(name)[0].copy() for name in robot.robot.lidars}
    return State(robot.joint_positions[0].copy(), robot.joint_velocities[0].copy(), base, scans)


@pytest.fixture
def reaching() -> Iterator[tuple[Any, Mirror]]:
    env, mirror = played(REACH), Mirror(read_pretrained(REACH))
    yield env, mirror
    env.close()
    mirror.close()


def test_the_mirror_observes_what_the_robots_own_environment_observes(reaching: tuple[Any, Mirror]) -> None:
    env, mirror = reaching
    options = {"goal": np.array([0.3, 0.2, 0.5])}
    env.reset(seed=0, options=options)
    mirror.begin(state_of(env), options)
    env.action_space.seed(0)
    for _ in range(20):
        action = env.action_space.sample()
        expected = env.step(action)[0]
        assert mirror.observe(state_of(env)) == pytest.approx(expected, abs=2e-5)
        mirror.act(action)


def test_a_lidar_reads_what_was_measured_and_not_what_the_mirror_sees() -> None:
    mirror = Mirror(read_pretrained(MAZE))
    [(name, lidar)] = mirror.lidars.items()
    env = played(MAZE)
    env.reset(seed=0)
    seen = state_of(env)
    mirror.begin(seen)
    columns = mirror.env.observations.columns
    _, term = columns.get("lidar", columns.get("nearness"))
    before = mirror.observe(seen)[term]
    scans = {name: np.full(lidar.rays, np.nan)}
    scans[name][0] = 0.5
    after = mirror.observe(State(seen.positions, seen.velocities, seen.base, scans))[term]
    ranges = np.full(lidar.rays, lidar.range_max)
    ranges[0] = 0.5
    told = ranges if "lidar" in columns else 1.0 / (1.0 + ranges)
    assert after == pytest.approx(told, abs=1e-6)
    assert not np.allclose(before, after)
    env.close()
    mirror.close()


def test_a_policy_reaches_through_the_mirror() -> None:
    env = played(REACH, controller="joint_position")  # takes positions, as a robot's controller does
    bundle = read_pretrained(REACH)
    mirror, policy = Mirror(bundle), Policy(bundle)
    robot = env.unwrapped.robot
    low, high = robot.position_lower[0], robot.position_upper[0]
    done = 0
    for seed in range(5):
        env.reset(seed=seed)
        mirror.begin(state_of(env), {"goal": env.unwrapped.task.goal[0]})
        policy.reset()
        info: dict[str, Any] = {}
        for _ in range(50):
            command = mirror.act(policy.act(mirror.observe(state_of(env))))
            info = env.step(2.0 * (command.values - low) / (high - low) - 1.0)[-1]
        done += info["is_success"] == 1.0
    assert done >= 4
    env.close()
    mirror.close()


def test_commands_stay_within_what_the_joints_may() -> None:
    mirror = Mirror(read_pretrained(REACH), speed=0.1)
    robot = mirror.env.robot
    state = State(robot.home[0].copy(), np.zeros(robot.dof))
    mirror.begin(state)
    mirror.observe(state)
    command = mirror.act(np.ones(robot.dof))
    moved = command.values - state.positions
    assert moved == pytest.approx(0.1 * robot.velocity_limit[0] * mirror.env.control_timestep)
    assert mirror.hold(state).values == pytest.approx(state.positions)
    mirror.close()


@pytest.mark.parametrize("speed", [0.0, 1.5])
def test_a_speed_out_of_range_is_refused(speed: float) -> None:
    with pytest.raises(ConfigurationError, match="above 0 and at most 1"):
        Mirror(read_pretrained(REACH), speed=speed)


@pytest.mark.ros_feature("policies that see images", "mujoco", works=False)
def test_a_policy_that_sees_images_is_refused() -> None:
    bundle = read_pretrained(REACH)
    observation = {**bundle.manifest["observation"], "images": {"eye": {"camera": "wrist"}}}
    with pytest.raises(ConfigurationError, match=r"uses the images 'eye', but this command does not support images"):
        Mirror(replace(bundle, manifest={**bundle.manifest, "observation": observation}))
