"""Sizes, masses and counts of which an engine would take all memory or time are refused, and the message names the limit."""

from __future__ import annotations

import json
import struct

import gymnasium as gym
import pytest

import frobs_core  # noqa: F401 - registers the IDs
from frobs_core.models import load_model
from frobs_core.util.errors import ConfigurationError, ModelFileError
from frobs_models.meshes.mesh import read_mesh
from frobs_train.environments import make_vector_env

BODY = '<body name="a"><geom size=".1"/>{}<body name="b"><joint name="j" {}/>{}<geom size=".1"/></body></body>'


def mjcf(inside: str = "", joint: str = "", inertial: str = "", asset: str = "", beside: str = "") -> str:
    body = BODY.format(inside, joint, inertial)
    return f"<mujoco><asset>{asset}</asset><worldbody>{body}</worldbody>{beside}</mujoco>"


LARGE_MJCF = {
    "height field": mjcf(asset='<hfield name="h" nrow="100000" ncol="100000" size="1 1 1 1"/>'),
    "long height field": mjcf(asset='<hfield name="h" nrow="1" ncol="2000000000" size="1 1 1 1"/>'),
    "many height fields": mjcf(
        asset="".join(f'<hfield name="h{i}" nrow="1000" ncol="1000" size="1 1 1 1"/>' for i in range(20))
    ),
    "height field of a default": mjcf(asset='<hfield name="h" file="h.bin" size="1 1 1 1"/>'),
    "picture as a height field": mjcf(asset='<hfield name="h" file="large.png" size="1 1 1 1"/>'),
    "texture": mjcf(asset='<texture name="t" type="2d" builtin="flat" width="100000" height="100000"/>'),
    "cube texture": mjcf(asset='<texture name="t" builtin="gradient" width="20000" height="20000"/>'),
    "picture as a texture": mjcf(asset='<texture name="t" type="2d" file="large.png"/>'),
    "mesh that MuJoCo makes": mjcf(asset='<mesh name="m" builtin="supersphere" params="30000 1 1"/>'),
    "mass": mjcf(inertial='<inertial mass="1e300" pos="0 0 0" diaginertia="1 1 1"/>'),
    "mass of a geom": mjcf('<geom size="1" mass="1e300"/>'),
    "mass by density": mjcf('<geom size="1" density="1e300"/>'),
    "mass by size": mjcf('<geom size="1e5" density="1000"/>'),
    "mass by number": mjcf('<geom size="50" density="1000"/>' * 5),
    "mass of a default": mjcf('<geom size="1"/>', beside='<default><geom mass="1e300"/></default>'),
    "inertia": mjcf(inertial='<inertial mass="1" pos="0 0 0" diaginertia="1e300 1e300 1e300"/>'),
    "full inertia": mjcf(inertial='<inertial mass="1" pos="0 0 0" fullinertia="1e300 1e300 1e300 0 0 0"/>'),
    "size": mjcf('<geom size="1e200"/>'),
    "ends": mjcf('<geom type="capsule" size="1" fromto="0 0 0 0 0 1e300"/>'),
    "position": mjcf('<geom size="1" pos="1e300 0 0"/>'),
    "armature": mjcf(joint='armature="1e300"'),
    "damping": mjcf(joint='damping="1e300"'),
    "stiffness": mjcf(joint='stiffness="1e300"'),
    "friction": mjcf(joint='frictionloss="1e300"'),
    "reference": mjcf(joint='ref="1e300"'),
    "scale": mjcf(asset='<mesh name="m" scale="1e300 1 1" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/>'),
    "geoms": mjcf('<geom size="1"/>' * 10_000),
    "sites": mjcf("<site/>" * 10_000),
    "cameras": mjcf("<camera/>" * 1000),
    "elements": mjcf(beside="<contact>" + '<exclude body1="a" body2="b"/>' * 30_000 + "</contact>"),
    "replicated bodies": mjcf('<replicate count="1000000000" offset="1 0 0"><geom size="1"/></replicate>'),
    "flexible bodies": mjcf('<flexcomp name="f" type="grid" count="1000 1000 1000" spacing="1 1 1"/>'),
}


@pytest.mark.parametrize("text", LARGE_MJCF.values(), ids=LARGE_MJCF.keys())
def test_an_mjcf_file_beyond_all_measure_is_refused(tmp_path, text):
    (tmp_path / "h.bin").write_bytes(struct.pack("<ii", 100_000, 100_000))
    (tmp_path / "large.png").write_bytes(
        b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + b"IHDR" + struct.pack(">II", 50_000, 50_000)
    )
    (tmp_path / "r.xml").write_text(text)
    with pytest.raises(ModelFileError, match=r"limit|only MuJoCo"):
        load_model(tmp_path / "r.xml")


def urdf(
    mass: str = "1", moment: str = "1", xyz: str = "0 0 0", shape: str = '<box size="1 1 1"/>', joint: str = ""
) -> str:
    moments = " ".join(f'{key}="{moment if key in ("ixx", "iyy", "izz") else 0}"' for key in _KEYS)
    return (
        f'<robot name="r"><link name="a"><inertial><mass value="{mass}"/><inertia {moments}/></inertial><collision>'
        f'<origin xyz="{xyz}"/><geometry>{shape}</geometry></collision></link><link name="b"/><joint name="j" '
        f'type="continuous"><parent link="a"/><child link="b"/>{joint}</joint></robot>'
    )


_KEYS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
LARGE_URDF = {
    "mass": urdf(mass="1e300"),
    "moments of inertia": urdf(moment="1e300"),
    "position": urdf(xyz="1e300 0 0"),
    "box": urdf(shape='<box size="1 1e300 1"/>'),
    "sphere": urdf(shape='<sphere radius="1e300"/>'),
    "cylinder": urdf(shape='<cylinder radius="1" length="1e300"/>'),
    "capsule": urdf(shape='<capsule radius="1e300" length="1"/>'),
    "scale of a mesh": urdf(shape='<mesh filename="m.stl" scale="1e300 1 1"/>'),
    "place of a joint": urdf(joint='<origin xyz="0 0 1e300"/>'),
    "damping": urdf(joint='<dynamics damping="1e300"/>'),
    "friction": urdf(joint='<dynamics friction="1e300"/>'),
    "elements": f'<robot name="r">{"<a/>" * 300_000}</robot>',
}


@pytest.mark.parametrize("text", LARGE_URDF.values(), ids=LARGE_URDF.keys())
def test_a_urdf_file_beyond_all_measure_is_refused(tmp_path, text):
    (tmp_path / "r.urdf").write_text(text)
    with pytest.raises(ModelFileError, match="limit"):
        load_model(tmp_path / "r.urdf")


def test_a_heavy_and_large_robot_is_still_read(tmp_path):
    (tmp_path / "r.urdf").write_text(urdf(mass="1e6", moment="1e9", shape='<box size="500 60 60"/>'))
    assert load_model(tmp_path / "r.urdf").links[0].inertial.mass == 1e6


def gltf(**changes: object) -> str:
    tree = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"componentType": 5126, "count": 3, "type": "VEC3"}],
    }
    return json.dumps(tree | changes)


def collada(nodes: int) -> str:
    """Return a COLLADA file whose nodes show ten times the one before."""
    shown = ['<instance_geometry url="#g"/>', *(f'<instance_node url="#n{i}"/>' * 10 for i in range(nodes))]
    inner = "".join(f'<node id="n{i}">{shown[i]}</node>' for i in range(nodes))
    return f'<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema"><library_nodes>{inner}</library_nodes></COLLADA>'


LARGE_MESHES = {
    "vertices.gltf": gltf(accessors=[{"componentType": 5126, "count": 10**10, "type": "VEC3"}]),
    "many.gltf": gltf(accessors=[{"componentType": 5126, "count": 10**6, "type": "MAT4"}] * 20),
    "parts.gltf": gltf(meshes=[{"primitives": [{"attributes": {"POSITION": 0}}] * 20_000}]),
    "instances.gltf": gltf(nodes=[{"children": list(range(1, 20_001))}, *[{"mesh": 0}] * 20_000]),
    "laughs.gltf": gltf(nodes=[*({"children": [i + 1, i + 1]} for i in range(60)), {"mesh": 0}]),
    "ring.gltf": gltf(nodes=[{"children": [1]}, {"children": [0], "mesh": 0}]),
    "deep.gltf": "[" * 100_000,
    "laughs.dae": collada(30),
    "ring.dae": '<COLLADA><library_nodes><node id="a"><instance_node url="#a"/></node></library_nodes></COLLADA>',
    "materials.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\n" + "".join(f"usemtl m{i}\nf 1 2 3\n" for i in range(20_000)),
    "counts.off": "OFF\n1000000000 1000000000 0\n0 0 0\n",
    "counts.ply": "ply\nformat binary_little_endian 1.0\nelement vertex 1000000000\nproperty float x\nend_header\n",
    "counts.stl": "\0" * 80 + "\xff" * 4,
}


@pytest.mark.parametrize(("name", "text"), LARGE_MESHES.items())
def test_a_small_file_cannot_become_a_huge_mesh(tmp_path, name, text):
    (tmp_path / name).write_bytes(text.encode("latin-1"))
    with pytest.raises(ModelFileError):
        read_mesh(tmp_path / name)


@pytest.mark.parametrize("num_envs", [100_001, 10**7, 10**12])
@pytest.mark.parametrize("simulator", ["mujoco", "pybullet", "gazebo"])
def test_more_environments_than_the_memory_holds_are_refused(simulator, num_envs):
    with pytest.raises(ConfigurationError, match=r"must be .* 1 to 100,000"):
        gym.make_vec("frobs/Irb120Reach-v0", num_envs=num_envs, simulator=simulator)


@pytest.mark.parametrize("environment", ["frobs/Irb120Reach-v0", "CartPole-v1"])
def test_a_training_cannot_ask_for_them_either(environment):
    with pytest.raises(ConfigurationError, match=r"must be .* 1 to 100,000"):
        make_vector_env(environment, 10**7, {})


@pytest.mark.parametrize(
    ("keywords", "limit"),
    [
        ({"num_threads": 10**6}, "1,024"),
        ({"control_timestep": 10.0**6}, "10,000"),
        ({"physics_timestep": 1e-12}, "10,000"),
    ],
)
def test_a_step_that_would_never_end_is_refused(keywords, limit):
    with pytest.raises(ConfigurationError, match=f"must be .* {limit}"):
        gym.make("frobs/Irb120Reach-v0", **keywords)


def _numbered(count: int) -> str:
    return " ".join(f'a{i}=""' for i in range(count))


def _classes(count: int) -> str:
    return "".join(f'<default class="c{i}"/>' for i in range(count))


_GEOMS = '<geom size=".1"/>' * 2_800
COSTLY_MJCF = {
    "attributes for each class": (
        mjcf(beside=f"<default><geom {_numbered(100_000)}/>{_classes(5_000)}</default>"),
        "attributes; the limit is 100",
    ),
    "tags for each class": (
        mjcf(beside=f"<default>{''.join(f'<t{i} {_numbered(9)}/>' for i in range(9_000))}{_classes(9_000)}</default>"),
        None,
    ),
    "attributes for each geom": (mjcf(_GEOMS, beside=f"<default><geom {_numbered(90)}/></default>"), None),
    "attributes for each geom of nested classes": (
        mjcf(
            f'<frame childclass="c99">{_GEOMS}</frame>',
            beside="".join(f'<default class="c{i}"><geom {_numbered(20)}/>' for i in range(100)) + "</default>" * 100,
        ),
        "inherited attributes; the limit is 1,000,000",
    ),
    "sections of defaults": (mjcf(_GEOMS, beside="<default><site/></default>" * 5_000), "inherited attributes"),
    "attributes": (mjcf(beside=f"<option {_numbered(90)}/>" * 1_200), "attributes; the limit is 100,000"),
    "numbers": (mjcf().replace('size=".1"', f'size="{"1 " * 10**6}"'), "the limit is 2,000"),
    "digits": (mjcf().replace('size=".1"', f'size="{"1" * 10**6}"'), "the limit is 2,000"),
    "text": (mjcf("&amp;" * 800_000), None),
    "actuators": (mjcf(beside="<actuator>" + '<motor joint="j"/>' * 19_000 + "</actuator>"), "19,000 actuators"),
    "actuators of a tendon": (
        mjcf(
            beside='<tendon><fixed name="t">'
            + '<joint joint="j" coef="1"/>' * 1_900
            + "</fixed></tendon><actuator>"
            + '<motor tendon="t"/>' * 1_900
            + "</actuator>"
        ),
        None,
    ),
    "joints of a body": (mjcf(joint='/><joint axis="0 1 0"' * 1_900), "links; the limit is 500"),
    "bodies in bodies": (mjcf("<body>" * 1_000), "nested deeper than 400 levels"),
}


@pytest.mark.parametrize(("text", "reason"), COSTLY_MJCF.values(), ids=COSTLY_MJCF.keys())
def test_an_mjcf_file_is_read_or_refused_soon(tmp_path, text, reason):
    (tmp_path / "r.xml").write_text(text)
    if reason is None:
        load_model(tmp_path / "r.xml")
    else:
        with pytest.raises(ModelFileError, match=reason) as caught:
            load_model(tmp_path / "r.xml")
        assert len(str(caught.value)) < 5_000


@pytest.mark.parametrize("inside", ["", "<frame>"], ids=["files", "files in frames"])
@pytest.mark.parametrize("following", [1, 3], ids=["chain", "net"])
def test_files_that_include_others_without_end_are_refused_soon(tmp_path, inside, following):
    for i in range(1_200):
        numbers = ((i * following + k + 1) % 1_200 for k in range(following))
        includes = "".join(f'<include file="f{number}.xml"/>' for number in numbers)
        end = inside.replace("<", "</")
        (tmp_path / f"f{i}.xml").write_text(f"<mujoco>{inside}{includes}{end}</mujoco>")
    with pytest.raises(ModelFileError, match=r"201 included files; the limit is 200|already included"):
        load_model(tmp_path / "f0.xml")
    (tmp_path / "deep.xml").write_text(f'<mujoco>{"<a>" * 300}<include file="more.xml"/>{"</a>" * 300}</mujoco>')
    (tmp_path / "more.xml").write_text(f"<mujoco>{'<a>' * 300}{'</a>' * 300}</mujoco>")
    with pytest.raises(ModelFileError, match="nested deeper than 400 levels"):
        load_model(tmp_path / "deep.xml")


def test_xacro_files_that_include_others_without_end_are_refused_soon(tmp_path):
    for i in range(600):
        include = f'<xacro:include filename="f{i + 1}.xacro"/>'
        (tmp_path / f"f{i}.xacro").write_text(f'<robot xmlns:xacro="http://www.ros.org/wiki/xacro">{include}</robot>')
    with pytest.raises(ModelFileError, match="201 included files; the limit is 200"):
        load_model(tmp_path / "f0.xacro")


@pytest.mark.parametrize("inside", ['<a v="${nope}"/>', '<xacro:macro name="m"/><xacro:m nope="1"/>'])
@pytest.mark.parametrize("repeated", ["${", "$(arg ", "xacro:m "])
def test_the_line_of_an_error_is_found_soon(tmp_path, inside, repeated):
    text = f'<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><!--{repeated * 400_000}-->{inside}</robot>'
    (tmp_path / "r.xacro").write_text(text)
    with pytest.raises(ModelFileError, match="nope"):
        load_model(tmp_path / "r.xacro")
