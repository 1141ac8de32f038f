from __future__ import annotations

import math
from pathlib import Path

import gymnasium
import numpy as np
import pytest
import trimesh

from frobs_core.models import JointType, RobotModel, Sphere, inertia_matrix, load_model
from frobs_core.models.defaults import composite_inertia
from frobs_core.util.errors import ModelFileError

mujoco = pytest.importorskip("mujoco")

DEMO = Path(__file__).with_name("demo.xml")
"""Defaults in classes, several joints in a body, anchors, references, frames, four ways to give an orientation."""


@pytest.fixture(scope="module")
def demo() -> RobotModel:
    return load_model(DEMO)


@pytest.fixture(scope="module")
def compiled(demo: RobotModel) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(demo.xml)


@pytest.fixture
def write(tmp_path: Path):
    def write(inside: str, name: str = "r.xml") -> Path:
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(f'<mujoco model="r">\n{inside}\n</mujoco>')
        return path

    return write


def world(inside: str) -> str:
    return f'<worldbody><body name="root">{inside}<geom size=".1"/></body></worldbody>'


HINGED = '<body name="arm" pos="0 0 1"><joint name="j" range="-90 45"/><geom size=".1"/></body>'


def test_joints_and_limits_are_those_that_mujoco_compiles(demo, compiled):
    original = mujoco.MjModel.from_xml_path(str(DEMO))
    assert demo.joint_names[:4] == tuple(original.joint(i).name for i in range(4))
    assert demo.joint_names == tuple(compiled.joint(i).name for i in range(compiled.njnt))
    for i, joint in enumerate(demo.actuated_joints):
        expected = original.jnt_range[i] if original.jnt_limited[i] else (-math.inf, math.inf)
        assert (joint.limits.lower, joint.limits.upper) == pytest.approx(tuple(expected))
        assert (joint.type is JointType.PRISMATIC) == (original.jnt_type[i] == mujoco.mjtJoint.mjJNT_SLIDE)
        assert joint.damping == original.dof_damping.reshape(len(demo.joint_names), -1)[i, 0]


def test_efforts_are_those_of_the_actuators(demo):
    assert [joint.limits.effort for joint in demo.actuated_joints] == [100, 30, math.inf, math.inf, math.inf]


def test_link_poses_are_mujocos(demo, compiled):
    data = mujoco.MjData(compiled)
    positions = np.random.default_rng(0).uniform(-2, 2, (20, compiled.nq))
    for link in demo.links:
        if "__" in link.name:
            continue
        pos, quat = demo.frame_pose(link.name, positions)
        for q, p, r in zip(positions, pos, quat, strict=True):
            data.qpos[:] = q
            mujoco.mj_kinematics(compiled, data)
            assert p == pytest.approx(data.body(link.name).xpos, abs=1e-12)
            assert abs(np.dot(r, data.body(link.name).xquat)) == pytest.approx(1, abs=1e-12)


def test_masses_of_primitive_geoms_are_mujocos(demo, compiled):
    for link in demo.links:
        body = compiled.body(link.name) if "__" not in link.name else None
        if link.inertial is None or body is None:
            continue
        assert link.inertial.mass == pytest.approx(body.mass[0])
        assert link.inertial.origin.pos == pytest.approx(body.ipos)
        assert np.linalg.eigvalsh(inertia_matrix(link.inertial)) == pytest.approx(np.sort(body.inertia))


def test_composite_inertia_is_the_diagonal_of_mujocos_mass_matrix(demo, compiled):
    data = mujoco.MjData(compiled)
    data.qpos[:] = 0.3
    mujoco.mj_forward(compiled, data)
    diagonal = np.zeros((compiled.nv, compiled.nv))
    for i in range(compiled.nv):
        mujoco.mj_mulM(compiled, data, diagonal[i], np.eye(compiled.nv)[i])
    assert list(composite_inertia(demo, data.qpos).values()) == pytest.approx(np.diag(diagonal))


def test_explicit_inertia_is_read_in_mujocos_order(write):
    inertial = '<inertial pos="1 2 3" mass="4" fullinertia="3 2 1.5 .3 .2 .1"/>'
    link = load_model(write(world(inertial))).links[0]
    assert link.inertial.inertia == (3, 0.3, 0.2, 2, 0.1, 1.5)
    assert (link.inertial.mass, link.inertial.origin.pos) == (4, (1, 2, 3))


def test_a_free_root_is_the_root_link_and_noted(write):
    model = load_model(write(world('<freejoint name="base"/>' + HINGED)))
    assert (model.root, model.joint_names) == ("root", ("j",))
    assert "floating" in str(model.notes[0])


def test_bodies_of_the_world_get_one_root_that_the_engine_sees_too(write):
    model = load_model(write(f"<worldbody>{HINGED}</worldbody>"))
    assert (model.root, model.joint_names) == ("base", ("j",))
    assert mujoco.MjModel.from_xml_string(model.xml).body("arm").parentid == 1


def test_names_are_made_for_what_has_none(write):
    model = load_model(write(world('<body><joint/><geom size=".1"/></body>')))
    assert (model.links[1].name, model.joint_names) == ("body_1", ("joint_1",))
    assert len(model.notes) == 2
    assert mujoco.MjModel.from_xml_string(model.xml).joint(0).name == "joint_1"


def test_includes_and_assets_are_found_from_the_main_file(write, tmp_path):
    write('<default><joint range="-10 10"/></default>', "parts/defaults.xml")
    write('<asset><mesh name="m" file="m.obj"/></asset>', "parts/assets.xml")
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "m.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    )
    text = '<compiler meshdir="meshes"/><include file="parts/defaults.xml"/><include file="parts/assets.xml"/>'
    model = load_model(write(text + world('<body name="arm"><joint name="j"/><geom type="mesh" mesh="m"/></body>')))
    assert model.joints[0].limits.upper == pytest.approx(math.radians(10))
    assert mujoco.MjModel.from_xml_string(model.xml).nmesh == 1
    assert "only MuJoCo can compute the mass of" in str(model.notes[0])


def test_joint_equalities_become_mimic_joints(write):
    finger = '<body name="{0}"><joint name="{0}" type="slide" ref="{1}"/><geom size=".1"/></body>'
    equality = '<equality><joint joint1="b" joint2="a" polycoef="0.1 -2"/></equality>'
    path = write(world(finger.format("a", 0.3) + finger.format("b", 0.2)) + equality)
    model = load_model(path)
    assert model.joint_names == ("a",)
    mimic = model.joints[1].mimic
    assert (mimic.joint, mimic.multiplier, mimic.offset) == ("a", -2, pytest.approx(0.1 + 0.2 + 2 * 0.3))


@pytest.mark.parametrize(
    ("actuator", "effort"),
    [
        ('<position joint="a" forcerange="-35 35"/>', 35.0),
        ('<position joint="b" forcerange="-35 35"/>', 70.0),
        ('<position tendon="both" forcerange="-35 35"/>', 0.5 * 35.0 + 2 * 0.5 * 35.0),
    ],
)
def test_a_leader_has_the_effort_of_all_actuators_of_its_followers(write, actuator, effort):
    finger = '<body name="{0}"><joint name="{0}" type="slide"/><geom size=".1"/></body>'
    couplings = '<equality><joint joint1="b" joint2="a" polycoef="0 -2 0 0 0"/></equality>'
    couplings += '<tendon><fixed name="both"><joint joint="a" coef=".5"/><joint joint="b" coef=".5"/></fixed></tendon>'
    actuators = f"<actuator>{actuator}</actuator>"
    model = load_model(write(world(finger.format("a") + finger.format("b")) + couplings + actuators))
    assert model.joint_names == ("a",)
    assert model.actuated_joints[0].limits.effort == effort


def test_a_geom_without_a_type_is_a_sphere_that_mujoco_fits_to_its_mesh(write, tmp_path):
    trimesh.creation.box((0.1, 0.2, 0.3)).export(tmp_path / "m.stl")
    asset = '<asset><mesh name="m" file="m.stl"/></asset>'
    path = write(asset + world(HINGED.replace("<geom", '<geom mesh="m"/><geom')))
    model, compiled = load_model(path), mujoco.MjModel.from_xml_path(str(path))
    assert list(compiled.geom_type) == [mujoco.mjtGeom.mjGEOM_SPHERE] * 3
    assert all(isinstance(shape.geometry, Sphere) for link in model.links for shape in link.collisions)
    assert any("collision shape that only MuJoCo supports" in note.text for note in model.notes)


def test_coefficients_of_an_equality_that_are_omitted_are_those_of_mujoco(write):
    slide = '<body name="{0}"><joint name="{0}" type="slide"/><geom size=".1"/></body>'
    equality = '<equality><joint joint1="b" joint2="a" polycoef="0.2"/></equality>'
    path = write(world(slide.format("a") + slide.format("b")) + equality)
    mimic = load_model(path).joints[1].mimic
    offset, multiplier, *_ = mujoco.MjModel.from_xml_path(str(path)).eq_data[0]
    assert (mimic.offset, mimic.multiplier) == (offset, multiplier) == (0.2, 1.0)


@pytest.mark.parametrize(
    ("joint", "limits"),
    [
        ('<joint range="-90 90"/>', math.pi / 2),
        ('<joint range="-90 90" limited="false"/>', math.inf),
        ('<joint range="0 0"/>', math.inf),
        ('<joint range="0 0" limited="auto"/>', math.inf),
        ('<joint range="1 -1"/>', math.inf),
        ('<joint range="1 1"/>', math.inf),
        ("<joint/>", math.inf),
    ],
)
def test_limits_hold_where_mujoco_says_so(write, joint, limits):
    model = load_model(write(world(f'<body name="arm">{joint}<geom size=".1"/></body>')))
    assert model.joints[0].limits.upper == pytest.approx(limits)


@pytest.mark.parametrize("attribute", ["ctrlrange", "forcerange"])
def test_an_actuator_with_an_empty_range_is_unlimited(write, attribute):
    actuator = f'<actuator><motor joint="j" gear="10" {attribute}="0 0"/></actuator>'
    path = write(world(HINGED) + actuator)
    original = mujoco.MjModel.from_xml_path(str(path))
    assert not original.actuator_ctrllimited.any()
    assert not original.actuator_forcelimited.any()
    assert load_model(path).joints[0].limits.effort == math.inf


def test_shapes_of_the_world_have_no_mass(write):
    box = '<geom type="box" size=".5 .5 .02" pos="0 0 {}"/>'
    mesh = '<asset><mesh name="m" vertex="0 0 0 .1 0 0 0 .1 0 0 0 .1"/></asset>'
    text = (
        f'{mesh}<default><geom mass="2"/></default><worldbody><geom type="plane" size="1 1 1"/>{box.format(-1)}'
        f'<geom type="mesh" mesh="m"/><frame pos="0 0 1">{box.format(-3)}</frame>'
        '<body name="a"><joint name="j"/><geom size=".05" mass=".08"/></body></worldbody>'
    )
    path = write(text)
    model = load_model(path)
    assert sum(link.inertial.mass for link in model.links if link.inertial) == pytest.approx(0.08)
    assert sum(mujoco.MjModel.from_xml_path(str(path)).body_mass) == pytest.approx(0.08)
    assert sum(mujoco.MjModel.from_xml_string(model.xml).body_mass) == pytest.approx(0.08)
    assert len(model.links[0].collisions) == 2
    assert not any("mass" in str(note) for note in model.notes)


NESTED = {
    "beside the included file": (["robot/part.xml"], "part.xml"),
    "first beside the main file": (["part.xml", "robot/part.xml"], "part.xml"),
    "relative to the main file": (["robot/part.xml"], "robot/part.xml"),
    "above the included file": (["common/part.xml"], "../common/part.xml"),
}


@pytest.mark.parametrize(("places", "name"), NESTED.values(), ids=NESTED.keys())
def test_nested_includes_are_found_as_in_mujoco(write, tmp_path, places, name):
    for mass, place in enumerate(places, start=1):
        body = f'<body name="part"><joint name="j"/><geom size=".1" mass="{mass}"/></body>'
        (tmp_path / place).parent.mkdir(exist_ok=True)
        write(f"<worldbody>{body}</worldbody>", place)
    write(f'<include file="{name}"/>', "robot/robot.xml")
    path = write('<include file="robot/robot.xml"/>')
    assert load_model(path).links[-1].inertial.mass == mujoco.MjModel.from_xml_path(str(path)).body_mass[1] == 1


ASSETS = {
    "beside the included file": (["robot/m.obj"], "", "m.obj"),
    "first beside the main file": (["m.obj", "robot/m.obj"], "", "m.obj"),
    "in a folder beside the included file": (["robot/sub/m.obj"], "", "sub/m.obj"),
    "in the folder of meshes": (["sub/m.obj", "robot/m.obj", "m.obj"], '<compiler meshdir="sub"/>', "m.obj"),
    "not in the folder of meshes": (["robot/m.obj"], '<compiler meshdir="sub"/>', "m.obj"),
}


@pytest.mark.parametrize(("places", "compiler", "name"), ASSETS.values(), ids=ASSETS.keys())
def test_assets_of_included_files_are_found_as_in_mujoco(write, tmp_path, places, compiler, name):
    for size, place in enumerate(places, start=1):
        (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / place).write_text(f"v 0 0 0\nv {size} 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    write(f'<asset><mesh name="m" file="{name}"/></asset>', "robot/robot.xml")
    geom = '<body name="arm"><joint name="j"/><geom type="mesh" mesh="m"/></body>'
    path = write(f'{compiler}<include file="robot/robot.xml"/>' + world(geom))
    model = load_model(path)
    assert model.links[-1].collisions[0].geometry.path == tmp_path / places[0]
    found, expected = (mujoco.MjModel.from_xml_string(model.xml), mujoco.MjModel.from_xml_path(str(path)))
    assert np.ptp(found.mesh_vert, axis=0) == pytest.approx(np.ptp(expected.mesh_vert, axis=0))


def test_assets_beside_included_files_do_not_exist_in_folders_that_mujoco_ignores(write, tmp_path):
    (tmp_path / "robot" / "sub").mkdir(parents=True)
    (tmp_path / "robot" / "sub" / "m.obj").write_text("v 0 0 0\n")
    write('<compiler meshdir="sub"/><asset><mesh name="m" file="m.obj"/></asset>', "robot/robot.xml")
    path = write('<include file="robot/robot.xml"/>' + world(HINGED))
    with pytest.raises(ValueError, match="Error opening file"):
        mujoco.MjModel.from_xml_path(str(path))
    with pytest.raises(ModelFileError, match=r"'m\.obj' is missing"):
        load_model(path)


BODY = '<body name="b">{}<geom size=".1"/></body>'
BAD = {
    "ball joint": (world(BODY.format('<joint name="s" type="ball"/>')), "use three hinges"),
    "two free bodies": (
        '<worldbody><body name="a"><freejoint/><geom size=".1"/></body><body name="b"/></worldbody>',
        "Define additional objects in the task's scene",
    ),
    "joint type": (world(BODY.format('<joint type="hing"/>')), "the joint type 'hing' does not exist"),
    "zero axis": (world(BODY.format('<joint axis="0 0 0"/>')), "axis is zero"),
    "zero quaternion": (world('<body name="b" quat="0 0 0 0"/>'), "is zero"),
    "NaN": (world('<body name="b" pos="0 0 nan"/>'), "not finite"),
    "empty range": (world(BODY.format('<joint range="1 1" limited="true"/>')), "is empty"),
    "range that is neither limited nor not": (
        '<compiler autolimits="false"/>' + world(BODY.format('<joint range="0 1"/>')),
        'requires limited="true" or "false"',
    ),
    "number of Python": (world(BODY.format('<joint range="-1_0 1_0"/>')), "is not 2 numbers"),
    "group of inertias": ('<compiler inertiagrouprange="0 x"/>' + world(""), "is not 2 numbers"),
    "bounded mass": ('<compiler boundmass="1_0"/>' + world(""), "is not one number"),
    "same name": (world('<body name="root"/>'), "the name 'root' is already used"),
    "unknown class": (
        '<default><default class="hand"/></default>' + world(BODY.format('<joint class="hond"/>')),
        "Did you mean 'hand'",
    ),
    "no body": ("<worldbody/>", "there is no <body>"),
    "replicate": (world('<replicate count="3"><body/></replicate>'), "mj_saveLastXML"),
    "missing include": ('<include file="no.xml"/>' + world(""), "'no.xml' is missing"),
    "missing mesh": ('<asset><mesh file="no.stl"/></asset>' + world(""), "'no.stl' is missing"),
    "equality of nothing": (world("") + '<equality><joint joint1="x"/></equality>', "'x' does not exist"),
}


@pytest.mark.parametrize(("inside", "message"), BAD.values(), ids=BAD.keys())
def test_bad_files_are_refused_by_one_clear_line(write, inside, message):
    with pytest.raises(ModelFileError) as caught:
        load_model(write(inside))
    assert message in str(caught.value)
    assert caught.value.line is not None
    assert "\n" not in str(caught.value)


def test_bombs_are_refused_also_in_includes(write, tmp_path):
    bomb = '<!DOCTYPE mujoco [<!ENTITY a "aaaaaaaaaa">]>\n<mujoco model="&a;"/>'
    (tmp_path / "bomb.xml").write_text(bomb)
    for path in (tmp_path / "bomb.xml", write('<include file="bomb.xml"/>' + world(""))):
        with pytest.raises(ModelFileError, match=r"bomb\.xml:1: .*document type"):
            load_model(path)


def test_a_file_that_includes_itself_is_refused(write):
    with pytest.raises(ModelFileError, match="already included"):
        load_model(write('<include file="r.xml"/>' + world("")))


GYMNASIUM = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets"


@pytest.mark.parametrize("path", sorted(GYMNASIUM.glob("*.xml")), ids=lambda path: path.stem)
def test_gymnasiums_robots_are_read_as_mujoco_reads_them(path):
    model = load_model(path)
    original = mujoco.MjModel.from_xml_path(str(path))
    compiled = mujoco.MjModel.from_xml_string(model.xml)
    moving = [i for i in range(original.njnt) if original.jnt_type[i] != mujoco.mjtJoint.mjJNT_FREE]
    assert [j.name for j in model.joints if j.type is not JointType.FIXED] == [original.joint(i).name for i in moving]
    data = mujoco.MjData(compiled)
    for q in np.random.default_rng(3).uniform(-1, 1, (5, len(model.joint_names))):
        for name, value in zip(model.joint_names, q, strict=True):
            data.qpos[compiled.joint(name).qposadr] = value
        mujoco.mj_kinematics(compiled, data)
        root = data.body(model.root)
        for link in model.links:
            if "__" in link.name:
                continue
            (pos,), (quat,) = model.frame_pose(link.name, q[None])
            body = data.body(link.name)
            assert root.xpos + root.xmat.reshape(3, 3) @ pos == pytest.approx(body.xpos, abs=1e-12)
            expected = np.zeros(4)
            mujoco.mju_mulQuat(expected, root.xquat, quat)
            assert abs(expected @ body.xquat) == pytest.approx(1, abs=1e-12)


def test_what_the_description_has_instead_is_noted(write):
    text = """<option timestep="0.001"/><worldbody><body name="a"><geom size="1"/><body name="b"><joint name="j"/>
    <geom size="1"/></body></body></worldbody><actuator><motor joint="j"/><position joint="j"/></actuator>
    <sensor><jointpos joint="j"/></sensor><keyframe><key qpos="0"/></keyframe>"""
    notes = {note.rule: note.text for note in load_model(write(text)).notes}
    assert notes == {
        "actuators": "2 in <actuator>, ignored",
        "sensor": "1 in <sensor>, ignored",
        "keyframes": "1 in <keyframe>, ignored",
        "engine-settings": "1 in <option>, ignored",
    }


def test_a_free_joint_is_rejected_with_its_cause(write):
    free = '<body name="robot"><freejoint/><geom size=".1"/></body>'
    with pytest.raises(
        ModelFileError, match="'robot' can only move freely if it is the only body of <worldbody>; remove ball"
    ):
        load_model(write(f'<worldbody>{free}<body name="ball"><geom size=".1"/></body></worldbody>'))
    with pytest.raises(ModelFileError, match="'robot' has a free joint inside the robot"):
        load_model(write(world(free)))
