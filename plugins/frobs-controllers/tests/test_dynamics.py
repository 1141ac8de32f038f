"""Mass matrix and gravity efforts, compared with MuJoCo's."""

import gymnasium as gym
import numpy as np
import pytest

from frobs_controllers.dynamics import Dynamics
from frobs_core.description import Placement, Scene
from frobs_core.kernel.robot_config import RobotConfig
from frobs_core.models import load_model
from frobs_core.util.errors import UnsuitableRobotError

mujoco = pytest.importorskip("mujoco")
GRAVITY = (1.0, -2.0, -9.0)


@pytest.fixture(params=["irb120", "panda", "ur5_gripper", "two_finger_hand"])
def arm(request):
    """Two environments with an arm in different postures, including joints that mimic others."""
    from frobs_sim_mujoco.simulation import MujocoSimulation

    robot = RobotConfig(robot=request.param).describe()
    placement = Placement(robot=robot, model=load_model(robot.model, xacro_args=robot.xacro_args), command_mode={})
    simulation = MujocoSimulation(
        {"robot": placement}, Scene(gravity=GRAVITY), num_envs=2, physics_timestep=0.002, num_threads=1
    )
    simulation.reset()
    handle = simulation.robots["robot"]
    handle.write_joint_state(handle.home + np.array([[0.0], [0.02]]))
    yield simulation, handle
    simulation.close()


def test_mass_matrix_and_gravity_efforts_equal_those_of_mujoco(arm):
    simulation, handle = arm
    masses, efforts = Dynamics(handle)(np.array(GRAVITY))
    model, data = simulation.model, mujoco.MjData(simulation.model)
    # Columns of actuated joints, each together with the joints that mimic it.
    moves = np.zeros((model.nv, handle.dof))
    for joint in handle.model.joints:
        leader = handle.model.leader(joint)
        if leader is not None:
            row = model.joint(f"robot/{joint.name}").dofadr[0]
            moves[row, handle.joint_names.index(leader.joint)] = leader.multiplier
    for row in range(2):
        data.qpos[:] = moves @ handle.joint_positions[row]
        mujoco.mj_forward(model, data)
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        assert masses[row] == pytest.approx(moves.T @ full @ moves, rel=1e-9, abs=1e-12)
        assert efforts[row] == pytest.approx(moves.T @ data.qfrc_bias, rel=1e-9, abs=1e-9)


def test_a_group_moves_everything_behind_its_joints(arm):
    _, handle = arm
    whole, efforts = Dynamics(handle)(np.array(GRAVITY))
    part = handle.group(handle.joint_names[:2])
    masses, of_part = Dynamics(part)(np.array(GRAVITY))
    assert masses == pytest.approx(whole[:, :2, :2])
    assert of_part == pytest.approx(efforts[:, :2])


def test_a_weight_that_the_file_does_not_state_is_not_ignored(tmp_path):
    path = tmp_path / "r.xml"
    shape = '<geom type="box" size=".1 .1 .1" shellinertia="true"/>'
    path.write_text(
        '<mujoco><worldbody><body name="base"><geom size=".1"/><body name="arm"><joint name="j" axis="0 1 0"/>'
        f"{shape}</body></body></worldbody></mujoco>"
    )
    with pytest.raises(UnsuitableRobotError, match=r"only MuJoCo can compute \(arm\).* add an <inertial>"):
        gym.make("frobs_core:frobs/Reach-v0", robot=str(path), controller="tcp_impedance")
