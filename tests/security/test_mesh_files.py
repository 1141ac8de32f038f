"""Mesh files that would take long, much memory or another file: each is read or refused, quickly, with one line."""

from __future__ import annotations

import contextlib
import json
import resource
import struct
import time
from pathlib import Path

import pytest
import trimesh

from frobs_core.util.errors import ModelFileError
from frobs_models.meshes.mesh import read_mesh

OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
STL = (
    b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n"
)
OFF = b"3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
PLY = b"ply\nformat %s 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
FACE = b"element face 1\nproperty list uchar int vertex_indices\nend_header\n"
DAE: bytes = trimesh.exchange.dae.export_collada(trimesh.creation.box((1.0, 1.0, 1.0)))
BODY = b"0 0 0\n1 0 0\n0 1 0\n"

READ: dict[str, bytes] = {
    "newlines.obj": OBJ + b"\n" * 200_000,
    "newlines before.obj": b"\n" * 200_000 + OBJ,
    "blank lines.obj": b"\n \t" * 100_000 + OBJ,
    "blanks after usemtl.obj": OBJ + b"usemtl" + b" " * 200_000 + b"\nf 1 2 3\n",
    "blanks in a vertex.obj": b"v" + b"\t" * 200_000 + b"0 0 0\n" + OBJ,
    "a face of slashes.obj": OBJ + b"f " + b"1/" * 100_000 + b"\n",
    "materials without end.obj": b"usemtl a\nusemtl b\n" * 50_000 + OBJ,
    "objects.obj": b"".join(b"o a%d\ng b\n" % i for i in range(50_000)) + OBJ,
    "units in a comment.dae": DAE.replace(b"<asset>", b"<asset><!--" + b"<unit " * 200_000 + b"-->"),
    "effects.dae": DAE.replace(
        b"<library_geometries>", b"<extra>" + b"<a/>" * 50_000 + b"</extra><library_geometries>"
    ),
    "a comment.off": b"OFF\n" + b"#" * 200_000 + b"\n" + OFF,
    "newlines.off": b"OFF" + b"\n \n" * 100_000 + OFF,
    "a long face.ply": PLY % (b"ascii", 3) + FACE + BODY + b"100000 " + b"0 " * 100_000 + b"\n",
    "blanks.stl": STL.replace(b"solid a", b"solid " + b" " * 200_000, 1),
}
REFUSED: dict[str, bytes] = {
    "blanks after mtllib.obj": b"mtllib" + b" " * 200_000 + b"\n" + OBJ,
    "an index of 13 digits.obj": b"v 0 0 0\nf 1 2 9999999999999\n",
    "an infinite vertex.obj": OBJ + b"v 1e999 0 0\nf 1 2 4\n",
    "a number of 200,000 digits.obj": OBJ + b"v " + b"9" * 200_000 + b" 0 0\nf 1 2 4\n",
    "openings.dae": DAE.replace(b"</COLLADA>", b"<bind_material " * 20_000),
    "depth.dae": DAE.replace(b"<asset>", b"<extra>" * 100_000),
    "negative indices.dae": DAE.replace(b"<p>", b"<p>-5 "),
    "many vertices.dae": DAE.replace(b"<triangles", b"<polylist")
    .replace(b"</triangles>", b"</polylist>")
    .replace(b"<p>", b"<vcount>999999999 4</vcount><p>"),
    "a count.ply": PLY % (b"ascii", 10**12) + FACE + BODY + b"3 0 1 2\n",
    "a binary count.ply": PLY % (b"binary_little_endian", 4 * 10**9) + b"end_header\n" + bytes(1_000),
    "comments.ply": b"ply\n" + b"comment x\n" * 100_000 + b"format ascii 1.0\nend_header\n",
    "elements.ply": b"ply\nformat ascii 1.0\n" + b"element e 1\nproperty float x\n" * 20_000 + b"end_header\n",
    "a count.off": b"OFF\n999999999999 1 0\n0 0 0\n3 0 1 2\n",
    "a count.stl": bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(500),
    "solids.stl": b"solid x\n" + b"solid " * 40_000,
    "ends.stl": b"solid\n" + b"endsolid solid " * 30_000,
    "vertices without facets.stl": b"solid x\nfacet\n" + b"vertex\n" * 100_000 + b"endsolid",
    "half a vertex.stl": STL[: STL.index(b"1 0\nendloop")],
    "depth.gltf": b"[" * 100_000,
    "a number of 100,000 digits.gltf": b'{"a":' + b"1" * 100_000 + b"}",
    "uris.gltf": (b'{"uri"' + b" " * 100) * 3_000,
    "a length.glb": struct.pack("<IIIII", 0x46546C67, 2, 100, 2**32 - 1, 0x4E4F534A) + b"{}",
    "a foreign buffer.gltf": json.dumps(
        {
            "asset": {"version": "2.0"},
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "buffers": [{"uri": "/etc/passwd", "byteLength": 36}],
        }
    ).encode(),
}
FAST = 3.0  # [s] of processor time, of which these files take less than half; what is quadratic takes minutes
SMALL = 500  # [MiB]


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.mark.parametrize("name", [*READ, *REFUSED])
def test_a_hostile_mesh_costs_little(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes({**READ, **REFUSED}[name])
    before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    if name in READ:
        assert sum(len(part.faces) for part in read_mesh(path)) >= 1
    else:
        with pytest.raises(ModelFileError) as caught:
            read_mesh(path)
        assert "\n" not in str(caught.value)
        assert len(str(caught.value)) < 500
        assert "RecursionError" not in str(caught.value)
    assert time.process_time() - start < FAST
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < SMALL * 1024


@pytest.mark.parametrize("suffix", ["stl", "obj", "dae", "ply", "off", "glb"])
def test_a_truncated_mesh_is_read_or_refused(suffix: str, tmp_path: Path) -> None:
    whole = trimesh.creation.box((1.0, 1.0, 1.0)).export(file_type=suffix)
    data = whole.encode() if isinstance(whole, str) else whole
    path = tmp_path / f"m.{suffix}"
    for length in range(0, len(data), 37):
        path.write_bytes(data[:length])
        with contextlib.suppress(ModelFileError):
            read_mesh(path)
