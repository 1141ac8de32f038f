from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from frobs_core import plugins
from frobs_core.kernel.env import RobotEnv
from frobs_core.models import RobotModel, forward_kinematics, home_positions, load_model
from frobs_devkit.doctor.robot import examine_robot
from frobs_robots_franka.panda import PANDA
from frobs_robots_franka.panda_arm import PANDA_ARM
from frobs_robots_franka.plugin import frobs_robots

LOWER = [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973]
UPPER = [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973]
# a [m], d [m] and alpha [rad] of each joint and of the flange, in Craig's convention, as the maker publishes them
TABLE = [
    (0.0, 0.333, 0.0),
    (0.0, 0.0, -math.pi / 2),
    (0.0, 0.316, math.pi / 2),
    (0.0825, 0.0, math.pi / 2),
    (-0.0825, 0.384, -math.pi / 2),
    (0.0, 0.0, math.pi / 2),
    (0.088, 0.0, math.pi / 2),
    (0.0, 0.107, 0.0),
]


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return load_model(PANDA_ARM.model)


def some_positions(count: int) -> np.ndarray:
    """Return joint positions inside the limits, (count, 7) [rad]."""
    return np.random.default_rng(0).uniform(LOWER, UPPER, (count, 7))


def test_the_records_lead_to_the_robots() -> None:
    assert [record.load() for record in frobs_robots()] == [PANDA, PANDA_ARM]
    assert plugins.get_record("robot", "panda").load() is PANDA


def test_limits_are_the_makers(model: RobotModel) -> None:
    limits = [joint.limits for joint in model.actuated_joints]
    assert [each.lower for each in limits] == LOWER
    assert [each.upper for each in limits] == UPPER
    assert [each.velocity for each in limits] == [2.175] * 4 + [2.61] * 3
    assert [each.effort for each in limits] == [87.0] * 4 + [12.0] * 3


def test_the_arm_weighs_18_kg(model: RobotModel) -> None:
    def mass(of: RobotModel) -> float:
        return sum(link.inertial.mass for link in of.links if link.inertial)

    assert mass(model) == pytest.approx(17.89, abs=0.01)
    assert mass(load_model(PANDA.model)) == pytest.approx(17.89 + 0.73, abs=0.01)


def test_the_flange_is_where_the_makers_parameters_put_it(model: RobotModel) -> None:
    positions = some_positions(50)
    found_pos, found_quat = forward_kinematics(model, "panda_link8", positions)
    for q, pos, (w, x, y, z) in zip(positions, found_pos, found_quat, strict=True):
        pose = np.eye(4)
        for theta, (a, d, alpha) in zip([*q, 0.0], TABLE, strict=True):
            c, s, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
            pose = pose @ [[c, -s, 0, a], [s * ca, c * ca, -sa, -sa * d], [s * sa, c * sa, ca, ca * d], [0, 0, 0, 1]]
        np.testing.assert_allclose(pos, pose[:3, 3], rtol=0, atol=1e-9)
        z_axis = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
        np.testing.assert_allclose(z_axis, pose[:3, 2], rtol=0, atol=1e-9)


@pytest.mark.needs("pinocchio")
def test_kinematics_are_pinocchios(model: RobotModel) -> None:
    import pinocchio as pin

    theirs = pin.buildModelFromXML(model.xml)
    data, frame = theirs.createData(), theirs.getFrameId("panda_tool0")
    positions = some_positions(200)
    for q, pos in zip(positions, forward_kinematics(model, "panda_tool0", positions)[0], strict=True):
        pin.framesForwardKinematics(theirs, data, q)
        np.testing.assert_allclose(pos, data.oMf[frame].translation, rtol=0, atol=1e-9)


def test_at_home_the_hand_points_down_and_its_fingers_open_sideways() -> None:
    model = load_model(PANDA.model)
    home = home_positions(model, PANDA.home)[None]
    pos, quat = model.frame_pose("gripper_tcp", home)
    assert pos[0] == pytest.approx([0.3069, 0.0, 0.4869], abs=1e-4)
    assert np.abs(quat[0]) == pytest.approx([0.0, 1.0, 0.0, 0.0], abs=1e-9)  # half a turn about x
    left, right = (model.frame_pose(f"gripper_{side}_finger", home)[0][0] for side in ("left", "right"))
    np.testing.assert_allclose(np.abs(left - right), [0.0, 0.08, 0.0], atol=1e-9)


def test_no_link_touches_another_while_one_joint_turns(model: RobotModel) -> None:
    engine = mujoco.MjModel.from_xml_string(model.xml)
    data = mujoco.MjData(engine)
    home = home_positions(model, PANDA_ARM.home)
    for joint in range(7):
        for value in np.linspace(LOWER[joint], UPPER[joint], 41):
            data.qpos[:] = home
            data.qpos[joint] = value
            mujoco.mj_forward(engine, data)
            assert not data.ncon, (joint, value)


@pytest.mark.parametrize("name", ["panda", "panda_arm"])
def test_the_doctor_finds_nothing(name: str) -> None:
    assert examine_robot(name, simulators=("mujoco", "pybullet")).findings == ()


def test_the_drives_hold_the_arm_and_follow_without_overshoot() -> None:
    env = RobotEnv(
        task="reach",
        robot="panda",
        controller={"arm": "joint_delta_position"},
        controller_kwargs={"arm": {"max_delta": 0.08}},
    )
    env.reset(seed=0)
    robot = env.robot
    tool = robot.frame_pose("tcp")[0][0].copy()
    still = np.zeros(8)
    for _ in range(40):
        env.step(still)
    assert np.linalg.norm(robot.frame_pose("tcp")[0][0] - tool) < 0.006  # it hangs under gravity
    rest = robot.joint_positions[0].copy()
    for joint in range(7):
        step = np.eye(8)[joint]
        env.step(step)
        reached = []
        for _ in range(30):
            env.step(still)
            reached.append(robot.joint_positions[0, joint] - rest[joint])
        moved = reached[-1]
        assert moved == pytest.approx(0.08, abs=0.003)
        assert max(reached) < moved + 0.002
        env.step(-step)
        for _ in range(30):
            env.step(still)
    np.testing.assert_allclose(robot.joint_positions[0], rest, atol=1e-3)
    env.close()


def test_a_prefix_names_all_links_and_joints() -> None:
    twin = load_model(PANDA_ARM.model, xacro_args={"prefix": "left_"})
    assert (twin.root, twin.joint_names[0]) == ("left_link0", "left_joint1")
