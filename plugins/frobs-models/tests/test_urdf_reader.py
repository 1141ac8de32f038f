from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from frobs_core.models import Box, Capsule, Cylinder, JointType, Mesh, Mimic, Sphere, load_model
from frobs_core.util.errors import ModelFileError

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


@pytest.mark.parametrize("inline", [False, True], ids=["global", "in links"])
def test_the_first_definition_of_a_material_applies(write, inline):
    def material(rgba: str) -> str:
        return f'<material name="paint"><color rgba="{rgba}"/></material>'

    box = '<visual><geometry><box size="1 1 1"/></geometry>{}</visual>'
    red, green = material("1 0 0 1"), material("0 1 0 1")
    used = box.format('<material name="paint"/>')
    if inline:
        text = robot(link("a", box.format(red) + box.format(red) + box.format(green) + used))
    else:
        text = robot(red, red, green, link("a", box.format(green) + used))
    model = load_model(write(text))
    assert {visual.rgba for visual in model.links[0].visuals} == {(1.0, 0.0, 0.0, 1.0)}
    assert {note.rule for note in model.notes} == {"repeated-material"}


def test_materials_without_a_name_are_independent(write):
    box = '<visual><geometry><box size="1 1 1"/></geometry><material name="">{}</material></visual>'
    colours = (box.format(f'<color rgba="{rgba}"/>') for rgba in ("1 0 0 1", "0 1 0 1"))
    model = load_model(write(robot(link("a", "".join(colours)))))
    assert [visual.rgba for visual in model.links[0].visuals] == [(1, 0, 0, 1), (0, 1, 0, 1)]
    assert not model.notes


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


def test_what_is_left_out_is_noted_once_for_each_kind(write):
    extras = '<gazebo reference="a"/><gazebo reference="b"/><transmission name="t"/><ros2_control name="c"/>'
    notes = load_model(write(robot(link("a"), extras))).notes
    assert [note.rule for note in notes] == ["gazebo", "transmission", "ros-control"]
    assert notes[0].text == "2 × <gazebo>, ignored: a, b"
    assert not any(note.fault for note in notes)


@pytest.mark.parametrize(
    ("text", "rule", "said"),
    [
        (robot(link("a"), "<wheel/>"), "unknown", "<wheel>"),
        (robot(link("a", "<contact><lateral_friction value='1'/></contact>")), "contact-parameters", "in <link>"),
        (robot(link("a", "<inertia_hint/>")), "unknown", "<inertia_hint>"),
        (arm(LIMIT + "<calibration rising='0'/>"), "calibration", "in <joint>"),
        (arm(LIMIT + "<safety_controller k_velocity='1'/>"), "safety-controller", "in <joint>"),
        (arm('<limit lower="-1" upper="1" effort="1" velocity="1" current="3"/>'), "unknown", "'current'"),
        (arm(LIMIT + '<dynamics K="3"/>'), "unknown", "'K' of one <dynamics>"),
    ],
)
def test_whatever_is_not_read_is_noted(write, text, rule, said):
    (note,) = load_model(write(text)).notes
    assert note.rule == rule
    assert said in note.text


@pytest.mark.parametrize("limit", ["", '<limit effort="1" velocity="1"/>', LIMIT.replace('upper="2', 'upper="-2')])
def test_a_joint_without_a_range_is_unlimited(write, limit):
    (j,) = (model := load_model(write(arm(limit)))).joints
    assert (j.type, j.limits.lower, j.limits.upper) == (JointType.CONTINUOUS, -math.inf, math.inf)
    assert [note.rule for note in model.notes] == ["no-range"]
    assert load_model(write(model.xml)).joints == model.joints


def test_the_floating_joint_of_a_base_is_left_to_the_description(write):
    text = robot(link("world", ""), link("a"), joint("free", "world", "a", "", "floating"))
    model = load_model(write(text))
    assert model.joints[0].type is JointType.FIXED
    assert [note.rule for note in model.notes] == ["free-root"]


def test_a_sphere_of_no_size_is_left_out(write):
    ball = "<geometry><sphere radius='0'/></geometry>"
    model = load_model(write(robot(link("a", f"<visual>{ball}</visual><collision>{ball}</collision>"))))
    assert model.links[0].visuals == model.links[0].collisions == ()
    assert [note.rule for note in model.notes] == ["empty-shape", "empty-shape"]


def test_an_orientation_may_be_a_quaternion(write):
    text = arm('<origin xyz="0 0 1" quat_xyzw="0 0 2 0"/>' + LIMIT)
    assert load_model(write(text)).joints[0].origin.quat_wxyz == (0.0, 0.0, 0.0, 1.0)


def test_an_inertia_with_a_negative_moment_gets_the_mean(write):
    model = load_model(write(robot(link("a", INERTIAL.replace('ixx="0.1"', 'ixx="-0.05"')))))
    assert model.links[0].inertial.inertia[0] == pytest.approx(0.05)
    assert [note.rule for note in model.notes] == ["impossible-inertia"]


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
        (INERTIAL.replace('izz="0.1"', 'izz="0.5"'), 1.0, "an impossible inertia"),
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
    "two links": (
        robot(link("a"), link("a")),
        ":3: <link name=\"a\">: the name 'a' is already used: it first occurs in line 2",
    ),
    "two joints": (
        robot(link("a"), link("b"), joint("j", "a", "b"), joint("j", "a", "b")),
        "the name 'j' is already used",
    ),
    "nameless link": (robot("<link/>"), "'name' is missing"),
    "unknown parent": (robot(link("arm"), link("b"), joint("j", "arn", "b")), "Did you mean 'arm'"),
    "unknown child": (robot(link("a"), joint("j", "a", "b")), "child link 'b' does not exist"),
    "no parent": (robot(link("a"), '<joint name="j" type="fixed"/>'), "<parent link=…/> is missing"),
    "two roots": (robot(link("a"), link("b")), "the links a, b have no parent"),
    "two parents": (
        robot(*(link(n) for n in "abc"), joint("i", "a", "c"), joint("j", "b", "c"), joint("k", "a", "b")),
        "already the child of joint 'i'",
    ),
    "ring": (robot(link("a"), link("b"), joint("i", "a", "b"), joint("j", "b", "a")), "form a cycle"),
    "ring beside a tree": (
        robot(*(link(n) for n in "abc"), joint("i", "a", "b"), joint("j", "b", "a")),
        "form a cycle",
    ),
    "joint type": (arm(kind="revolut"), "Did you mean 'revolute'"),
    "zero axis": (arm('<axis xyz="0 0 0"/>' + LIMIT), "is zero"),
    "no range": (arm('<limit lower="1" upper="1" effort="1" velocity="1"/>'), 'or type="continuous"'),
    "planar": (arm("", "planar"), "more than one degree of freedom"),
    "floating inside": (
        robot(*(link(n) for n in "abc"), joint("i", "a", "b"), joint("j", "b", "c", "", "floating")),
        "base='floating'",
    ),
    "too many links": (robot(*(link(f"l{i}") for i in range(501))), "the robot has 501 links"),
    "two orientations": (arm('<origin rpy="0 0 0" quat_xyzw="0 0 0 1"/>' + LIMIT), "twice"),
    "negative damping": (arm('<limit lower="0" upper="1"/><dynamics damping="-1"/>'), "negative"),
    "NaN": (arm('<origin xyz="0 nan 0"/>' + LIMIT), "not finite"),
    "infinite": (arm('<limit lower="-inf" upper="1" effort="1" velocity="1"/>'), "not finite"),
    "underscore": (arm('<limit lower="-1_0" upper="1_0" effort="1" velocity="1"/>'), 'lower="-1_0" is not one number'),
    "Arabic digits": (arm('<limit lower="-\u0661" upper="\u0661" effort="1" velocity="1"/>'), "is not one number"),
    "no-break spaces": (arm('<origin xyz="0\u00a00\u00a00.3"/>' + LIMIT), "is not 3 numbers"),
    "fullwidth digits": (arm('<origin xyz="0 0 \uff11"/>' + LIMIT), "is not 3 numbers"),
    "radius with an underscore": (
        robot(link("a", '<visual><geometry><sphere radius="0_0"/></geometry></visual>')),
        "is not one number",
    ),
    "words": (arm('<origin xyz="0 zero 0"/>' + LIMIT), "is not 3 numbers"),
    "too few numbers": (arm('<origin xyz="0 0"/>' + LIMIT), "contains 2 numbers; it requires 3"),
    "negative mass": (robot(link("a", INERTIAL.replace('"1"', '"-1"'))), "mass of -1"),
    "negative inertia": (
        robot(link("a", INERTIAL.replace('ixx="0.1"', 'ixx="-1"'))),
        "which are physically impossible",
    ),
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
    "no geometry": (robot(link("a", "<visual/>")), "must contain exactly one <geometry>"),
    "unknown shape": (robot(link("a", "<visual><geometry><cone/></geometry></visual>")), "is not a URDF shape"),
    "flat box": (
        robot(link("a", '<visual><geometry><box size="1 0 1"/></geometry></visual>')),
        "sizes must be > 0",
    ),
    "missing mesh": (
        robot(link("a", '<collision><geometry><mesh filename="no.stl"/></geometry></collision>')),
        "the mesh 'no.stl' cannot be used",
    ),
    "mesh of an unknown package": (
        robot(link("a", '<visual><geometry><mesh filename="package://pkg/m.stl"/></geometry></visual>')),
        "package_paths={'pkg': FOLDER}",
    ),
    "mesh from the net": (
        robot(link("a", '<visual><geometry><mesh filename="http://x/m.stl"/></geometry></visual>')),
        "is not supported",
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


def test_empty_lines_may_come_before_the_declaration_and_count(write):
    path = write('\n\n<?xml version="1.0"?>\n<robot name="r">\n<link name="a"/><link name="a"/>\n</robot>')
    with pytest.raises(ModelFileError, match=":5: <link"):
        load_model(path)


def test_a_long_chain_is_read_quickly(write):
    links = [link(f"l{i}") for i in range(500)]
    joints = [joint(f"j{i}", f"l{i}", f"l{i + 1}") for i in range(499)]
    assert len(load_model(write(robot(*links, *joints))).joint_names) == 499
