"""Closed loop on MuJoCo with the IRB120: the arm goes where it is asked, gravity and all."""

import dataclasses

import numpy as np
import pytest

from frobs_controllers.plugin import frobs_controllers
from frobs_core.description import Placement, Scene
from frobs_core.models import load_model
from frobs_core.util.rotations import quat_difference

pytest.importorskip("mujoco")
RECORDS = {record.name: record for record in frobs_controllers()}


@pytest.fixture(scope="module")
def placement():
    from frobs_robots_abb.irb120 import IRB120

    return IRB120, load_model(IRB120.model)


@pytest.fixture
def build(placement):
    """Build a controller with the simulation that it commands."""
    from frobs_sim_mujoco.simulation import MujocoSimulation

    simulations = []

    def make(name, num_envs=1, collisions=True, **parameters):
        controller = RECORDS[name].load()(**parameters)
        robot, model = placement
        robot = dataclasses.replace(robot, self_collision=collisions)
        simulation = MujocoSimulation(
            {"robot": Placement(robot=robot, model=model, command_mode=controller.command_mode)},
            Scene(floor=collisions),
            num_envs=num_envs,
            physics_timestep=0.002,
            num_threads=1,
        )
        simulations.append(simulation)
        simulation.reset()
        controller.bind(simulation.robots["robot"], 0.04, 20)
        controller.reset(None)
        return controller, simulation

    yield make
    for simulation in simulations:
        simulation.close()


def drive(controller, simulation, action, steps=1):
    robot = simulation.robots["robot"]
    action = np.tile(np.asarray(action, dtype=float), (simulation.num_envs, 1))
    for _ in range(steps):
        robot.command(controller.apply(action))
        simulation.step(20)


def tool(simulation):
    return tuple(array.copy() for array in simulation.robots["robot"].frame_pose("tcp"))


@pytest.mark.parametrize("name", ["tcp_delta_position", "tcp_delta_pose"])
@pytest.mark.parametrize("direction", [(1, 0, 0), (0, -1, 0), (0, 0, 1), (-1, 1, 0)], ids=str)
def test_the_tool_goes_where_it_is_asked(build, name, direction):
    controller, simulation = build(name)
    stay = np.zeros(controller.action_space.shape)
    drive(controller, simulation, stay, 20)
    pos, quat = tool(simulation)
    drive(controller, simulation, [*direction, *stay[3:]], 2)
    drive(controller, simulation, stay, 20)
    end_pos, end_quat = tool(simulation)
    assert np.abs(end_pos - pos - 0.1 * np.array(direction)).max() < 0.004
    if name == "tcp_delta_pose":
        assert np.linalg.norm(quat_difference(end_quat, quat)) < 0.01


@pytest.mark.parametrize("axis", [0, 1, 2], ids="xyz")
def test_the_tool_turns_as_it_is_asked(build, axis):
    controller, simulation = build("tcp_delta_pose", max_rotation=0.1)
    drive(controller, simulation, np.zeros(6), 20)
    pos, quat = tool(simulation)
    action = np.zeros(6)
    action[3 + axis] = 1.0
    drive(controller, simulation, action, 4)
    drive(controller, simulation, np.zeros(6), 20)
    end_pos, end_quat = tool(simulation)
    assert np.abs(quat_difference(end_quat, quat)[0] - 0.4 * np.eye(3)[axis]).max() < 0.01
    assert np.abs(end_pos - pos).max() < 0.004


@pytest.mark.parametrize("name", ["tcp_delta_position", "tcp_delta_pose", "joint_delta_position"])
def test_an_action_of_zero_holds_the_arm(build, name):
    controller, simulation = build(name)
    stay = np.zeros(controller.action_space.shape)
    drive(controller, simulation, stay, 20)
    pos, _ = tool(simulation)
    drive(controller, simulation, stay, 100)
    assert np.abs(tool(simulation)[0] - pos).max() < 0.002


@pytest.mark.parametrize("name", ["tcp_delta_position", "tcp_delta_pose"])
@pytest.mark.parametrize(("steps", "dragged"), [(40, 0.0), (1, 0.15)], ids=["slow", "jump"])
def test_a_moving_base_leaves_the_tool_in_the_world_or_drags_it_along(build, name, steps, dragged):
    controller, simulation = build(name, max_delta=0.05)
    stay, robot = np.zeros(controller.action_space.shape), simulation.robots["robot"]
    drive(controller, simulation, stay, 20)
    (pos, _), (base, base_quat) = tool(simulation), (part.copy() for part in robot.base_pose)
    for number in range(60):
        robot.write_base_pose(base + 0.2 * min((number + 1) / steps, 1.0) * np.eye(3)[1], base_quat)
        drive(controller, simulation, stay)
    assert tool(simulation)[0] - pos == pytest.approx(np.array([[0.0, dragged, 0.0]]), abs=0.006)


@pytest.mark.parametrize("name", ["tcp_delta_position", "tcp_delta_pose"])
@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0)], ids=str)
def test_pulled_beyond_its_reach_the_arm_is_still_and_comes_back(build, name, direction):
    controller, simulation = build(name)
    action = np.zeros(controller.action_space.shape)
    action[:3] = direction
    drive(controller, simulation, action, 80)
    robot = simulation.robots["robot"]
    pos, _ = tool(simulation)
    assert np.abs(robot.joint_velocities).max() < 0.5
    drive(controller, simulation, -action, 10)
    assert (tool(simulation)[0] - pos)[0] @ direction < -0.05


def test_joint_delta_position_moves_the_joints_by_what_was_asked(build):
    controller, simulation = build("joint_delta_position")
    robot = simulation.robots["robot"]
    drive(controller, simulation, np.zeros(6), 20)
    before = robot.joint_positions.copy()
    drive(controller, simulation, [1, -1, 0.5, 1, -1, 1], 2)
    drive(controller, simulation, np.zeros(6), 20)
    assert np.abs(robot.joint_positions - before - 0.3 * np.array([1, -1, 0.5, 1, -1, 1])).max() < 0.005


def test_joint_velocity_moves_the_joints_as_fast_as_asked(build):
    controller, simulation = build("joint_velocity", max_velocity=0.5)
    robot = simulation.robots["robot"]
    drive(controller, simulation, [1, 0, 0, -1, 0, 1], 25)
    moved = robot.joint_positions - robot.home
    assert np.abs(moved[0, [0, 3, 5]] - [0.5, -0.5, 0.5]).max() < 0.06


@pytest.mark.parametrize(
    "name", ["joint_position", "joint_delta_position", "joint_velocity", "tcp_delta_position", "tcp_delta_pose"]
)
def test_random_actions_keep_the_arm_inside_its_limits(build, name):
    controller, simulation = build(name, 4, collisions=False)  # which can push a joint beyond
    robot, rng = simulation.robots["robot"], np.random.default_rng(0)
    for i in range(150):
        if i % 15 == 0:
            action = rng.choice([-1.0, 1.0], (4, *controller.action_space.shape))
        robot.command(controller.apply(action))
        simulation.step(20)
        assert (robot.joint_positions > robot.position_lower - 0.05).all()
        assert (robot.joint_positions < robot.position_upper + 0.05).all()
    assert simulation.diverged is None or not simulation.diverged.any()


@pytest.mark.parametrize(
    "name",
    [name for name in RECORDS if name not in ("discrete", "differential_drive") and not name.startswith("gripper")],
)
def test_each_environment_of_many_equals_the_single_one_bit_for_bit(build, name):
    parameters = {"max_effort": 2.0} if name == "joint_effort" else {}  # the limits themselves would tear the arm apart
    controller, simulation = build(name, 5, **parameters)
    actions = np.random.default_rng(0).uniform(-1, 1, (40, 5, *controller.action_space.shape))
    alone = [build(name, **parameters) for _ in range(5)]
    for action in actions:
        simulation.robots["robot"].command(controller.apply(action))
        simulation.step(20)
        for i, (single, its_simulation) in enumerate(alone):
            its_simulation.robots["robot"].command(single.apply(action[i : i + 1]))
            its_simulation.step(20)
            assert np.array_equal(
                its_simulation.robots["robot"].joint_positions[0], simulation.robots["robot"].joint_positions[i]
            )
