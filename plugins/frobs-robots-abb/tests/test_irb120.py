from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from frobs_core.models import RobotModel, forward_kinematics, home_positions, load_model
from frobs_core.models.defaults import composite_inertia
from frobs_robots_abb.irb120 import IRB120
from frobs_robots_abb.plugin import frobs_robots


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return load_model(IRB120.model)


@pytest.fixture(scope="module")
def engine(model: RobotModel) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(model.xml)


def limits(model: RobotModel) -> tuple[np.ndarray, np.ndarray]:
    joints = model.actuated_joints
    return np.array([j.limits.lower for j in joints]), np.array([j.limits.upper for j in joints])


def test_the_record_leads_to_the_robot() -> None:
    record, _ = frobs_robots()
    assert record.load() is IRB120


def test_the_file_needs_no_repair(model: RobotModel) -> None:
    assert model.notes == ()
    assert model.joint_names == tuple(f"joint_{i}" for i in range(1, 7))
    assert model.root == "base_link"


def test_limits_masses_and_velocities_are_frobs_rls(model: RobotModel) -> None:
    lower, upper = limits(model)
    assert lower.tolist() == [-2.87979, -1.91986, -1.91986, -2.79253, -2.094395, -6.98132]
    assert upper.tolist() == [2.87979, 1.91986, 1.22173, 2.79253, 2.094395, 6.98132]
    assert [j.limits.velocity for j in model.actuated_joints] == [4.36332] * 3 + [5.58505] * 2 + [7.33038]
    assert {j.limits.effort for j in model.actuated_joints} == {1000.0}
    masses = [link.inertial.mass for link in model.links if link.inertial]
    assert masses == [6.215, 3.067, 3.909, 2.944, 1.328, 0.546, 0.137]


def test_the_tool_is_where_the_dimensions_say_at_zero(model: RobotModel) -> None:
    pos, quat = forward_kinematics(model, "tool0", np.zeros((1, 6)))
    assert pos[0] == pytest.approx([0.374, 0.0, 0.63], abs=1e-15)
    assert quat[0] == pytest.approx([math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0])


def test_kinematics_are_the_engines(model: RobotModel, engine: mujoco.MjModel) -> None:
    data = mujoco.MjData(engine)
    positions = np.random.default_rng(0).uniform(*limits(model), (200, 6))
    pos, quat = forward_kinematics(model, "link_6", positions)
    for q, p, r in zip(positions, pos, quat, strict=True):
        data.qpos[:] = q
        mujoco.mj_kinematics(engine, data)
        assert p == pytest.approx(data.body("link_6").xpos, abs=1e-12)
        assert abs(r @ data.body("link_6").xquat) == pytest.approx(1, abs=1e-12)


def touching(engine: mujoco.MjModel, data: mujoco.MjData, q: np.ndarray) -> set[frozenset[str]]:
    data.qpos[:] = q
    mujoco.mj_forward(engine, data)
    geoms = [(contact.geom1, contact.geom2) for contact in data.contact]
    return {frozenset(engine.body(engine.geom_bodyid[geom]).name for geom in pair) for pair in geoms}


def test_the_arm_touches_itself_nowhere_but_where_it_folds(model: RobotModel, engine: mujoco.MjModel) -> None:
    data = mujoco.MjData(engine)
    home = home_positions(model, IRB120.home)
    assert touching(engine, data, home) == set()
    assert touching(engine, data, np.zeros(6)) == set()
    lower, upper = limits(model)
    for joint in range(6):  # each joint alone, over its whole range
        for value in np.linspace(lower[joint], upper[joint], 41):
            q = home.copy()
            q[joint] = value
            assert touching(engine, data, q) == set(), (joint, value)
    positions = np.random.default_rng(1).uniform(lower, upper, (500, 6))
    folded = [pairs for q in positions if (pairs := touching(engine, data, q))]
    assert len(folded) < 0.1 * len(positions)
    # the front of the arm reaches the foot; a link never meets the next but one, whatever the pose
    order = ["world", *(f"link_{i}" for i in range(1, 7))]
    for first, second in (sorted(map(order.index, pair)) for pairs in folded for pair in pairs):
        assert second - first > 2


def test_the_arm_collides_with_its_own_foot(model: RobotModel, engine: mujoco.MjModel) -> None:
    assert touching(engine, mujoco.MjData(engine), np.array([0.0, 1.9, 1.2, 0.0, 0.0, 0.0]))


def test_home_is_away_from_limits_and_singularities(model: RobotModel) -> None:
    home = home_positions(model, IRB120.home)
    lower, upper = limits(model)
    assert np.minimum(home - lower, upper - home).min() > 0.5
    pos, _ = forward_kinematics(model, "tool0", home[None])
    assert pos[0] == pytest.approx([0.359, 0.0, 0.43], abs=1e-3)
    step = 1e-6
    nudged, _ = forward_kinematics(model, "tool0", home + step * np.eye(6))
    singular_values = np.linalg.svd((nudged - pos) / step, compute_uv=False)
    assert singular_values.min() > 0.05


def test_drives_are_critically_damped_or_more_everywhere(model: RobotModel) -> None:
    rng = np.random.default_rng(2)
    for q in rng.uniform(*limits(model), (50, 6)):
        for name, inertia in composite_inertia(model, q).items():
            assert IRB120.gains is not None
            stiffness, damping = IRB120.gains.of(name)
            assert damping / (2 * math.sqrt(stiffness * inertia)) > 0.99, name


def test_xacro_arguments_are_taken() -> None:
    twin = load_model(IRB120.model, xacro_args={"prefix": "left_", "effort": "50"})
    assert twin.root == "left_base_link"
    assert twin.joint_names[0] == "left_joint_1"
    assert twin.actuated_joints[0].limits.effort == 50
