from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frobs_core.models import (
    Joint,
    JointType,
    Link,
    Mimic,
    Pose,
    RobotModel,
    default_tcp,
    forward_kinematics,
    joint_path,
    load_model,
)
from frobs_core.util.errors import ConfigurationError, UnknownNameError
from frobs_core.util.rotations import quat_from_axis_angle, quat_from_rpy, quat_multiply, quat_rotate

mujoco = pytest.importorskip("mujoco")


def make(*joints: Joint) -> RobotModel:
    links = [Link("base"), *(Link(joint.child) for joint in joints)]
    return RobotModel("made", Path("made"), "urdf", "", tuple(links), tuple(joints))


def place(pos=(0.0, 0.0, 0.0), rpy=(0.0, 0.0, 0.0)) -> Pose:
    return Pose(pos, tuple(quat_from_rpy(rpy).tolist()))


CRANE = make(
    Joint("turn", JointType.CONTINUOUS, "base", "mast", place((0.1, 0.2, 0.3), (0.4, 0.5, 0.6)), (0.0, 0.0, 1.0)),
    Joint("bolt", JointType.FIXED, "mast", "head", place((0.0, 0.1, 0.2), (1.0, 0.0, 0.5))),
    Joint("slide", JointType.PRISMATIC, "head", "cart", place((0.3, 0.0, 0.1), (0.2, 0.1, 0.0)), (0.6, 0.0, -0.8)),
    Joint("swing", JointType.REVOLUTE, "cart", "hook", place(rpy=(0.0, 0.3, 0.0)), (0.0, -1.0, 0.0)),
    Joint(
        "follow",
        JointType.REVOLUTE,
        "hook",
        "tip",
        place((0.0, 0.0, -0.4)),
        (1.0, 0.0, 0.0),
        mimic=Mimic("turn", 2.0, 0.1),
    ),
    Joint("tool", JointType.FIXED, "tip", "tool", place((0.0, 0.2, 0.0), (0.0, 0.0, 1.0))),
)


def one_by_one(model: RobotModel, frame: str, q: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """The definition: each joint's frame, then its motion, from the tip to the root."""
    pos, quat = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    above = {joint.child: joint for joint in model.joints}
    while frame in above:
        joint = above[frame]
        value = q.get(joint.name, 0.0)
        if joint.mimic:
            value = joint.mimic.multiplier * q[joint.mimic.joint] + joint.mimic.offset
        axis = np.array(joint.axis)
        if joint.type is JointType.PRISMATIC:
            pos = pos + value * axis
        elif joint.type is not JointType.FIXED:
            turn = quat_from_axis_angle(axis, value)
            pos, quat = quat_rotate(turn, pos), quat_multiply(turn, quat)
        pos = np.array(joint.origin.pos) + quat_rotate(joint.origin.quat_wxyz, pos)
        quat = quat_multiply(joint.origin.quat_wxyz, quat)
        frame = joint.parent
    return pos, quat


@pytest.mark.parametrize("frame", [link.name for link in CRANE.links])
def test_every_kind_of_joint_moves_as_defined(frame):
    positions = np.random.default_rng(1).uniform(-3, 3, (10, 3))
    pos, quat = forward_kinematics(CRANE, frame, positions)
    assert (pos.shape, quat.shape) == ((10, 3), (10, 4))
    for q, p, r in zip(positions, pos, quat, strict=True):
        expected = one_by_one(CRANE, frame, dict(zip(CRANE.joint_names, q, strict=True)))
        assert p == pytest.approx(expected[0], abs=1e-13)
        assert r == pytest.approx(expected[1], abs=1e-13)


@given(st.integers(0, 2**32 - 1), st.integers(1, 40))
def test_a_row_does_not_depend_on_how_many_there_are(seed, n):
    positions = np.random.default_rng(seed).uniform(-7, 7, (n, 3))
    pos, quat = forward_kinematics(CRANE, "tool", positions)
    for i in range(n):
        one = forward_kinematics(CRANE, "tool", positions[i : i + 1])
        assert np.array_equal(one[0][0], pos[i])
        assert np.array_equal(one[1][0], quat[i])


@given(st.integers(0, 2**32 - 1))
def test_memory_layout_changes_nothing(seed):
    positions = np.random.default_rng(seed).uniform(-7, 7, (7, 3))
    pos, quat = forward_kinematics(CRANE, "tool", positions)
    for other in (np.asfortranarray(positions), np.repeat(positions, 2, axis=1)[:, ::2]):
        again = forward_kinematics(CRANE, "tool", other)
        assert np.array_equal(again[0], pos)
        assert np.array_equal(again[1], quat)


def test_results_are_the_callers_own():
    positions = np.zeros((2, 3))
    pos, quat = forward_kinematics(CRANE, "base", positions)
    pos += 1.0
    quat += 1.0
    assert forward_kinematics(CRANE, "base", positions)[0].max() == 0.0


def test_a_urdf_moves_as_in_mujoco(tmp_path):
    joints = "".join(
        f'<link name="l{i + 1}"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
        f'</inertial></link><joint name="j{i}" type="{kind}"><parent link="l{i}"/><child link="l{i + 1}"/>'
        f'<origin xyz="0.1 {i * 0.2} 0.3" rpy="{0.3 * i} -0.5 {0.7 - i}"/><axis xyz="{axis}"/>'
        '<limit lower="-3" upper="3" effort="9" velocity="9"/></joint>'
        for i, (kind, axis) in enumerate(
            [("revolute", "1 2 3"), ("prismatic", "0 1 1"), ("continuous", "-1 0 0"), ("revolute", "0 -2 0.1")]
        )
    )
    path = tmp_path / "snake.urdf"
    path.write_text(f'<robot name="snake"><link name="l0"/>{joints}</robot>')
    model = load_model(path)
    compiled = mujoco.MjModel.from_xml_string(model.xml)
    data = mujoco.MjData(compiled)
    positions = np.random.default_rng(2).uniform(-3, 3, (50, 4))
    pos, quat = forward_kinematics(model, "l4", positions)
    for q, p, r in zip(positions, pos, quat, strict=True):
        data.qpos[:] = q
        mujoco.mj_kinematics(compiled, data)
        assert p == pytest.approx(data.body("l4").xpos, abs=1e-12)
        assert abs(r @ data.body("l4").xquat) == pytest.approx(1, abs=1e-12)


def test_no_rows_give_no_rows():
    pos, quat = forward_kinematics(CRANE, "tool", np.zeros((0, 3)))
    assert (pos.shape, quat.shape) == ((0, 3), (0, 4))


def test_an_unknown_frame_is_named_with_the_nearest():
    with pytest.raises(UnknownNameError, match="Did you mean 'hook'"):
        forward_kinematics(CRANE, "hok", np.zeros((1, 3)))


@pytest.mark.parametrize("shape", [(3,), (1, 4), (1, 1, 3)])
def test_a_wrong_shape_is_refused(shape):
    with pytest.raises(ConfigurationError, match=r"must be \(n, 3\)"):
        forward_kinematics(CRANE, "tool", np.zeros(shape))


def test_models_carry_their_own_kinematics():
    other = make(CRANE.joints[0])
    assert default_tcp(other) == "mast"
    with pytest.raises(UnknownNameError):
        other.frame_pose("tool", np.zeros((1, 1)))


def test_the_path_to_a_link_is_the_joints_from_the_root():
    path = joint_path(CRANE, CRANE.links[-1].name)
    assert [joint.parent for joint in path[1:]] == [joint.child for joint in path[:-1]]
    assert (path[0].parent, path[-1].child) == (CRANE.root, CRANE.links[-1].name)
    assert joint_path(CRANE, CRANE.root) == []
