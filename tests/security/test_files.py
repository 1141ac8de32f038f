"""FIFOs, devices, folders and files beyond the limit are refused, whatever names them, and never opened."""

from __future__ import annotations

import json
import os
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from frobs_core.models import load_model
from frobs_core.util.errors import ConfigFileError, FrobsError, ModelFileError
from frobs_core.util.yaml import load_yaml
from frobs_deploy import BundleError, DeployError, read_bundle
from frobs_models import fingerprint
from frobs_models.meshes.mesh import FORMATS, read_mesh

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n"
LINK = '<link name="a"><visual><geometry><mesh filename="{}"/></geometry></visual></link>'


def gltf(uri: str) -> str:
    return json.dumps(
        {
            "asset": {"version": "2.0"},
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36}],
            "buffers": [{"byteLength": 36, "uri": uri}],
        }
    )


def make(kind: str, path: Path) -> None:
    """Put something at a path that must not be opened."""
    if kind == "folder":
        path.mkdir()
    elif kind == "fifo":
        os.mkfifo(path)
    elif kind == "link to a fifo":
        os.mkfifo(path.with_name("a_fifo"))
        path.symlink_to("a_fifo")
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        with path.open("wb") as file:
            file.truncate(2**40)  # a hole: it takes no disk


KINDS = ["fifo", "link to a fifo", "device", "folder", "a terabyte"]
READERS = {
    "r.urdf": load_model,
    "r.urdf.xacro": load_model,
    "r.xml": load_model,
    "r.mjcf": load_model,
    "r.yaml": load_yaml,
    "r.frobs": read_bundle,
    **{f"r{ending}": read_mesh for ending in FORMATS},
}


@pytest.mark.parametrize(("kind", "name"), list(product(KINDS, READERS)))
def test_what_is_no_regular_file_of_a_sensible_size_is_refused(tmp_path, kind, name):
    make(kind, tmp_path / name)
    with pytest.raises((FrobsError, DeployError), match=r"folder|regular file|limit|maximum size"):
        READERS[name](tmp_path / name)


INSIDE = {
    "include": '<xacro:include filename="named"/>',
    "optional include": '<xacro:include filename="named" optional="true"/>',
    "pattern": '<xacro:include filename="nam*"/>',
    "YAML": "<link name=\"${xacro.load_yaml('named')}\"/>",
}


@pytest.mark.parametrize(("kind", "how"), list(product([k for k in KINDS if k != "folder"], INSIDE)))
def test_a_xacro_file_cannot_name_one(write, tmp_path, kind, how):
    make(kind, tmp_path / "named")
    with pytest.raises(ModelFileError, match=r"not a regular file|limit"):
        load_model(write(INSIDE[how]))


@pytest.mark.parametrize(
    ("kind", "how"), list(product(["fifo", "link to a fifo", "a terabyte"], ["obj", "texture", "gltf"]))
)
def test_a_mesh_cannot_name_one(tmp_path, kind, how):
    name = {"obj": "named.mtl", "texture": "named.png", "gltf": "named.bin"}[how]
    make(kind, tmp_path / name)
    mesh = tmp_path / ("m.gltf" if how == "gltf" else "m.obj")
    (tmp_path / "m.mtl").write_text(f"newmtl a\nmap_Kd {name}\n")
    mesh.write_text(gltf(name) if how == "gltf" else f"mtllib {'m.mtl' if how == 'texture' else name}\n{TRIANGLE}")
    with pytest.raises(ModelFileError, match=r"not a regular file|limit"):
        read_mesh(mesh)


@pytest.mark.parametrize("uri", ["/dev/zero", "../../../../../dev/zero", "file:///dev/zero", "/etc/passwd"])
def test_a_mesh_names_files_of_its_own_folder_only(tmp_path, uri):
    (tmp_path / "m.gltf").write_text(gltf(uri))
    with pytest.raises(ModelFileError):
        read_mesh(tmp_path / "m.gltf")


MJCF = {
    "include": '<include file="named"/>',
    "mesh": '<asset><mesh name="m" file="named"/></asset>',
    "texture": '<asset><texture name="t" type="2d" file="named"/></asset>',
    "hfield": '<asset><hfield name="h" size="1 1 1 1" file="named"/></asset>',
    "skin": '<asset><skin name="s" file="named"/></asset>',
    "model": '<asset><model name="o" file="named"/></asset>',
}


@pytest.mark.parametrize(("kind", "how"), list(product([k for k in KINDS if k != "folder"], MJCF)))
def test_an_mjcf_file_cannot_name_one(tmp_path, kind, how):
    make(kind, tmp_path / "named")
    path = tmp_path / "r.xml"
    path.write_text(f'<mujoco>{MJCF[how]}<worldbody><body><geom size="1"/></body></worldbody></mujoco>')
    with pytest.raises(ModelFileError, match=r"not a regular file|limit|only MuJoCo"):
        load_model(path)


@pytest.mark.parametrize("kind", [k for k in KINDS if k != "folder"])
def test_a_package_is_looked_for_without_opening_one(tmp_path, kind):
    (tmp_path / "pkg").mkdir()
    make(kind, tmp_path / "pkg" / "package.xml")
    (tmp_path / "r.urdf").write_text(f'<robot name="r">{LINK.format("package://other/m.stl")}</robot>')
    with pytest.raises(ModelFileError, match="the ROS package 'other' is not found"):
        load_model(tmp_path / "r.urdf")


def test_a_mesh_that_was_replaced_since_is_not_opened(tmp_path):
    (tmp_path / "m.obj").write_text(TRIANGLE)
    (tmp_path / "r.urdf").write_text(f'<robot name="r">{LINK.format("m.obj")}</robot>')
    model = load_model(tmp_path / "r.urdf")
    (tmp_path / "m.obj").unlink()
    os.mkfifo(tmp_path / "m.obj")
    with pytest.raises(ModelFileError, match="not a regular file"):
        fingerprint(model)


DOCTYPE = '<?xml version="1.0" encoding="{}"?><!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]>{}'
ENCODINGS = ["utf-8", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-32-le", "utf-7", "latin-1", "cp037"]
DOCUMENTS = {
    "r.urdf": '<robot name="r"/>',
    "r.urdf.xacro": '<robot name="r"/>',
    "r.xml": "<mujoco/>",
    "r.dae": "<COLLADA/>",
}


@pytest.mark.parametrize(("encoding", "name"), list(product(ENCODINGS, DOCUMENTS)))
def test_a_document_type_is_refused_in_every_encoding(tmp_path, encoding, name):
    path = tmp_path / name
    path.write_bytes(DOCTYPE.format(encoding, DOCUMENTS[name]).encode(encoding))
    with pytest.raises(ModelFileError, match=r"document type|well-formed|not readable") as caught:
        (read_mesh if name.endswith(".dae") else load_model)(path)
    if encoding in ("utf-8", "utf-16", "latin-1"):
        assert "document type" in str(caught.value)


def test_the_limits_of_yaml_files_are_named(tmp_path):
    for text, limit in (
        ("a: " + "x" * 10**6, "512 KiB"),
        ("a: [" + "1," * 30_000 + "]", "20,001 values; the limit is 20,000"),
    ):
        (tmp_path / "c.yaml").write_text(text)
        with pytest.raises(ConfigFileError, match=limit):
            load_yaml(tmp_path / "c.yaml")


def test_a_bundle_of_two_gigabytes_is_refused(tmp_path):
    with (tmp_path / "p.frobs").open("wb") as file:
        file.truncate(2**31)
    with pytest.raises(BundleError, match="the maximum size of a bundle"):
        read_bundle(tmp_path / "p.frobs")


def test_ordinary_files_are_read(tmp_path):
    (tmp_path / "b.bin").write_bytes(np.array([0, 0, 0, 1, 0, 0, 0, 1, 0], "<f4").tobytes())
    (tmp_path / "m.gltf").write_text(gltf("b.bin"))
    assert len(read_mesh(tmp_path / "m.gltf")[0].faces) == 1
    (tmp_path / "link.urdf").symlink_to("real.urdf")
    (tmp_path / "real.urdf").write_text('<robot name="r"><link name="a"/></robot>')
    assert load_model(tmp_path / "link.urdf").name == "r"
