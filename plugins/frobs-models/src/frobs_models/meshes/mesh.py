"""Reads mesh files as triangles, for engines that do not support the file format.

Coordinates are read from the file and converted to meters. As in RViz and Gazebo, the unit that a COLLADA file declares
is applied, but its up axis is ignored. Meshes that take a long time to parse are cached by content.
"""

from __future__ import annotations

import io
import logging
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from frobs_core.models import Mesh
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ModelFileError
from frobs_models.budgets import BUDGETS
from frobs_models.meshes.cache import MeshCache
from frobs_models.meshes.checks import check_collada, check_gltf, check_obj
from frobs_models.meshes.files import SiblingFiles, read_mesh_file

FORMATS = (".stl", ".obj", ".dae", ".ply", ".off", ".glb", ".gltf")
"""Suffixes of supported mesh files."""

MAX_FACES = BUDGETS["mesh"]["triangles"]

_LOOKS = (
    *("bind_material", "instance_camera", "instance_light"),
    *("library_materials", "library_effects", "library_images", "library_cameras", "library_lights"),
)
_DEFAULT_COLOUR = (102, 102, 102, 255)  # trimesh's value for files without a color

Rgba = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class MeshPart:
    """The triangles of one color in a mesh.

    Attributes:
        vertices: (n, 3) [m]
        faces: Vertex indices of each triangle, (m, 3) int32, counterclockwise when seen from outside.
        rgba: Color with components in [0, 1], or None if the file does not define a color.
    """

    vertices: Floats
    faces: npt.NDArray[np.int32]
    rgba: Rgba | None = None


def read_mesh(path: Path) -> tuple[MeshPart, ...]:
    """Read a mesh file and return one part for each of its colors.

    Raises:
        ModelFileError: The file cannot be read, contains no triangles, is broken or is too large.
    """
    data, unit = _read_file(path)
    if path.suffix.lower() == ".stl" and data[:5] != b"solid":
        return _checked(path, _parse(path, data))  # as fast as reading a cache
    cache = MeshCache(path, data)
    parts = cache.load(MeshPart)
    if parts is None:
        parts = _checked(path, _parse(path, data, unit))
        cache.store(parts)
    return parts


def scaled(parts: Iterable[MeshPart], scale: tuple[float, float, float]) -> tuple[MeshPart, ...]:
    """Return the parts scaled along the axes. Faces keep their orientation even if the scale mirrors the mesh."""
    mirrored = scale[0] * scale[1] * scale[2] < 0.0
    return tuple(
        MeshPart(part.vertices * scale, part.faces[:, ::-1] if mirrored else part.faces, part.rgba) for part in parts
    )


def joined(parts: Iterable[MeshPart]) -> MeshPart:
    """Return the triangles of all ``parts`` as one part without a color."""
    vertices, faces, count = [], [], 0
    for part in parts:
        vertices.append(part.vertices)
        faces.append(part.faces + count)
        count += len(part.vertices)
    return MeshPart(np.concatenate(vertices), np.concatenate(faces).astype(np.int32))


def bounding_box(mesh: Mesh) -> tuple[Floats, Floats]:
    """Return the minimum and maximum corners of a mesh's bounding box, (3,) [m] each.

    Raises:
        ModelFileError: The mesh file cannot be read.
    """
    vertices = np.concatenate([part.vertices for part in read_mesh(mesh.path)]) * mesh.scale
    return vertices.min(axis=0), vertices.max(axis=0)


def write_stl(part: MeshPart, path: Path) -> None:
    """Write triangles as a binary STL file, which every engine can read."""
    corners = part.vertices[part.faces]  # (m, 3, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    records = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records["normal"] = normals / np.where(length == 0.0, 1.0, length)
    records["corners"] = corners
    path.write_bytes(bytes(80) + np.uint32(len(corners)).astype("<u4").tobytes() + records.tobytes())


def _read_file(path: Path) -> tuple[bytes, float]:
    """Return the content of a mesh file after it was checked, and its unit of length [m]."""
    if path.suffix.lower() not in FORMATS:
        raise ModelFileError(
            path, f"meshes with the suffix '{path.suffix}' are not supported; use one of {', '.join(FORMATS)}."
        )
    data = read_mesh_file(path)
    match path.suffix.lower():
        case ".dae":
            return _without_prefixes(data), check_collada(path, data)
        case ".obj":
            check_obj(path, data)
        case ".gltf" | ".glb":
            return check_gltf(path, data), 1.0
        case ".stl" if (
            data[:5].lower() == b"solid" and b"facet" in data[:1000] and b"endsolid" not in data[-1000:].lower()
        ):
            return data + b"\nendsolid\n", 1.0  # some exporters omit the last line, which trimesh requires
    return data, 1.0


def _without_prefixes(data: bytes) -> bytes:
    """Return a COLLADA document whose elements have no namespace prefixes, which pycollada does not support."""
    if b":COLLADA" not in data:
        return data
    return _edited(data, lambda root: None)


def _without_looks(data: bytes) -> bytes:
    """Return a COLLADA document without materials, cameras and lights."""

    def edit(root: ElementTree.Element) -> None:
        for parent in list(root.iter()):
            for child in [child for child in parent if child.tag in _LOOKS]:
                parent.remove(child)

    return _edited(data, edit)


def _edited(data: bytes, edit: Callable[[ElementTree.Element], None]) -> bytes:
    """Return an edited COLLADA document. :func:`check_collada` has rejected document types."""
    root = ElementTree.fromstring(data)
    namespace = root.tag[1:].partition("}")[0] if root.tag.startswith("{") else ""
    for element in root.iter():
        if isinstance(element.tag, str):
            element.tag = element.tag.rpartition("}")[2]
    edit(root)
    if namespace:
        root.set("xmlns", namespace)
    edited: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return edited


def _parse(path: Path, data: bytes, unit: float = 1.0) -> list[MeshPart]:
    import trimesh

    groups: dict[Rgba | None, list[MeshPart]] = {}
    beside = SiblingFiles(path)
    faces = 0
    with _quiet():
        try:
            scene = _load(path, data, beside)
            for node in scene.graph.nodes_geometry:
                transform, name = scene.graph[node]
                mesh = scene.geometry[name]
                if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
                    continue  # points and lines
                faces += len(mesh.faces)
                if faces > MAX_FACES:
                    break  # the caller rejects it
                rgba = _colour(mesh)
                mesh = mesh.copy(include_visual=False)
                mesh.apply_transform(transform)
                mesh = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
                if np.isfinite(mesh.vertices).all():
                    mesh.merge_vertices()
                part = MeshPart(np.array(mesh.vertices, float) * unit, np.array(mesh.faces, np.int32), rgba)
                groups.setdefault(rgba, []).append(part)
        except Exception as error:  # parsers raise many types of exceptions
            if beside.refused is None:
                reason = f"the mesh is broken: {type(error).__name__}: {' '.join(str(error).split())[:200]}"
                raise ModelFileError(path, reason) from error
    if beside.refused is not None:
        raise ModelFileError(path, beside.refused)
    if faces > MAX_FACES:
        raise ModelFileError(path, f"the mesh exceeds the limit of {MAX_FACES:,} triangles. Simplify the mesh.")
    parts = ((rgba, joined(meshes)) for rgba, meshes in groups.items())
    return [MeshPart(part.vertices, part.faces, rgba) for rgba, part in parts]


def _load(path: Path, data: bytes, beside: SiblingFiles) -> Any:
    """Load a mesh file completely. If the materials of a COLLADA file are broken, load the file without colors."""
    import collada
    import trimesh

    def load(text: bytes, **keywords: Any) -> Any:
        kind = path.suffix.lower().removeprefix(".")
        return trimesh.load_scene(io.BytesIO(text), file_type=kind, process=False, **keywords)

    if path.suffix.lower() != ".dae":
        return load(data, resolver=beside)
    try:
        return load(data, ignore_broken=False)  # without its textures
    except collada.common.DaeError:
        return load(_without_looks(data), ignore_broken=False)


def _colour(mesh: Any) -> Rgba | None:
    """Return the color of a mesh, or None if the mesh does not have a single color."""
    material = getattr(mesh.visual, "material", None)
    if material is None or getattr(material, "image", None) is not None:
        return None
    if getattr(material, "baseColorTexture", None) is not None:
        return None
    colour = tuple(int(c) for c in material.main_color)
    if colour == _DEFAULT_COLOUR or len(colour) != 4:
        return None
    r, g, b, a = (c / 255.0 for c in colour)
    return r, g, b, a or 1.0  # an alpha of 0 is treated as 1, because some exporters confuse transparency with opacity


def _checked(path: Path, parts: list[MeshPart]) -> tuple[MeshPart, ...]:
    if not parts:
        raise ModelFileError(path, "the mesh is broken or empty: it contains no triangles.")
    for part in parts:
        if not np.isfinite(part.vertices).all():
            raise ModelFileError(path, "the mesh is broken: a coordinate is not finite.")
        if part.faces.min() < 0 or part.faces.max() >= len(part.vertices):
            raise ModelFileError(path, "the mesh is broken: a triangle refers to a vertex that does not exist.")
    return tuple(parts)


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress the parser's messages about textures, which are not rendered."""
    logger = logging.getLogger("trimesh")
    level, logger.level = logger.level, logging.ERROR
    try:
        yield
    finally:
        logger.level = level
