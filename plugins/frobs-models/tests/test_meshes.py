from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from frobs_core.models import Mesh
from frobs_core.util.errors import ModelFileError
from frobs_models import convex_parts
from frobs_models.meshes import files as mesh_files
from frobs_models.meshes import mesh as meshes
from frobs_models.meshes.mesh import bounding_box, joined, read_mesh, scaled, write_stl

BOX = trimesh.creation.box((0.2, 0.4, 0.6))
TWO_OBJECTS = """mtllib two.mtl
o lower
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
usemtl red
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
o upper
v 2 0 0
v 3 0 0
v 2 1 0
v 2 0 1
usemtl blue
f 5 7 6
f 5 6 8
f 5 8 7
f 6 7 8
"""
MATERIALS = "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n"


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "frobs" / "meshes"


def two_objects(folder: Path) -> Path:
    (folder / "two.obj").write_text(TWO_OBJECTS)
    (folder / "two.mtl").write_text(MATERIALS)
    return folder / "two.obj"


def volume(part) -> float:
    a, b, c = np.moveaxis(part.vertices[part.faces], 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize("name", ["m.stl", "m.STL", "m.obj", "m.dae", "m.ply", "m.off", "m.glb", "ascii.stl"])
def test_every_format_gives_the_same_triangles(tmp_path, name):
    path = tmp_path / name
    kind = "stl_ascii" if name == "ascii.stl" else path.suffix[1:].lower()
    BOX.export(path, file_type=kind)
    for _ in range(2):  # read, and from the cache
        part = joined(read_mesh(path))
        assert len(part.faces) == 12
        assert volume(part) == pytest.approx(0.2 * 0.4 * 0.6, rel=1e-5)
        low, high = bounding_box(Mesh(path))
        assert high - low == pytest.approx((0.2, 0.4, 0.6), rel=1e-6)


def test_objects_of_an_obj_keep_their_colours_and_all_their_triangles(tmp_path):
    parts = read_mesh(two_objects(tmp_path))
    assert {part.rgba for part in parts} == {(1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0)}
    assert [len(part.faces) for part in parts] == [4, 4]


def test_an_obj_without_its_materials_has_no_colour(tmp_path):
    path = two_objects(tmp_path)
    (tmp_path / "two.mtl").unlink()
    assert [part.rgba for part in read_mesh(path)] == [None]
    assert len(joined(read_mesh(path)).faces) == 8


def test_the_unit_of_a_collada_file_counts(tmp_path):
    path = tmp_path / "m.dae"
    BOX.export(path)
    unit = '<unit meter="0.001" name="millimetre"/>'
    text = path.read_text()
    path.write_text(text.replace("<asset>", f"<asset>{unit}", 1) if "<unit" not in text else text)
    if "<unit" in text:
        path.write_text(text.replace(text[text.index("<unit") : text.index(">", text.index("<unit")) + 1], unit))
    low, high = bounding_box(Mesh(path))
    assert high - low == pytest.approx((0.0002, 0.0004, 0.0006))


def test_a_collada_file_whose_materials_are_broken_loses_its_colours_only(tmp_path):
    path = tmp_path / "m.dae"
    BOX.export(path)
    text = path.read_text()
    assert "instance_effect" in text
    path.write_text(text.replace('<instance_effect url="#', '<instance_effect url="#nowhere_'))
    (part,) = read_mesh(path)
    assert len(part.faces) == 12


@pytest.mark.parametrize("scale", [(1.0, -1.0, 1.0), (-1.0, -1.0, -1.0), (-2.0, 1.0, -1.0)])
def test_a_mirrored_mesh_keeps_its_outside_outside(tmp_path, scale):
    BOX.export(tmp_path / "m.stl")
    (part,) = scaled(read_mesh(tmp_path / "m.stl"), scale)
    assert volume(part) == pytest.approx(abs(np.prod(scale)) * BOX.volume, rel=1e-5)


def test_what_is_written_as_stl_is_read_again(tmp_path):
    part = joined(read_mesh(two_objects(tmp_path)))
    write_stl(part, tmp_path / "m.stl")
    assert volume(joined(read_mesh(tmp_path / "m.stl"))) == pytest.approx(volume(part), rel=1e-6)


def test_a_mesh_is_parsed_once_whatever_it_is_called(tmp_path, monkeypatch):
    path = two_objects(tmp_path)
    read_mesh(path)
    monkeypatch.setattr(meshes, "_parse", lambda *_: pytest.fail("parsed again"))
    (tmp_path / "again.obj").write_bytes(path.read_bytes())
    assert len(read_mesh(tmp_path / "again.obj")) == 2


def test_other_content_or_other_materials_are_another_mesh(tmp_path, cache):
    path = two_objects(tmp_path)
    read_mesh(path)
    (tmp_path / "two.mtl").write_text(MATERIALS.replace("Kd 1 0 0", "Kd 0 1 0"))
    assert (0.0, 1.0, 0.0, 1.0) in {part.rgba for part in read_mesh(path)}
    path.write_text(TWO_OBJECTS.replace("v 3 0 0", "v 4 0 0"))
    assert bounding_box(Mesh(path))[1][0] == 4.0
    assert len(list(cache.iterdir())) == 3


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 and then nothing", b"x" * 1000])
def test_a_damaged_cache_is_mended(tmp_path, cache, damage):
    path = two_objects(tmp_path)
    read_mesh(path)
    (file,) = cache.iterdir()
    file.write_bytes(damage)
    assert len(read_mesh(path)) == 2
    assert file.read_bytes() != damage


def test_a_cache_that_cannot_be_written_costs_only_time(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert len(read_mesh(two_objects(tmp_path))) == 2


@pytest.mark.slow
def test_several_processes_may_fill_the_cache_at_once(tmp_path, cache):
    path = two_objects(tmp_path)
    code = (
        "import sys; from pathlib import Path; from frobs_models.meshes import mesh as meshes\n"
        "for _ in range(20):\n"
        "    path = Path(sys.argv[1]); parts = meshes._parse(path, path.read_bytes()); store = meshes.MeshCache(Path(sys.argv[1]), b'same')\n"
        "    store.store(parts); assert len(store.load(meshes.MeshPart)) == 2"
    )
    running = [subprocess.Popen([sys.executable, "-c", code, path]) for _ in range(3)]
    assert [process.wait() for process in running] == [0, 0, 0]
    assert [file.suffix for file in cache.iterdir()] == [".npz"]


def binary_stl(count: int, body: bytes) -> bytes:
    return bytes(80) + count.to_bytes(4, "little") + body


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("m.stl", b"", "broken"),
        ("m.stl", binary_stl(1000, b"123"), "broken"),
        ("m.stl", binary_stl(0, b""), "no triangle"),
        ("m.stl", binary_stl(1, np.full(12, np.nan, "<f4").tobytes() + b"\0\0"), "broken"),
        ("m.obj", b"hello", "broken"),
        ("m.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "broken"),
        ("m.obj", b"v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n", "broken"),
        ("m.dae", b"<COLLADA", "broken"),
        ("m.dae", b'<!DOCTYPE c [<!ENTITY a "aa">]><COLLADA>&a;</COLLADA>', "document type"),
        ("m.glb", b"glTF", "broken"),
        ("m.ply", b"ply\nformat ascii 1.0\nelement vertex 9\nend_header\n", "broken"),
        ("m.mesh", b"", r"with the suffix '\.mesh'"),
    ],
    ids=[
        "empty",
        "cut off",
        "no faces",
        "not a number",
        "no numbers",
        "no such vertex",
        "nan",
        "cut off xml",
        "entities",
        "glb",
        "ply",
        "unknown ending",
    ],
)
def test_a_broken_mesh_is_refused_by_name(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ModelFileError, match=message) as caught:
        read_mesh(tmp_path / name)
    assert caught.value.path == tmp_path / name


def test_a_mesh_beyond_all_measure_is_refused_before_it_is_parsed(tmp_path, monkeypatch):
    BOX.export(tmp_path / "m.stl")
    monkeypatch.setattr(meshes, "MAX_FACES", 11)
    with pytest.raises(ModelFileError, match="exceeds the limit of 11 triangles"):
        read_mesh(tmp_path / "m.stl")
    monkeypatch.setattr(mesh_files, "MAX_BYTES", 100)
    with pytest.raises(ModelFileError, match="exceeds the size limit of 0 KiB"):
        read_mesh(tmp_path / "m.stl")


@pytest.mark.slow
def test_a_mesh_of_50_megabytes_is_read(tmp_path):
    count = 1_000_000
    records = np.zeros(count, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rng = np.random.default_rng(0)
    records["corners"] = rng.random((count, 3, 3), np.float32)
    (tmp_path / "m.stl").write_bytes(binary_stl(count, records.tobytes()))
    assert len(joined(read_mesh(tmp_path / "m.stl")).faces) == count


def collada(folder: Path, change=lambda text: text) -> Path:
    """Write a cube of 100 mm in millimeters, after a change to the text."""
    path = folder / "cube.dae"
    text = trimesh.exchange.dae.export_collada(trimesh.creation.box((100.0, 100.0, 100.0))).decode()
    asset = text[text.index("<asset>") : text.index("</asset>")]
    text = text.replace(asset, '<asset><unit name="millimeter" meter="0.001"/>')
    changed = change(text)
    path.write_text(changed, encoding="utf-8")
    return path


UNIT = '<unit name="millimeter" meter="0.001"/>'


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace(UNIT, '<!-- <unit name="meter" meter="1"/> -->' + UNIT),
        lambda text: text.replace(UNIT, '<extra><technique profile="X"><unit meter="1"/></technique></extra>' + UNIT),
        lambda text: text.replace(
            UNIT, '<extra><technique profile="X"><![CDATA[<unit meter="1"/>]]></technique></extra>' + UNIT
        ),
        lambda text: text.replace(UNIT, UNIT.replace('"0.001"', '" 1e-3 "')),
        lambda text: (
            text.replace("<", "<c:")
            .replace("<c:/", "</c:")
            .replace("<c:?", "<?")
            .replace("<c:!", "<!")
            .replace("xmlns=", "xmlns:c=")
        ),
        lambda text: "\ufeff" + text,
    ],
    ids=["comment", "extra", "cdata", "spaces", "prefix", "byte order mark"],
)
def test_the_unit_of_a_collada_file_is_that_of_its_document(tmp_path, change):
    assert np.ptp(joined(read_mesh(collada(tmp_path, change))).vertices, axis=0) == pytest.approx([0.1] * 3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace('"0.001"', '"0,001"'), "a unit of '0,001' m"),
        (lambda text: text.replace('"0.001"', '"1_0"'), "a unit of '1_0' m"),
        (lambda text: text.replace('"0.001"', '"-1"'), "a unit of '-1' m"),
        (lambda text: text[: text.index("<scene>")] + "</COLLADA>", "has no <scene>"),
    ],
)
def test_a_collada_file_that_says_no_size_or_shows_nothing_is_refused(tmp_path, change, message):
    with pytest.raises(ModelFileError, match=message):
        read_mesh(collada(tmp_path, change))


def test_an_ascii_stl_may_end_without_endsolid(tmp_path):
    path = tmp_path / "m.stl"
    text = trimesh.exchange.stl.export_stl_ascii(BOX)
    path.write_text(text[: text.index("endsolid")])
    assert len(joined(read_mesh(path)).faces) == 12


def test_a_flat_mesh_becomes_a_plate_of_a_millimeter(tmp_path):
    path = tmp_path / "m.stl"
    corners = np.array([[0.0, 0, 0], [0.2, 0, 0], [0.2, 0.1, 0.1], [0, 0.1, 0.1]])
    write_stl(meshes.MeshPart(corners, np.array([[0, 1, 2], [2, 3, 0]], np.int32)), path)
    [plate] = convex_parts(Mesh(path))
    normal = np.array([0.0, -1.0, 1.0]) / np.sqrt(2.0)
    assert np.ptp(plate.vertices @ normal) == pytest.approx(1e-3)
    assert np.ptp(plate.vertices[:, 0]) == pytest.approx(0.2)
    assert volume(plate) > 0.0


def test_a_mesh_whose_vertices_lie_on_a_line_is_no_collision_shape(tmp_path):
    path = tmp_path / "m.stl"
    write_stl(meshes.MeshPart(np.array([[0.0, 0, 0], [1, 1, 1], [2, 2, 2]]), np.array([[0, 1, 2]], np.int32)), path)
    with pytest.raises(ModelFileError, match="on a line"):
        convex_parts(Mesh(path))
