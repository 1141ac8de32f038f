"""Sizes, masses and counts of which an engine would take all memory or time are refused, and the message names the limit."""

from __future__ import annotations

import json
import struct

import gymnasium as gym
import pytest

import frobs_core  # noqa: F401 - registers the IDs
from frobs_core.errors import ConfigurationError, ModelFileError
from frobs_core.models import load_model
from frobs_core.models.meshes import read_mesh
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
