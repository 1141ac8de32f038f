"""The impedance controller on every installed arm: it rests, follows and yields at the default physics timestep."""

from contextlib import closing

import numpy as np
import pytest

from frobs_core import plugins
from frobs_core.contracts.control import RobotControl, joint_groups
from frobs_core.description import Placement, Scene
from frobs_core.kernel.robot_config import RobotConfig
from frobs_core.models import load_model

ARMS = ["irb120", "irb140", "ur5", "ur5_gripper", "panda", "panda_arm", "irb120+two_finger_hand"]
SIMULATORS = ["mujoco", "pybullet"]
PHYSICS_TIMESTEP, DECIMATION = 0.002, 20  # the defaults of tasks
CONTROL_TIMESTEP = PHYSICS_TIMESTEP * DECIMATION
TWO_SECONDS = round(2.0 / CONTROL_TIMESTEP)


class Springs:
    """The same arm in several environments, each with an impedance controller for its first joint group."""

    def __init__(self, arm, simulator, num_envs, **parameters):
        description = RobotConfig(robot=arm).describe()
        model = load_model(description.model, xacro_args=description.xacro_args)
        controller = plugins.get_record("controller", "tcp_impedance").load()(**parameters)
        group, joints = next(iter(joint_groups(description, model).items()))
        placement = Placement(
            robot=description, model=model, command_mode=dict.fromkeys(joints, controller.command_mode)
        )
        scene = Scene()
        self.num_envs = num_envs
        self.simulation = plugins.get_record("simulator", simulator).load()(
            {"robot": placement}, scene, num_envs=num_envs, physics_timestep=PHYSICS_TIMESTEP, num_threads=1
        )
        controller.bind_scene(scene, self.simulation)
        self.robot = self.simulation.robots["robot"]
        self.control = RobotControl(self.robot, {group: controller}, CONTROL_TIMESTEP, DECIMATION)
        self.tool = self.robot.frame_name("tcp")
        self.simulation.reset()
        controller.reset(None)
        self.fastest = np.zeros_like(self.robot.joint_velocities)
        """Highest speed of each joint so far, (num_envs, dof) [rad/s or m/s]."""

    def step(self, actions, forces=None):
        """Advance by one control step, with a force [N] at the tool's center of mass."""
        self.robot.command(self.control.command([actions]))
        for number in range(DECIMATION):
            if number:
                self.robot.command(self.control.update())
            if forces is not None:
                self.simulation.apply_wrench(f"robot/{self.tool}", forces, np.zeros_like(forces))
            self.simulation.step(1)
            self.fastest = np.maximum(self.fastest, np.abs(self.robot.joint_velocities))

    def tool_position(self):
        return self.robot.frame_pose("tcp")[0].copy()

    def close(self):
        self.simulation.close()


@pytest.mark.slow
@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("simulator", SIMULATORS)
def test_an_arm_on_springs_rests_follows_and_yields(arm, simulator):
    """Row 0 gets no command, row 1 moves by 5 cm, and rows 2 to 4 are pushed with 10 N along one axis each."""
    pytest.importorskip(simulator)
    actions, forces = np.zeros((5, 3)), np.zeros((5, 3))
    actions[1] = [0.0, 0.0, -1.0]
    forces[2:] = 10.0 * np.eye(3)
    with closing(Springs(arm, simulator, 5)) as springs:
        start = springs.tool_position()
        for number in range(TWO_SECONDS):
            springs.step(actions if number == 0 else np.zeros((5, 3)), forces)
        assert np.abs(springs.robot.joint_velocities).max() < 0.05
        moved = springs.tool_position() - start
        assert (springs.fastest <= springs.robot.velocity_limit).all()
        assert np.abs(moved[0]).max() < 0.005
        assert np.abs(moved[1] - [0.0, 0.0, -0.05]).max() < 0.005
        assert np.diagonal(moved[2:]) == pytest.approx(10.0 / 800.0, rel=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("arm", ["irb120", "irb140", "ur5"])
@pytest.mark.parametrize(
    "parameters",
    [
        {"stiffness": 200.0, "damping": 40.0},
        {"stiffness": 500.0},
        {"stiffness": 2000.0, "damping": 130.0},
        {"stiffness": 1e5, "rotational_stiffness": 1e4},
        {"stiffness": 2000.0, "damping": 1e5, "rotational_damping": 1e4, "joint_damping": 1e3},
    ],
    ids=str,
)
def test_an_arm_is_stable_with_springs_and_dampers_of_any_strength(arm, parameters):
    """Row 0 gets no command, and row 1 moves by 1 cm."""
    with closing(Springs(arm, "mujoco", 2, **parameters)) as springs:
        start = springs.tool_position()
        actions = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.2]])
        for number in range(TWO_SECONDS):
            springs.step(actions if number == 0 else np.zeros((2, 3)))
        assert np.abs(springs.robot.joint_velocities).max() < 0.05
        assert np.abs(springs.tool_position()[0] - start[0]).max() < 0.005
        assert (springs.fastest[0] <= springs.robot.velocity_limit[0]).all()


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.8, 1.25, 10.0])
def test_an_arm_is_stable_if_its_masses_differ_from_those_in_the_model_file(factor):
    with closing(Springs("irb120", "mujoco", 1, stiffness=1e5, damping=1e5, rotational_damping=1e4)) as springs:
        for link in springs.robot.model.links:
            if link.inertial is not None:
                target = f"robot/{link.name}"
                mass = springs.simulation.parameter("mass", target)
                springs.simulation.write_parameter("mass", target, factor * mass)
        for _ in range(TWO_SECONDS):
            springs.step(np.zeros((1, 3)))
        assert np.abs(springs.robot.joint_velocities).max() < 0.05
        assert (springs.fastest <= springs.robot.velocity_limit).all()


@pytest.mark.parametrize("simulator", SIMULATORS)
def test_a_moving_base_leaves_the_tool_in_the_world_and_drags_it_beyond_the_leash(simulator):
    """The base of row 0 moves by 5 cm, and the base of row 1 by 30 cm, in 0.4 s."""
    pytest.importorskip(simulator)
    with closing(Springs("irb120", simulator, 2, leash=0.1)) as springs:
        start, (base, quat_wxyz) = springs.tool_position(), [part.copy() for part in springs.robot.base_pose]
        for number in range(50):
            moved = np.array([[0.0, 0.05, 0.0], [0.0, 0.3, 0.0]]) * min((number + 1) / 10, 1.0)
            springs.robot.write_base_pose(base + moved, quat_wxyz)
            springs.step(np.zeros((2, 3)))
        by = (springs.tool_position() - start)[:, 1]
        assert by[0] == pytest.approx(0.0, abs=0.001)
        assert 0.0 < by[1] < 0.3


@pytest.mark.slow
@pytest.mark.parametrize("arm", ["irb120", "irb140", "ur5"])
def test_without_dampers_an_arm_swings_and_does_not_explode(arm):
    with closing(Springs(arm, "mujoco", 1, damping=0.0, rotational_damping=0.0, joint_damping=0.0)) as springs:
        start = springs.tool_position()
        for number in range(2 * TWO_SECONDS):
            springs.step(np.array([[0.0, 0.0, -0.2 * (number == 0)]]))
            assert np.abs(springs.tool_position() - start).max() < 0.03
        assert (springs.fastest <= springs.robot.velocity_limit).all()
