"""Proof: the force-torque sensor of a wrist reads the weight of a held mass within 1 %, on two engines."""

from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest
from arm_and_gripper import ARM, CUBE_TASK, FINGERS, go_to

from frobs_core import plugins
from frobs_core.contracts import CommandMode
from frobs_core.description import Attachment, Body, ForceTorque, Placement, Scene
from frobs_core.kernel.env import RobotEnv
from frobs_core.models import Pose, Sphere, load_model
from frobs_core.util.errors import UnsuitableRobotError
from frobs_core.util.rotations import quat_conjugate, quat_rotate

GRAVITY, HAND, MASS = 9.81, 0.8, 0.5  # [m/s²], [kg] of the hand with both fingers, [kg] of the held ball
ENGINES = pytest.mark.parametrize("simulator", ["mujoco", pytest.param("pybullet", marks=pytest.mark.slow)])
ARM_WITH_HAND = ARM.attach("flange", FINGERS, name="hand")


def place(robot):
    return Placement(robot=robot, model=load_model(robot.model), command_mode=CommandMode.POSITION)


def weigh(env, opening):
    """Return the force that the wrist feels in a step without motion [N]."""
    observation, *_ = env.step(np.array([*[0.0] * 6, opening]))
    return np.linalg.norm(observation[-6:-3])


@ENGINES
def test_a_wrist_reads_the_weight_of_what_the_gripper_holds(simulator):
    env = RobotEnv(
        task=CUBE_TASK,
        robot=ARM_WITH_HAND,
        controller={"arm": "tcp_delta_pose"},
        controller_kwargs={"arm": {"max_delta": 0.02}},
        simulator=simulator,
        simulator_kwargs={"cone": "elliptic"},
        sensors={"wrist": {"type": "force_torque", "frame": "hand_hand"}},
        observations={"wrist": {"type": "sensor", "sensor": "wrist"}},
    )
    observation, _ = env.reset(seed=0)
    assert observation[-6:].tolist() == [0.0] * 6
    place = env.simulation.bodies["cube"].pose[0][0].copy()
    above = place + np.array([0.0, 0.0, 0.2])
    go_to(env, above, 1.0, 150)
    empty = weigh(env, 1.0)
    assert empty == pytest.approx(HAND * GRAVITY, rel=0.01)
    go_to(env, place, 1.0, 100)
    go_to(env, place, -1.0, 25)
    go_to(env, above, -1.0, 200)
    assert weigh(env, -1.0) - empty == pytest.approx(0.1 * GRAVITY, rel=0.01)
    env.close()


@ENGINES
def test_force_and_torque_are_right_in_tilted_poses_of_each_environment(simulator):
    # The flange is only a frame between the arm and the hand; the tool center point is only a frame beyond both.
    robot = replace(
        ARM_WITH_HAND, sensors={"flange": ForceTorque(frame="flange"), "tip": ForceTorque(frame="hand_tcp")}
    )
    arm = place(robot)
    tool = arm.start_pose("hand_tcp")
    ball = Body(geometry=Sphere(0.02), mass=MASS, pose=Pose(tuple(tool[:3]), tuple(tool[3:])), collides=False)
    scene = Scene(bodies={"ball": ball}, attachments={"grip": Attachment("robot/hand_tcp", "ball")})
    load = plugins.get_record("simulator", simulator).load()
    with closing(load({"robot": arm}, scene, num_envs=3, physics_timestep=0.002)) as simulation:
        handle = simulation.robots["robot"]
        tilt = np.zeros((3, handle.dof))
        tilt[:, [4, 5]] = [[0.0, 0.0], [0.5, -0.6], [-0.7, 0.4]]
        handle.command(handle.home + tilt)
        simulation.step(4000)
        simulation.step(20)
        for sensor, frame in (("flange", "flange"), ("tip", "hand_tcp")):
            read = simulation.sensor_wrench("robot", sensor)
            expected = carried(simulation, frame)
            for part in (slice(0, 3), slice(3, 6)):
                error = np.abs(read[:, part] - expected[:, part]).max()
                assert error < 0.01 * np.abs(expected[:, part]).max(), sensor


def carried(simulation, frame):
    """Return the wrench that holds hand, fingers and ball at rest, (num_envs, 6) in a frame of the robot."""
    robot = simulation.robots["robot"]
    loads = [(simulation.bodies["ball"].pose[0], MASS)]
    for link in robot.model.links:
        if link.name.startswith("hand_") and link.inertial is not None:
            pos, quat = robot.frame_pose(link.name)
            loads.append((pos + quat_rotate(quat, np.tile(link.inertial.origin.pos, (3, 1))), link.inertial.mass))
    origin, quat = robot.frame_pose(frame)
    lifts = [(pos - origin, np.tile([0.0, 0.0, GRAVITY * mass], (3, 1))) for pos, mass in loads]
    force, torque = sum(lift for _, lift in lifts), sum(np.cross(arm, lift) for arm, lift in lifts)
    back = quat_conjugate(quat)
    return np.concatenate([quat_rotate(back, force), quat_rotate(back, torque)], axis=1)


@pytest.mark.parametrize("simulator", ["mujoco", "pybullet"])
def test_a_force_on_a_link_without_mass_acts_at_its_origin(simulator):
    arm, force = replace(place(ARM_WITH_HAND), command_mode=CommandMode.EFFORT), np.array([[3.0, -2.0, 1.0]])
    load, scene = plugins.get_record("simulator", simulator).load(), Scene(gravity=(0.0, 0.0, 0.0))
    with closing(load({"robot": arm}, scene, num_envs=2, physics_timestep=0.002)) as simulation:
        simulation.reset()
        handle, pushed = simulation.robots["robot"], np.array([True, False])
        simulation.apply_wrench("robot/hand_tcp", force, np.zeros((1, 3)), pushed)
        efforts = (handle.frame_jacobian("hand_tcp")[:, :3] * force[:, :, None]).sum(axis=1)  # Jᵀ F
        handle.command(np.where(pushed[:, None], 0.0, efforts))
        simulation.step(1)
        assert np.abs(handle.joint_velocities[0]).max() > 1e-3
        assert handle.joint_velocities[0] == pytest.approx(handle.joint_velocities[1], rel=1e-6, abs=1e-9)


def test_a_sensor_at_the_base_is_refused():
    robot = replace(ARM_WITH_HAND, sensors={"base": ForceTorque(frame="base")})
    with pytest.raises(UnsuitableRobotError, match="no joint above link 'base'"):
        _ = place(robot).force_torque_sensors
