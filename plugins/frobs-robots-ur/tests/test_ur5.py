from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from frobs_core import plugins
from frobs_core.models import RobotModel, forward_kinematics, home_positions, load_model
from frobs_robots_ur.plugin import frobs_robots
from frobs_robots_ur.ur5 import UR5
from frobs_robots_ur.ur5_gripper import UR5_GRIPPER

MASSES = [4.0, 3.7, 8.393, 2.275, 1.219, 1.219, 0.1879]
LENGTHS = [0.05, 0.15, 0.56, 0.39225, 0.12, 0.12, 0.0823]  # [m] of the cylinders whose inertias the links have
D1, A2, A3, D4, D5, D6 = 0.089159, -0.425, -0.39225, 0.10915, 0.09465, 0.0823


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return load_model(UR5.model)


def limits(model: RobotModel) -> tuple[np.ndarray, np.ndarray]:
    joints = model.actuated_joints
    return np.array([j.limits.lower for j in joints]), np.array([j.limits.upper for j in joints])


def test_the_records_lead_to_the_robots() -> None:
    assert [record.load() for record in frobs_robots()] == [UR5, UR5_GRIPPER]
    assert plugins.get_record("robot", "ur5").load() is UR5


def test_limits_are_the_robots(model: RobotModel) -> None:
    lower, upper = limits(model)
    assert upper == pytest.approx([2 * math.pi, 2 * math.pi, math.pi] + [2 * math.pi] * 3)
    assert (lower == -upper).all()
    assert [j.limits.velocity for j in model.actuated_joints] == [3.15] * 3 + [3.2] * 3
    assert [j.limits.effort for j in model.actuated_joints] == [150.0] * 3 + [28.0] * 3


def test_masses_and_inertias_are_those_of_solid_cylinders(model: RobotModel) -> None:
    found = [link.inertial for link in model.links if link.inertial]
    assert [one.mass for one in found] == MASSES
    for one, mass, length in zip(found, MASSES, LENGTHS, strict=True):
        across, along = mass * (3 * 0.06**2 + length**2) / 12, mass * 0.06**2 / 2
        assert one.inertia == pytest.approx((across, 0, 0, across, 0, along), rel=1e-12)


def test_the_tool_is_where_denavit_and_hartenberg_put_it(model: RobotModel) -> None:
    """The controller's base looks the other way: the file's x and y are its −x and −y."""
    positions = np.random.default_rng(0).uniform(*limits(model), (50, 6))
    rows = zip((D1, 0, 0, D4, D5, D6), (0, A2, A3, 0, 0, 0), (90, 0, 0, 90, -90, 0), strict=True)
    table = [(d, a, math.radians(alpha)) for d, a, alpha in rows]
    for q, pos in zip(positions, forward_kinematics(model, "tool0", positions)[0], strict=True):
        pose = np.eye(4)
        for angle, (d, a, alpha) in zip(q, table, strict=True):
            c, s, ca, sa = math.cos(angle), math.sin(angle), math.cos(alpha), math.sin(alpha)
            pose = pose @ [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        np.testing.assert_allclose(pos, pose[:3, 3] * (-1, -1, 1), rtol=0, atol=1e-9)


@pytest.mark.needs("pinocchio")
def test_kinematics_are_pinocchios(model: RobotModel) -> None:
    import pinocchio as pin

    theirs = pin.buildModelFromXML(model.xml)
    data, frame = theirs.createData(), theirs.getFrameId("tool0")
    positions = np.random.default_rng(0).uniform(*limits(model), (200, 6))
    for q, pos in zip(positions, forward_kinematics(model, "tool0", positions)[0], strict=True):
        pin.framesForwardKinematics(theirs, data, q)
        np.testing.assert_allclose(pos, data.oMf[frame].translation, rtol=0, atol=1e-9)


def test_home_touches_nothing_and_is_away_from_limits_and_singularities(model: RobotModel) -> None:
    home, (lower, upper) = home_positions(model, UR5.home), limits(model)
    engine = mujoco.MjModel.from_xml_string(model.xml)
    data = mujoco.MjData(engine)
    data.qpos[:] = home
    mujoco.mj_forward(engine, data)
    assert not data.ncon
    assert data.geom_xpos[1:, 2].min() > 0.05
    assert np.minimum(home - lower, upper - home).min() > 1.0
    pos, _ = forward_kinematics(model, "tool0", home[None])
    assert pos[0] == pytest.approx([0.407, 0.109, 0.366], abs=1e-3)
    nudged, _ = forward_kinematics(model, "tool0", home + 1e-6 * np.eye(6))
    assert np.linalg.svd((nudged - pos) / 1e-6, compute_uv=False).min() > 0.05


def test_neighbours_touch_nowhere_and_turning_one_joint_only_where_the_elbow_folds(model: RobotModel) -> None:
    engine = mujoco.MjModel.from_xml_string(model.xml)
    data = mujoco.MjData(engine)
    home, (lower, upper) = home_positions(model, UR5.home), limits(model)
    for joint in range(6):
        for value in np.linspace(lower[joint], upper[joint], 41):
            q = home.copy()
            q[joint] = value
            data.qpos[:] = q
            mujoco.mj_forward(engine, data)
            assert not data.ncon or (joint == 2 and abs(value) > 2.7), (joint, value)


def test_a_prefix_names_all_links_and_joints() -> None:
    twin = load_model(UR5.model, xacro_args={"prefix": "left_"})
    assert (twin.root, twin.joint_names[0]) == ("left_base_link", "left_shoulder_pan_joint")
