"""The controller in environments, on MuJoCo."""

from __future__ import annotations

from contextlib import closing

import numpy as np
import pytest

pytest.importorskip("ompl")
pytest.importorskip("toppra")
pytest.importorskip("pinocchio", exc_type=ImportError)  # which needs libgomp1

from frobs_controllers_planning.controller import TrajectoryController
from frobs_controllers_planning.plan import Reason
from frobs_core.contracts import CommandMode
from frobs_core.description import Body, Placement, Scene
from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.models import Box, Pose, load_model
from frobs_core.util.errors import ConfigurationError
from frobs_devkit.testing import check_controller, pytest_checks
from frobs_robots_abb.irb120 import IRB120
from frobs_sim_mujoco.simulation import MujocoSimulation

PARTS = {"task": "reach", "robot": "irb120", "controller": "trajectory"}
MODEL = load_model(IRB120.model)
AWAY = Pose((5.0, 5.0, 0.5))


@pytest.fixture
def bound():
    """Bind a controller to the arm beside a box that a task could move, and return it with the simulation."""
    simulations = []

    def make(num_envs=1, control_timestep=4.0, extra=None, **parameters):
        placement = Placement(robot=IRB120, model=MODEL, command_mode=CommandMode.POSITION)
        box = Body(geometry=Box((0.6, 0.04, 0.8)), pose=AWAY, kinematic=True)
        scene = Scene(bodies={"box": box}, robots=extra or {})
        robots = {"robot": placement, **scene.robots}
        simulation = MujocoSimulation(robots, scene, num_envs=num_envs, physics_timestep=0.002)
        simulations.append(simulation)
        simulation.reset()
        controller = TrajectoryController(**parameters)
        controller.bind_scene(scene, simulation)
        controller.bind(simulation.robots["robot"], control_timestep, round(control_timestep / 0.002))
        return controller, simulation

    yield make
    for simulation in simulations:
        simulation.close()


def action_of(controller, joint_positions):
    lower, upper = controller.planner.lower, controller.planner.upper
    return (2.0 * (np.asarray(joint_positions) - lower) / (upper - lower) - 1.0)[None]


test_the_kit_passes_it_with_points_for_the_tool = pytest_checks(
    check
    for check in check_controller("trajectory", IRB120, target="tcp")
    if check.name in ("commands_have_their_shape", "info_has_its_shape")
)


def test_the_arm_is_where_it_was_sent(bound):
    controller, simulation = bound()
    goal = np.array([0.9, 0.5, 0.2, 0.3, 0.8, -1.0])
    rows = controller.apply(action_of(controller, goal))
    assert rows.shape == (1, 2000, 6)
    simulation.robots["robot"].command(rows)
    simulation.step(2000)
    np.testing.assert_allclose(simulation.robots["robot"].joint_positions[0], goal, atol=0.012)
    assert controller.info()["plan_success"] == [1.0]
    assert 0.5 < controller.info()["motion_duration"][0] < 4.0


def test_commands_keep_the_limits_of_velocity_and_acceleration(bound):
    controller, simulation = bound(velocity_scaling=1.0, acceleration_scaling=1.0)
    start = simulation.robots["robot"].joint_positions.copy()
    rows = controller.apply(np.array([[0.5, -0.3, 0.4, -0.8, 0.7, 0.9]]))[0]
    velocities = np.diff(np.concatenate([start, rows]), axis=0) / 0.002
    accelerations = np.diff(np.concatenate([np.zeros((1, 6)), velocities]), axis=0) / 0.002
    assert (np.abs(velocities) <= controller.planner.max_velocity).all()
    assert (np.abs(accelerations) <= controller.planner.max_acceleration).all()


def test_the_tool_is_where_it_was_sent():
    with closing(RobotEnv(**PARTS, controller_kwargs={"target": "tcp"})) as env:
        env.reset(seed=0)
        low, high = env.controller.workspace
        _, _, _, _, info = env.step([0.6, 0.3, -0.2])
        assert info["frobs/plan_success"] == 1.0
        goal = low + 0.5 * (high - low) * (np.array([0.6, 0.3, -0.2]) + 1.0)
        np.testing.assert_allclose(env.robot.frame_pose("tcp")[0][0], goal, atol=0.015)


def test_a_motion_that_takes_too_long_is_none(bound):
    controller, simulation = bound(control_timestep=0.1)
    before = simulation.robots["robot"].joint_positions[0].copy()
    rows = controller.apply(np.full((1, 6), 0.2))
    told = controller.info()
    assert (told["plan_success"], told["plan_reason"]) == ([0.0], [Reason.TOO_LONG])
    np.testing.assert_array_equal(rows[0], np.tile(before, (50, 1)))


def test_a_goal_that_cannot_be_is_told_and_the_robot_stays(bound):
    controller, simulation = bound()
    before = simulation.robots["robot"].joint_positions[0].copy()
    rows = controller.apply(action_of(controller, [0.0, 1.9, 0.2, 0.0, 0.0, 0.0]))  # in the floor
    told = controller.info()
    assert (told["plan_success"], told["plan_reason"]) == ([0.0], [Reason.GOAL_IN_COLLISION])
    assert (told["motion_duration"], told["plan_waypoints"]) == ([0.0], [0.0])
    np.testing.assert_array_equal(rows[0], np.tile(before, (2000, 1)))


def test_a_body_is_where_it_is_when_the_motion_begins_in_each_environment(bound):
    controller, simulation = bound(num_envs=2, velocity_scaling=1.0, acceleration_scaling=1.0)
    left, right = np.array([0.9, 0.5, 0.2, 0.0, 0.8, 0.0]), np.array([-0.9, 0.5, 0.2, 0.0, 0.8, 0.0])
    simulation.robots["robot"].write_joint_state(np.tile(left, (2, 1)))
    controller.reset(None)
    simulation.bodies["box"].write_pose(np.array([[0.45, 0.0, 0.4]]), mask=np.array([False, True]))
    controller.apply(np.repeat(action_of(controller, right), 2, axis=0))
    assert controller.info()["plan_success"].tolist() == [1.0, 1.0]
    waypoints = controller.info()["plan_waypoints"]
    assert waypoints[0] == 2
    assert waypoints[1] > 2


def test_another_robot_is_in_the_way_too(bound):
    other = Placement(robot=IRB120, model=MODEL, pose=Pose((0.55, 0.0, 0.0)), command_mode=CommandMode.POSITION)
    controller, _ = bound(extra={"other": other})
    assert any(name.startswith("other/link") for name in controller.planner.obstacles)
    controller.apply(action_of(controller, [0.0, 0.9, 0.2, 0.0, 0.4, 0.0]))  # into it
    assert controller.info()["plan_reason"] == [Reason.GOAL_IN_COLLISION]


def test_the_next_motion_begins_where_the_last_was_to_end(bound):
    controller, simulation = bound()
    first = controller.apply(np.full((1, 6), 0.1)).copy()
    simulation.robots["robot"].command(first)
    simulation.step(2000)
    assert not np.array_equal(simulation.robots["robot"].joint_positions[0], first[0, -1])  # gravity
    second = controller.apply(np.full((1, 6), -0.1))
    np.testing.assert_allclose(second[0, 0], first[0, -1], atol=1e-4)


def test_what_a_plan_did_is_in_the_info_of_an_environment_that_ends():
    with closing(RobotVectorEnv(2, max_episode_steps=1, **PARTS)) as env:
        env.reset(seed=0)
        info = env.step(np.array([[0.1] * 6, [0.0, 0.99, 0.2, 0.0, 0.0, 0.0]]))[-1]
        assert info["final_info"]["frobs/plan_success"].tolist() == [1.0, 0.0]
        assert info["final_info"]["frobs/plan_reason"].tolist() == [0.0, Reason.GOAL_IN_COLLISION]


def test_an_environment_of_many_moves_as_the_single_one():
    actions = np.random.default_rng(3).uniform(-0.4, 0.4, (2, 6))
    with closing(RobotVectorEnv(2, **PARTS)) as env:
        env.reset(seed=4)
        together = env.step(actions)[0]
    for i in range(2):
        with closing(RobotEnv(**PARTS)) as env:
            env.reset(seed=4 + i)
            np.testing.assert_array_equal(env.step(actions[i])[0], together[i])


@pytest.mark.parametrize("keywords", [{"target": "elbow"}, {"velocity_scaling": 2.0}, {"clearance": "2 cm"}])
def test_what_cannot_be_used_is_refused_before_the_first_step(keywords):
    with pytest.raises(ConfigurationError, match=f"trajectory: {next(iter(keywords))}"):
        RobotEnv(**PARTS, controller_kwargs=keywords)
