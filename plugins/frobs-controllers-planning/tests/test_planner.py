"""The planner alone, without a simulation."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

pytest.importorskip("ompl")
pytest.importorskip("toppra")
pytest.importorskip("pinocchio", exc_type=ImportError)  # which needs libgomp1

from frobs_controllers_planning.plan import Reason, ToolGoal
from frobs_controllers_planning.planner import Planner
from frobs_core.description import Body, Scene
from frobs_core.models import Box, Pose
from frobs_core.util.errors import ConfigurationError, UnknownNameError
from frobs_core.util.rotations import quat_from_rpy

WALL = Scene(bodies={"wall": Body(geometry=Box((0.6, 0.04, 0.8)), pose=Pose((0.45, 0.0, 0.4)))})
LEFT, RIGHT = np.array([0.9, 0.5, 0.2, 0.0, 0.8, 0.0]), np.array([-0.9, 0.5, 0.2, 0.0, 0.8, 0.0])


@pytest.fixture(scope="module")
def free() -> Planner:
    return Planner("irb120")


@pytest.fixture(scope="module")
def walled() -> Planner:
    return Planner("irb120", Scene(bodies=WALL.bodies), velocity_scaling=1.0, acceleration_scaling=1.0)


def from_left(planner: Planner):
    """Plan around the wall; home is in it, so that a planner with it starts at the left."""
    return planner.plan(LEFT, RIGHT)


def test_an_empty_scene_is_crossed_in_a_straight_line(free):
    plan = free.plan(LEFT, RIGHT)
    assert plan.success
    assert len(plan.path) == 2
    assert plan.seconds > 0.0


def test_a_wall_is_gone_around(walled):
    plan = from_left(walled)
    assert plan.success
    assert len(plan.path) > 2
    positions = plan.trajectory.sample(np.linspace(0.0, plan.trajectory.duration, 200))[0]
    assert all(walled.is_free(q) for q in positions)
    np.testing.assert_allclose(positions[[0, -1]], [LEFT, RIGHT], atol=1e-9)


def test_limits_hold_at_every_sample_and_between_them(walled):
    trajectory = from_left(walled).trajectory
    h = 0.002
    positions, velocities, accelerations = trajectory.sample(np.arange(0.0, trajectory.duration + h, h))
    assert (np.abs(velocities) <= walled.max_velocity).all()
    assert (np.abs(accelerations) <= walled.max_acceleration).all()
    differences = np.diff(positions, axis=0) / h
    assert (np.abs(differences) <= walled.max_velocity).all()
    assert (np.abs(np.diff(differences, axis=0)) / h <= walled.max_acceleration).all()
    assert np.abs(velocities).max(axis=0).max() > 0.3 * walled.max_velocity.min(), "as slow as nobody asked for"


def test_velocities_are_the_derivatives_of_positions(walled):
    trajectory = from_left(walled).trajectory
    times = np.linspace(0.01, trajectory.duration - 0.01, 77)
    ahead, behind = trajectory.sample(times + 1e-6)[0], trajectory.sample(times - 1e-6)[0]
    np.testing.assert_allclose((ahead - behind) / 2e-6, trajectory.sample(times)[1], atol=1e-4)


def test_a_trajectory_rests_before_and_after(walled):
    trajectory = from_left(walled).trajectory
    positions, velocities, accelerations = trajectory.sample(np.array([-1.0, trajectory.duration + 5.0]))
    np.testing.assert_allclose(positions, [LEFT, RIGHT], atol=1e-9)
    assert not velocities.any()
    assert not accelerations.any()


def test_the_same_seed_plans_the_same_way(walled):
    other = Planner("irb120", WALL, velocity_scaling=1.0, acceleration_scaling=1.0)
    np.testing.assert_array_equal(from_left(walled).path, from_left(other).path)


def test_another_seed_plans_another_way(walled):
    other = Planner("irb120", WALL, velocity_scaling=1.0, acceleration_scaling=1.0, seed=9)
    assert not np.array_equal(from_left(walled).path, from_left(other).path)


def test_a_slower_scaling_takes_longer():
    fast, slow = Planner("irb120"), Planner("irb120", velocity_scaling=0.1, acceleration_scaling=0.1)
    assert slow.plan(LEFT, RIGHT).trajectory.duration > 2.0 * fast.plan(LEFT, RIGHT).trajectory.duration


def test_acceleration_limits_can_be_given_by_joint():
    planner = Planner("irb120", max_acceleration={"joint_1": 3.0}, acceleration_scaling=1.0)
    assert planner.max_acceleration[0] == 3.0
    assert planner.max_acceleration[1] == pytest.approx(4.36332 / 0.5)


def test_a_tool_position_is_reached(free):
    goal = np.array([0.35, 0.2, 0.3])
    plan = free.plan(free.home, ToolGoal(goal))
    assert plan.success
    np.testing.assert_allclose(free.tool_pos(plan.path[-1]), goal, atol=2e-4)


def test_a_tool_pose_is_reached(free):
    quat = quat_from_rpy([np.pi, 0.0, 0.4])
    plan = free.plan(free.home, ToolGoal(np.array([0.35, 0.1, 0.25]), quat))
    assert plan.success
    _, found = free._model.frame_pose("tool0", plan.path[-1:])
    assert abs(float(found[0] @ quat)) > 1.0 - 1e-5


def test_a_goal_is_in_the_world_where_the_base_stands_elsewhere():
    planner = Planner("irb120", Scene(robot_pose=Pose((1.0, 2.0, 0.0), tuple(quat_from_rpy([0.0, 0.0, 1.0])))))
    goal = planner.in_world(np.array([0.35, 0.2, 0.3]))
    plan = planner.plan(planner.home, ToolGoal(goal))
    np.testing.assert_allclose(planner.tool_pos(plan.path[-1]), goal, atol=2e-4)


@pytest.mark.parametrize(
    ("start", "goal", "reason"),
    [
        (LEFT, [0.0, 0.2, 0.2, 0.0, 1.17, 0.0], Reason.GOAL_IN_COLLISION),
        (LEFT, [3.0, 0.0, 0.0, 0.0, 0.0, 0.0], Reason.GOAL_OUTSIDE_LIMITS),
        ([0.0, 0.2, 0.2, 0.0, 1.17, 0.0], LEFT, Reason.START_IN_COLLISION),
        ([3.0, 0.0, 0.0, 0.0, 0.0, 0.0], LEFT, Reason.START_OUTSIDE_LIMITS),
        (LEFT, ToolGoal(np.array([2.0, 0.0, 0.0])), Reason.GOAL_OUT_OF_REACH),
        (LEFT, ToolGoal(np.array([0.45, 0.0, 0.4])), Reason.GOAL_IN_COLLISION),
    ],
)
def test_what_cannot_be_planned_has_a_reason(walled, start, goal, reason):
    plan = walled.plan(start, goal)
    assert plan.reason is reason
    assert not plan.success
    assert plan.trajectory is None


def test_a_search_that_gives_up_says_so():
    planner = Planner("irb120", WALL, max_steps=1)
    assert from_left(planner).reason is Reason.NO_WAY_FOUND


def test_a_robot_that_is_there_rests(free):
    plan = free.plan(LEFT, LEFT)
    assert plan.success
    assert plan.trajectory.duration == 0.0
    np.testing.assert_array_equal(plan.trajectory.sample(np.zeros(3))[0], [LEFT] * 3)


def test_bodies_that_have_moved_are_where_they_are():
    planner = Planner("irb120", WALL)
    planner.place({"wall": (np.array([0.0, 0.0, -5.0]), np.array([1.0, 0.0, 0.0, 0.0]))})
    assert len(from_left(planner).path) == 2


def test_a_motion_may_begin_nearer_than_the_clearance(free):
    bent = [np.array([0.0, bend, 0.55, 0.0, 0.0, 0.0]) for bend in np.linspace(1.0, 1.9, 400)]
    near = next(q for q in bent if not free.is_free(q))  # within 2 cm of the floor, and not in it
    plan = free.plan(near, free.home)
    assert plan.success


def test_the_floor_is_not_touched(free):
    assert not free.is_free([0.0, 1.9, 0.2, 0.0, 0.0, 0.0])
    assert Planner("irb120", Scene(floor=False)).is_free([0.0, 1.9, 0.2, 0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("keywords", "error"),
    [
        ({"velocity_scaling": 0.0}, ConfigurationError),
        ({"acceleration_scaling": 1.5}, ConfigurationError),
        ({"clearance": -0.1}, ConfigurationError),
        ({"max_acceleration": 0.0}, ConfigurationError),
        ({"max_acceleration": {"joint_9": 1.0}}, UnknownNameError),
        ({"seed": 0}, ConfigurationError),
        ({"max_steps": 2.5}, ConfigurationError),
        ({"tcp": "hand"}, UnknownNameError),
    ],
)
def test_what_cannot_be_used_is_named(keywords, error):
    with pytest.raises(error, match=str(next(iter(keywords))) if error is ConfigurationError else "named"):
        Planner("irb120", **keywords)


def test_a_goal_of_the_wrong_length_is_refused(free):
    with pytest.raises(ConfigurationError, match=r"goal is .* it must be 6 finite numbers"):
        free.plan(LEFT, [0.0, 0.0])
    with pytest.raises(ConfigurationError, match=r"norm of the goal.s quat_wxyz is"):
        free.plan(LEFT, ToolGoal(np.zeros(3), np.array([2.0, 0.0, 0.0, 0.0])))


def test_links_that_may_touch_are_not_kept_apart():
    scene = Scene(floor=False)
    names = ("base_link", *(f"link_{i}" for i in range(1, 7)))
    strict, loose = (Planner("irb120", scene, may_touch=pairs) for pairs in ((), tuple(combinations(names, 2))))
    postures = np.random.default_rng(0).uniform(strict.lower, strict.upper, (200, 6))
    assert not all(map(strict.is_free, postures))
    assert all(map(loose.is_free, postures))


def test_a_search_that_has_no_time_finds_only_straight_ways(walled):
    assert walled.plan(LEFT, RIGHT, max_seconds=0.0).reason is Reason.NO_WAY_FOUND
    assert walled.plan(LEFT, LEFT + 0.1, max_seconds=0.0).success
    assert from_left(walled).success


@pytest.mark.parametrize("tolerance", [1e-5, 0.05])
def test_a_tool_goal_is_reached_within_its_tolerances(free, tolerance):
    quat = quat_from_rpy([0.3, 1.2, -0.4])
    goal = ToolGoal(np.array([0.3, -0.3, 0.5]), quat, position_tolerance=tolerance, rotation_tolerance=0.2)
    plan = free.plan(LEFT, goal)
    assert plan.success
    distance = np.linalg.norm(free.tool_pos(plan.path[-1]) - goal.pos)
    assert distance <= tolerance
    if tolerance > 1e-3:
        assert distance > 1e-4  # it stops as soon as it is near enough
