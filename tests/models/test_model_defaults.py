from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from frobs_core.models import (
    Inertial,
    Joint,
    JointLimits,
    JointType,
    Link,
    Mimic,
    Pose,
    RobotModel,
    default_gains,
    default_tcp,
    home_positions,
    load_model,
)
from frobs_core.models.defaults import composite_inertia
from frobs_core.util.errors import ConfigurationError, UnknownNameError

BALL = Inertial(2.0, Pose((0.0, 0.0, 0.5)), (0.1, 0.0, 0.0, 0.1, 0.0, 0.1))


def make(joints: list[Joint], inertial: Inertial | None = BALL) -> RobotModel:
    links = (Link("base"), *(Link(joint.child, inertial=inertial) for joint in joints))
    return RobotModel("made", Path("made"), "urdf", "", links, tuple(joints))


def hinge(name: str, parent: str, child: str, low: float = -1.0, high: float = 1.0, **fields) -> Joint:
    limits = JointLimits(low, high)
    return Joint(name, JointType.REVOLUTE, parent, child, limits=limits, **fields)


def slide(name: str, parent: str, child: str, **fields) -> Joint:
    return Joint(name, JointType.PRISMATIC, parent, child, **fields)


def fixed(parent: str, child: str) -> Joint:
    return Joint(f"to_{child}", JointType.FIXED, parent, child)


def test_home_is_zero_or_the_middle_unless_given():
    model = make(
        [
            hinge("a", "base", "1"),
            hinge("b", "1", "2", 0.5, 1.5),
            hinge("c", "2", "3"),
            hinge("d", "3", "4", -math.inf, -2.0),
        ]
    )
    assert home_positions(model, {"c": 0.25}).tolist() == [0.0, 1.0, 0.25, -2.0]


def test_home_of_an_unknown_joint_names_the_nearest():
    with pytest.raises(UnknownNameError, match="Did you mean 'elbow'"):
        home_positions(make([hinge("elbow", "base", "1")]), {"elbw": 0.0})


@pytest.mark.parametrize("value", [1.5, math.nan, math.inf])
def test_home_outside_of_the_limits_is_refused(value):
    with pytest.raises(ConfigurationError, match=r"must be inside its limits \[-1, 1\]"):
        home_positions(make([hinge("a", "base", "1")]), {"a": value})


@pytest.mark.parametrize(
    ("joints", "tcp"),
    [
        ([], "base"),
        ([hinge("a", "base", "1"), hinge("b", "1", "2")], "2"),
        ([hinge("a", "base", "1"), fixed("1", "2"), fixed("2", "3")], "3"),
        ([hinge("a", "base", "1"), fixed("1", "tool0"), fixed("1", "cover"), fixed("cover", "screw")], "tool0"),
        ([hinge("a", "base", "1"), fixed("1", "left_tool0"), fixed("1", "tcp")], "left_tool0"),
        ([fixed("base", "tcp"), hinge("a", "base", "1"), hinge("b", "1", "2")], "2"),
        ([hinge("a", "base", "1"), hinge("b", "1", "2"), hinge("c", "1", "3")], "2"),
    ],
    ids=[
        "one link",
        "last",
        "fixed counts",
        "usual name",
        "likeliest name, prefixed",
        "moving first",
        "first of equals",
    ],
)
def test_default_tcp(joints, tcp):
    assert default_tcp(make(joints)) == tcp


def test_default_gains_are_critically_damped():
    model = make([hinge("a", "base", "1", axis=(0.0, 1.0, 0.0)), slide("s", "1", "2", axis=(0.0, 1.0, 0.0))])
    gains = default_gains(model, np.zeros(2), bandwidth_hz=5.0)
    omega = 10 * math.pi
    inertia = 2 * (0.1 + 2.0 * 0.25)
    assert gains.of("a") == pytest.approx((inertia * omega**2, 2 * inertia * omega))
    assert gains.of("s") == pytest.approx((2.0 * omega**2, 4.0 * omega))


def test_default_gains_are_for_the_posture_that_is_hardest_to_turn():
    stretched_out = make([hinge("a", "base", "1", axis=(0.0, 0.0, 1.0)), hinge("b", "1", "2", axis=(0.0, 1.0, 0.0))])
    gains = default_gains(stretched_out, np.zeros(2), bandwidth_hz=5.0)
    upright, bent = composite_inertia(stretched_out, (0.0, 0.0))["a"], composite_inertia(stretched_out, (0.0, 1.0))["a"]
    assert 0.95 * bent < gains.of("a")[0] / (10 * math.pi) ** 2 <= bent
    assert bent > 2 * upright


def test_what_mimics_a_joint_is_moved_with_it():
    joints = [slide("left", "base", "1"), slide("right", "base", "2", mimic=Mimic("left", -2.0))]
    assert composite_inertia(make(joints), [0.0]) == {"left": pytest.approx(2.0 + 4 * 2.0)}


@pytest.mark.needs("pinocchio")
def test_the_inertia_about_each_joint_is_that_of_pinocchio():
    import pinocchio

    model = load_model("frobs_robots_abb:models/irb120.urdf.xacro")
    theirs = pinocchio.buildModelFromXML(model.xml)
    q = np.array([0.3, -0.4, 0.5, 1.0, -0.7, 2.0])
    mass_matrix = pinocchio.crba(theirs, theirs.createData(), q)
    ours = composite_inertia(model, q)
    assert [ours[name] for name in theirs.names[1:]] == pytest.approx(np.maximum(np.diag(mass_matrix), 1e-3), rel=1e-9)


def test_joints_that_move_nothing_still_hold():
    gains = default_gains(make([hinge("a", "base", "1")], None), np.zeros(1), bandwidth_hz=5.0)
    assert gains.of("a")[0] > 0.5
