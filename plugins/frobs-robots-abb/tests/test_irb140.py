from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from frobs_core import plugins
from frobs_core.models import RobotModel, forward_kinematics, home_positions, load_model
from frobs_core.models.defaults import composite_inertia
from frobs_robots_abb.irb140 import IRB140

MASSES = [26.36, 34.56, 15.99, 16.9793, 3.7398, 0.3039, 0.0549]
COMS = [
    (-0.0820, 0.0004, 0.0599),
    (0.0281, 0.0438, 0.2634),
    (-0.0097, -0.0924, 0.1983),
    (0.0196, 0.0725, -0.0057),
    (0.0726, -0.0012, -0.0014),
    (-0.0014, 0.0006, -0.0002),
    (-0.013, 0, 0),
]
INERTIAS = [  # ixx ixy ixz iyy iyz izz
    (0.222, 0, 0.0156, 0.3553, 0.0017, 0.5236),
    (0.5087, -0.0014, -0.0524, 0.4612, -0.0688, 0.4567),
    (0.3286, 0.0010, -0.0038, 0.2775, 0.0379, 0.0948),
    (0.0682, 0.0063, 0.004, 0.1990, 0.0007, 0.1823),
    (0.0073, 0.0004, -0.0001, 0.0153, 0, 0.0172),
    (0.001, 0, 0, 0.002, 0, 0.001),
    (1e-5, 0, 0, 1e-5, 0, 1e-5),
]


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return load_model(IRB140.model)


@pytest.fixture(scope="module")
def engine(model: RobotModel) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(model.xml)


def limits(model: RobotModel) -> tuple[np.ndarray, np.ndarray]:
    joints = model.actuated_joints
    return np.array([j.limits.lower for j in joints]), np.array([j.limits.upper for j in joints])


def touching(engine: mujoco.MjModel, data: mujoco.MjData, q: np.ndarray) -> set[frozenset[str]]:
    data.qpos[:] = q
    mujoco.mj_forward(engine, data)
    names = [engine.body(body).name for body in engine.geom_bodyid]
    return {frozenset((names[contact.geom1], names[contact.geom2])) for contact in data.contact}


def test_the_record_leads_to_the_robot() -> None:
    assert plugins.get_record("robot", "irb140").load() is IRB140


def test_limits_are_frobs_rls(model: RobotModel) -> None:
    lower, upper = limits(model)
    assert lower.tolist() == [-3.14159, -1.5708, -4.01426, -3.49066, -2.0071, -6.98132]
    assert upper.tolist() == [3.14159, 1.91986, 0.872665, 3.49066, 2.0071, 6.98132]
    assert [j.limits.velocity for j in model.actuated_joints] == [2.618] * 3 + [6.2832] * 3
    assert {j.limits.effort for j in model.actuated_joints} == {1000.0}


def test_masses_and_inertias_are_frobs_rls(model: RobotModel) -> None:
    found = [link.inertial for link in model.links if link.inertial]
    assert [one.mass for one in found] == MASSES
    np.testing.assert_array_equal([one.origin.pos for one in found], COMS)
    np.testing.assert_array_equal([one.inertia for one in found], INERTIAS)


def test_the_tool_is_where_the_dimensions_say_at_zero(model: RobotModel) -> None:
    pos, quat = forward_kinematics(model, "tool0", np.zeros((1, 6)))
    assert pos[0] == pytest.approx([0.515, 0.0, 0.712], abs=1e-15)
    assert quat[0] == pytest.approx([math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0])


@pytest.mark.needs("pinocchio")
def test_kinematics_are_pinocchios(model: RobotModel) -> None:
    import pinocchio as pin

    theirs = pin.buildModelFromXML(model.xml)
    data, frame = theirs.createData(), theirs.getFrameId("tool0")
    positions = np.random.default_rng(0).uniform(*limits(model), (200, 6))
    for q, pos in zip(positions, forward_kinematics(model, "tool0", positions)[0], strict=True):
        pin.framesForwardKinematics(theirs, data, q)
        np.testing.assert_allclose(pos, data.oMf[frame].translation, rtol=0, atol=1e-9)


def test_the_arm_touches_only_its_own_foot_and_folds_past_its_upper_arm(
    model: RobotModel, engine: mujoco.MjModel
) -> None:
    data = mujoco.MjData(engine)
    home, (lower, upper) = home_positions(model, IRB140.home), limits(model)
    assert touching(engine, data, home) == touching(engine, data, np.zeros(6)) == set()
    for joint in range(6):  # each joint alone, over its whole range
        for value in np.linspace(lower[joint], upper[joint], 41):
            q = home.copy()
            q[joint] = value
            assert touching(engine, data, q) == set(), (joint, value)
    positions = np.random.default_rng(1).uniform(lower, upper, (1000, 6))
    folded = [pairs for q in positions if (pairs := touching(engine, data, q))]
    assert len(folded) < 0.05 * len(positions)
    assert all("world" in pair for pairs in folded for pair in pairs)  # the foot, which stands in the world


def test_home_is_away_from_limits_and_singularities(model: RobotModel) -> None:
    home, (lower, upper) = home_positions(model, IRB140.home), limits(model)
    assert np.minimum(home - lower, upper - home).min() > 0.5
    pos, _ = forward_kinematics(model, "tool0", home[None])
    assert pos[0] == pytest.approx([0.505, 0.0, 0.528], abs=1e-3)
    nudged, _ = forward_kinematics(model, "tool0", home + 1e-6 * np.eye(6))
    assert np.linalg.svd((nudged - pos) / 1e-6, compute_uv=False).min() > 0.05


def test_drives_are_critically_damped_or_more_everywhere(model: RobotModel) -> None:
    for q in np.random.default_rng(2).uniform(*limits(model), (50, 6)):
        for name, inertia in composite_inertia(model, q).items():
            assert IRB140.gains is not None
            stiffness, damping = IRB140.gains.of(name)
            assert damping / (2 * math.sqrt(stiffness * inertia)) > 0.99, name


def test_xacro_arguments_are_taken() -> None:
    twin = load_model(IRB140.model, xacro_args={"prefix": "left_", "effort": "50"})
    assert (twin.root, twin.joint_names[0]) == ("left_base_link", "left_joint_1")
    assert twin.actuated_joints[0].limits.effort == 50
