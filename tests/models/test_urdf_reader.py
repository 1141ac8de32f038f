from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from frobs_core.errors import ModelFileError
from frobs_core.models import Box, Capsule, Cylinder, JointType, Mesh, Mimic, Sphere, load_model

mujoco = pytest.importorskip("mujoco")

INERTIAL = '<inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>'
LIMIT = '<limit lower="-1" upper="2" velocity="3" effort="4"/>'


def link(name: str, inside: str = INERTIAL) -> str:
    return f'<link name="{name}">{inside}</link>'


def joint(name: str, parent: str, child: str, inside: str = LIMIT, kind: str = "revolute") -> str:
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'


def robot(*parts: str) -> str:
    return '<robot name="r">\n' + "\n".join(parts) + "\n</robot>"


def arm(inside: str = LIMIT, kind: str = "revolute") -> str:
    return robot(link("a"), link("b"), joint("j", "a", "b", inside, kind))


@pytest.fixture
def write(tmp_path: Path):
    def write(text: str, name: str = "r.urdf") -> Path:
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


def test_everything_in_a_joint_is_read(write):
    inside = (
        '<origin xyz="1 2 3" rpy="0.1 0.2 0.3"/><axis xyz="0 3 4"/><dynamics damping="0.5" friction="0.25"/>' + LIMIT
    )
    model = load_model(write(arm(inside)))
    (j,) = model.joints
    assert (j.name, j.type, j.parent, j.child) == ("j", JointType.REVOLUTE, "a", "b")
    assert j.origin.pos == (1, 2, 3)
    expected = np.zeros(4)
    mujoco.mju_euler2Quat(expected, np.array([0.1, 0.2, 0.3]), "XYZ")
    assert j.origin.quat_wxyz == pytest.approx(expected, abs=1e-15)
    assert j.axis == pytest.approx((0, 0.6, 0.8))
    assert (j.limits.lower, j.limits.upper, j.limits.velocity, j.limits.effort) == (-1, 2, 3, 4)
    assert (j.damping, j.friction) == (0.5, 0.25)
    assert (model.name, model.root, model.joint_names, model.notes) == ("r", "a", ("j",), ())


def test_shapes_and_colours_are_read(write, tmp_path):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "part.stl").write_bytes(b"solid")
    shapes = [
        '<box size="1 2 3"/>',
        '<sphere radius="0.5"/>',
        '<cylinder radius="0.1" length="0.4"/>',
        '<capsule radius="0.1" length="0.4"/>',
        '<mesh filename="meshes/part.stl" scale="1 1 -2"/>',
    ]
    visuals = "".join(f'<visual><geometry>{s}</geometry><material name="red"/></visual>' for s in shapes)
    collision = '<collision><origin xyz="0 0 1"/><geometry><box size="1 1 1"/></geometry></collision>'
    text = robot('<material name="red"><color rgba="1 0 0 2"/></material>', link("a", visuals + collision))
    model = load_model(write(text))
    (only,) = model.links
    assert [v.geometry for v in only.visuals] == [
        Box((1, 2, 3)),
        Sphere(0.5),
        Cylinder(0.1, 0.4),
        Capsule(0.1, 0.4),
        Mesh(tmp_path / "meshes" / "part.stl", (1, 1, -2)),
    ]
    assert {v.rgba for v in only.visuals} == {(1, 0, 0, 1)}
    assert only.collisions[0].origin.pos == (0, 0, 1)
    assert "clipped" in str(model.notes[0])
    assert str(tmp_path / "meshes" / "part.stl") in model.xml


def test_mimic_joints_follow_the_actuated_one_at_the_end_of_the_line(write):
    text = robot(
        *(link(name) for name in "abcd"),
        joint("lead", "a", "b"),
        joint("second", "a", "c", LIMIT + '<mimic joint="lead" multiplier="2" offset="0.5"/>'),
        joint("third", "a", "d", LIMIT + '<mimic joint="second" multiplier="-3" offset="1"/>'),
    )
    model = load_model(write(text))
    assert model.joint_names == ("lead",)
    assert model.joints[1].mimic == Mimic("lead", 2, 0.5)
    assert model.joints[2].mimic == Mimic("lead", -6, -0.5)


def test_joint_order_is_the_files(write):
    text = robot(*(link(n) for n in "abcd"), joint("z", "c", "d"), joint("y", "a", "b"), joint("x", "b", "c"))
    assert load_model(write(text)).joint_names == ("z", "y", "x")


def test_simulator_tags_are_ignored_and_unknown_ones_noted(write):
    extras = '<gazebo reference="a"/><transmission name="t"/><ros2_control name="c"/>'
    assert load_model(write(robot(link("a"), extras))).notes == ()
    assert "<wheel>" in str(load_model(write(robot(link("a"), "<wheel/>"))).notes[0])


def test_continuous_joints_have_no_position_limits(write):
    (j,) = load_model(write(arm(LIMIT, "continuous"))).joints
    assert (j.limits.lower, j.limits.upper, j.limits.velocity) == (-math.inf, math.inf, 3)


def test_limits_of_zero_are_unlimited_and_noted(write):
    model = load_model(write(arm('<limit lower="-1" upper="1" effort="0"/>')))
    assert model.joints[0].limits.effort == model.joints[0].limits.velocity == math.inf
    assert len(model.notes) == 2


@pytest.mark.parametrize(
    ("inertial", "mass", "note"),
    [
        ("", 0.001, "moves but has no mass"),
        ('<inertial><mass value="0"/></inertial>', 0.001, "mass of 0"),
        ('<inertial><mass value="2"/></inertial>', 2.0, "no inertia"),
        (INERTIAL.replace('izz="0.1"', 'izz="0.5"'), 1.0, "that no body has"),
    ],
    ids=["none", "massless", "no inertia", "impossible"],
)
def test_inertia_is_repaired_with_a_note_and_the_engine_sees_the_same(write, inertial, mass, note):
    model = load_model(write(robot(link("a"), link("b", inertial), joint("j", "a", "b"))))
    assert any(note in str(line) for line in model.notes)
    repaired = model.links[1].inertial
    assert repaired is not None
    assert repaired.mass == mass
    compiled = mujoco.MjModel.from_xml_string(model.xml)
    assert compiled.body("b").mass[0] == pytest.approx(mass)
    ixx, _, _, iyy, _, izz = repaired.inertia
    assert np.sort(compiled.body("b").inertia) == pytest.approx(np.sort([ixx, iyy, izz]))


def test_a_frame_that_is_fixed_to_a_body_needs_no_mass(write):
    text = robot(link("a"), link("b"), link("tool", ""), joint("j", "a", "b"), joint("t", "b", "tool", "", "fixed"))
    model = load_model(write(text))
    assert model.links[2].inertial is None
    assert model.notes == ()


BAD = {
    "empty": ("", "empty"),
    "only blanks": (" \n ", "empty"),
    "broken": ('<robot name="r">\n<link name="a">\n</robot>', ":3: not well-formed"),
    "not a robot": ("<html/>", "<robot> (URDF) or <mujoco>"),
    "no links": (robot(), "there is no <link>"),
    "two links": (robot(link("a"), link("a")), ":3: <link name=\"a\">: the name 'a' is taken: the first is in line 2"),
    "two joints": (robot(link("a"), link("b"), joint("j", "a", "b"), joint("j", "a", "b")), "the name 'j' is taken"),
    "nameless link": (robot("<link/>"), "'name' is missing"),
    "unknown parent": (robot(link("arm"), link("b"), joint("j", "arn", "b")), "Did you mean 'arm'"),
    "unknown child": (robot(link("a"), joint("j", "a", "b")), "child link 'b' does not exist"),
    "no parent": (robot(link("a"), '<joint name="j" type="fixed"/>'), "<parent link=…/> is missing"),
    "two roots": (robot(link("a"), link("b")), "the links a, b have no parent"),
    "two parents": (
        robot(*(link(n) for n in "abc"), joint("i", "a", "c"), joint("j", "b", "c"), joint("k", "a", "b")),
        "already the child of joint 'i'",
    ),
    "ring": (robot(link("a"), link("b"), joint("i", "a", "b"), joint("j", "b", "a")), "form a ring"),
    "ring beside a tree": (
        robot(*(link(n) for n in "abc"), joint("i", "a", "b"), joint("j", "b", "a")),
        "form a ring",
    ),
    "joint type": (arm(kind="revolut"), "Did you mean 'revolute'"),
    "zero axis": (arm('<axis xyz="0 0 0"/>' + LIMIT), "is zero"),
    "no limits": (arm(""), "needs <limit"),
    "no range": (arm('<limit effort="1" velocity="1"/>'), 'write type="continuous"'),
    "range upside down": (arm('<limit lower="1" upper="-1" effort="1" velocity="1"/>'), "no range"),
    "negative effort": (arm('<limit lower="0" upper="1" effort="-1" velocity="1"/>'), "negative"),
    "NaN": (arm('<origin xyz="0 nan 0"/>' + LIMIT), "not finite"),
    "infinite": (arm('<limit lower="-inf" upper="1" effort="1" velocity="1"/>'), "not finite"),
    "words": (arm('<origin xyz="0 zero 0"/>' + LIMIT), "is not 3 numbers"),
    "too few numbers": (arm('<origin xyz="0 0"/>' + LIMIT), "holds 2 numbers; it takes 3"),
    "negative mass": (robot(link("a", INERTIAL.replace('"1"', '"-1"'))), "mass of -1"),
    "negative inertia": (robot(link("a", INERTIAL.replace('ixx="0.1"', 'ixx="-1"'))), "negative principal moment"),
    "mimic of nothing": (arm(LIMIT + '<mimic joint="i"/>'), "mimics 'i', which does not exist"),
    "mimic of itself": (arm(LIMIT + '<mimic joint="j"/>'), "follows itself"),
    "mimic of a fixed joint": (
        robot(
            *(link(n) for n in "abc"),
            joint("f", "a", "b", "", "fixed"),
            joint("j", "b", "c", LIMIT + '<mimic joint="f"/>'),
        ),
        "which is a fixed joint",
    ),
    "no geometry": (robot(link("a", "<visual/>")), "needs one <geometry>"),
    "unknown shape": (robot(link("a", "<visual><geometry><cone/></geometry></visual>")), "no shape of URDF"),
    "flat box": (
        robot(link("a", '<visual><geometry><box size="1 0 1"/></geometry></visual>')),
        "sizes must be > 0",
    ),
    "missing mesh": (
        robot(link("a", '<visual><geometry><mesh filename="no.stl"/></geometry></visual>')),
        "the mesh 'no.stl' cannot be used",
    ),
    "mesh of an unknown package": (
        robot(link("a", '<visual><geometry><mesh filename="package://pkg/m.stl"/></geometry></visual>')),
        "package_paths={'pkg': FOLDER}",
    ),
    "mesh from the net": (
        robot(link("a", '<visual><geometry><mesh filename="http://x/m.stl"/></geometry></visual>')),
        "nothing is fetched",
    ),
    "xacro in a URDF": (robot("<xacro:thing/>"), "rename it"),
    "entity bomb": (
        '<!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;">]>\n<robot name="&b;"/>',
        "document type",
    ),
    "external entity": ('<!DOCTYPE robot SYSTEM "file:///etc/passwd"><robot name="r"/>', "document type"),
    "too deep": ("<robot>" + "<a>" * 1000 + "</a>" * 1000 + "</robot>", "nested deeper"),
}


@pytest.mark.parametrize(("text", "message"), BAD.values(), ids=BAD.keys())
def test_bad_files_are_refused_by_one_clear_line(write, text, message):
    path = write(text)
    with pytest.raises(ModelFileError) as caught:
        load_model(path)
    assert message in str(caught.value)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_refusal_names_the_line(write):
    with pytest.raises(ModelFileError) as caught:
        load_model(write(robot(link("a"), link("b"), joint("j", "a", "b", '\n<axis xyz="0 0 0"/>' + LIMIT))))
    assert caught.value.line == 5
