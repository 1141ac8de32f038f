"""Proof: an arm that was assembled with a gripper grasps a cube and holds it in the air, on two engines."""

import numpy as np
import pytest
from arm_and_gripper import ARM, CUBE, CUBE_TASK, FINGERS, go_to

from frobs_core.kernel.env import RobotEnv

HOLD = 2.0  # [s]


@pytest.mark.parametrize("simulator", ["mujoco", pytest.param("pybullet", marks=pytest.mark.slow)])
def test_a_gripper_lifts_a_cube_and_holds_it_for_two_seconds(simulator):
    env = RobotEnv(
        task=CUBE_TASK,
        robot=ARM.attach("flange", FINGERS, name="hand"),
        controller={"arm": "tcp_delta_pose"},
        controller_kwargs={"arm": {"max_delta": 0.02}},
        simulator=simulator,
        simulator_kwargs={"cone": "elliptic"},
    )
    assert env.action_space.shape == (7,)  # six of the tool's pose, one of the fingers
    env.reset(seed=0)
    cube = env.simulation.bodies["cube"]
    place = cube.pose[0][0].copy()
    go_to(env, place + np.array([0.0, 0.0, 0.15]), 1.0, 100)
    tool = go_to(env, place, 1.0, 100)
    assert np.abs(tool - place).max() < 0.005
    go_to(env, place, -1.0, 25)
    go_to(env, place + np.array([0.0, 0.0, 0.2]), -1.0, 100)
    before = cube.pose[0][0].copy()
    assert before[2] > 0.15
    go_to(env, place + np.array([0.0, 0.0, 0.2]), -1.0, round(HOLD / env.control_timestep))
    after = cube.pose[0][0]
    assert after[2] > 0.15
    assert np.linalg.norm(after - before) < 0.005  # it does not slip
    fingers = env.robot.joint_positions[0, -2:]
    assert np.abs(fingers - CUBE / 2).max() < 0.003
    assert not env.simulation.contact("cube on floor")[0]
    env.close()
