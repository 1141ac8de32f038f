from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.models import Box, Capsule, Cylinder, Mesh, Sphere
from frobs_core.util.errors import ConfigurationError
from frobs_tasks_reach.floor import depth
from frobs_tasks_reach.keep_out import distance_to
from frobs_tasks_reach.workspace import Workspace

REACH = "frobs/Irb120Reach-v0"


def test_goals_lie_in_the_box_outside_of_the_foot_and_where_a_joint_vector_puts_the_tool(make):
    env = make(REACH, 256)
    observation, _ = env.reset(seed=1)
    goals = observation[:, 9:12].astype(float)
    task = env.unwrapped.task
    assert (goals >= [-0.5, -0.5, 0.0]).all()
    assert (goals <= [0.5, 0.5, 1.0]).all()
    assert task._foot.is_clear(goals, 0.029).all()
    joint_positions, tool = task._sampler.draw("goal", env.unwrapped._loop.rng, None, task._is_in_box, "")
    lower, upper = env.unwrapped.robot.position_lower, env.unwrapped.robot.position_upper
    assert ((joint_positions >= lower) & (joint_positions <= upper)).all()
    assert (env.unwrapped.robot.frame_pose("tcp", joint_positions)[0] == tool).all()


def test_goals_fall_in_every_octant_of_the_box(make):
    observation, _ = make(REACH, 512).reset(seed=2)
    octants = ((observation[:, 9:12] > [0.0, 0.0, 0.5]) * [1, 2, 4]).sum(axis=1)
    assert (np.bincount(octants, minlength=8) > 512 * 0.04).all()


def test_goals_keep_to_a_small_box_that_few_joint_vectors_reach(make):
    low, high = (0.30, -0.05, 0.40), (0.40, 0.05, 0.50)
    observation, _ = make(REACH, 16, goal_low=low, goal_high=high).reset(seed=3)
    goals = observation[:, 9:12]
    assert ((goals >= np.float32(low)) & (goals <= np.float32(high))).all()
    assert len(np.unique(goals[:, 0])) == 16


def test_a_box_out_of_reach_is_refused_when_the_environment_is_built():
    with pytest.raises(ConfigurationError, match=r"cannot reach any part of the goal box \(2, 2, 0\) to \(3, 3, 1\) m"):
        gym.make(REACH, goal_low=(2, 2, 0), goal_high=(3, 3, 1))


def test_random_starts_differ_keep_to_the_limits_and_hold_the_tool_above_the_floor(make):
    env = make(REACH, 256, initial="random")
    observation, _ = env.reset(seed=4)
    joints, tool = observation[:, :6], observation[:, 6:9]
    assert len(np.unique(joints[:, 0])) == 256
    assert (np.abs(joints[:, 0]) <= 2.88).all()
    assert (tool[:, 2] > 0.0499).all()


@pytest.mark.parametrize(
    ("geometry", "position", "distance"),
    [
        (Sphere(0.1), (0.3, 0.0, 0.0), 0.2),
        (Sphere(0.1), (0.05, 0.0, 0.0), 0.0),
        (Cylinder(0.1, 0.4), (0.4, 0.0, 0.6), 0.5),
        (Cylinder(0.1, 0.4), (0.05, 0.0, 0.1), 0.0),
        (Capsule(0.1, 0.4), (0.0, 0.3, 0.6), 0.4),
        (Box((0.2, 0.4, 0.6)), (0.4, 0.2, 0.7), 0.5),
        (Mesh("arm.stl"), (0.0, 0.0, 0.0), np.inf),
    ],
)
def test_distance_to_a_shape(geometry, position, distance):
    np.testing.assert_allclose(distance_to(geometry, np.array(position)), distance, atol=1e-12)


def test_a_shrunk_workspace_keeps_its_margin_from_what_was_not_reached():
    rng = np.random.default_rng(0)
    points = rng.uniform(0.0, 1.0, (200_000, 3))
    reached = points[np.linalg.norm(points - 0.5, axis=1) < 0.45]
    workspace = Workspace(np.zeros(3), np.ones(3), reached)
    workspace.shrink(0.1)
    kept = points[workspace.contains(points)]
    assert len(kept) > 1000
    corners = kept[:, None] + 0.1 * np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
    assert np.linalg.norm(corners - 0.5, axis=-1).max() < 0.45 + 0.05 * np.sqrt(3.0)
    assert not workspace.contains(np.array([[1.5, 0.5, 0.5]])).any()


def test_a_workspace_without_room_is_empty():
    workspace = Workspace(np.zeros(3), np.ones(3), np.array([[0.5, 0.5, 0.5]]))
    workspace.shrink(0.1)
    assert workspace.is_empty


def test_no_goal_asks_the_arm_to_be_below_the_floor(make):
    env = make(REACH, 256, initial="random")
    env.reset(seed=5)
    env.unwrapped.simulation.step(1)
    data = env.unwrapped.simulation.native.batch
    touching = [data.get_data(i) for i in range(256)]
    import mujoco

    model = env.unwrapped.simulation.native.model
    floor = model.geom("floor").id
    for state in touching:
        mujoco.mj_forward(model, state)
        assert floor not in state.contact.geom


@pytest.mark.parametrize("geometry", [Sphere(0.1), Cylinder(0.1, 0.4), Capsule(0.1, 0.4), Box((0.2, 0.4, 0.6))])
def test_depth_is_that_of_the_lowest_point(geometry):
    rng = np.random.default_rng(0)
    up = rng.normal(size=(5, 3))
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    points = rng.uniform(-0.5, 0.5, (200_000, 3))
    inside = points[distance_to(geometry, points) == 0.0]
    lowest = -(inside @ up.T).min(axis=0)
    assert (depth(geometry, up) >= lowest).all()
    np.testing.assert_allclose(depth(geometry, up), lowest, atol=0.03)
