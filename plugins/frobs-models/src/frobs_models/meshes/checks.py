"""Checks mesh files before parsing, so that a small file cannot expand to a huge mesh."""

from __future__ import annotations

import base64
import json
import re
import struct
from collections import Counter, defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn
from xml.parsers import expat

from frobs_core.util.errors import ModelFileError
from frobs_models.budgets import BUDGETS
from frobs_models.meshes.files import PIXEL

MAX_PARTS = BUDGETS["mesh"]["parts"]
MAX_DEPTH = BUDGETS["mesh"]["levels of nesting"]
MAX_MATERIALS = BUDGETS["mesh"]["materials"]
MAX_VERTICES = BUDGETS["mesh"]["vertices"]

_HOLDERS = ("node", "geometry")
_INSTANCES = ("instance_node", "instance_geometry", "instance_controller")
_PARTS = ("triangles", "polylist", "polygons", "trifans", "tristrips")
_MATERIAL = re.compile(rb"^[ \t]*usemtl[ \t]+(.*)$", re.MULTILINE)
_GLB, _JSON = 0x46546C67, 0x4E4F534A
_PIXEL_URI = "data:image/png;base64," + base64.b64encode(PIXEL).decode()


def check_collada(path: Path, data: bytes) -> float:
    """Check that a COLLADA file is XML without a document type, and that its nodes are not repeated excessively.

    Returns:
        The unit that the document declares [m], or 1.

    Raises:
        ModelFileError: The check fails, or the unit is not a positive number.
    """
    opened: list[str] = []  # the elements around the current position
    unit = counts = ""
    scene = False
    below: dict[str, Counter[str]] = defaultdict(Counter)  # contents of each node, and how often the node uses each
    parts: Counter[str] = Counter()  # number of parts of each geometry
    stack: list[str] = [""]
    parser = expat.ParserCreate()
    parser.buffer_text = True

    def doctype(*_: Any) -> None:
        raise ModelFileError(path, "the mesh declares a document type (<!DOCTYPE …>), which is not allowed: remove it.")

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal unit, scene
        kind = tag.rpartition(":")[2]
        opened.append(kind)
        if len(opened) > MAX_DEPTH:
            raise ModelFileError(path, f"the elements of the mesh are nested deeper than {MAX_DEPTH} levels.")
        # Parts of the document may have units of their own, which do not count.
        if opened == ["COLLADA", "asset", "unit"]:
            unit = attributes.get("meter", "1")
        scene |= opened == ["COLLADA", "scene", "instance_visual_scene"]
        if kind in _HOLDERS:
            name = attributes.get("id") or f"/{parser.CurrentByteIndex}"
            if kind == "node":
                below[stack[-1]][name] += 1
            stack.append(name)
        elif kind in _INSTANCES:
            below[stack[-1]][attributes.get("url", "").removeprefix("#")] += 1
        elif kind in _PARTS:
            parts[stack[-1]] += 1

    def text(characters: str) -> None:
        nonlocal counts
        if opened[-1:] == ["p"] and "-" in characters:
            raise ModelFileError(path, "the mesh is broken: a vertex has a negative index.")
        if opened[-1:] == ["vcount"]:
            counts += characters

    def end(tag: str) -> None:
        nonlocal counts
        if opened.pop() == "vcount":
            words = counts.split()
            if not all(word.isdigit() and len(word) < 10 for word in words) or sum(map(int, words)) > MAX_VERTICES:
                _refuse(path, "claims too many vertices in its polygons", f"{MAX_VERTICES:,}")
            counts = ""
        if tag.rpartition(":")[2] in _HOLDERS:
            stack.pop()

    parser.StartDoctypeDeclHandler = doctype
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = text
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, LookupError, ValueError) as error:
        raise ModelFileError(path, f"the mesh is broken: it is not well-formed XML ({error}).") from error
    _check_parts(path, sum(parts.values()))
    _check_instances(path, below, parts)
    if not scene:
        raise ModelFileError(
            path, "the mesh has no <scene> that shows a <visual_scene>, so it shows nothing: export it again."
        )
    return _metres(path, unit)


def _metres(path: Path, text: str) -> float:
    try:
        unit = float(text or "1") if text.isascii() and "_" not in text else 0.0
    except ValueError:
        unit = 0.0
    if not 0.0 < unit < float("inf"):
        raise ModelFileError(path, f"the mesh declares a unit of '{text}' m, which is not a positive number.")
    return unit


def check_obj(path: Path, data: bytes) -> None:
    """Check the number of materials in an OBJ file."""
    materials = len({name.strip() for name in _MATERIAL.findall(data)})
    if materials > MAX_MATERIALS:
        _refuse(path, f"has {materials:,} materials", f"{MAX_MATERIALS:,}")


def check_gltf(path: Path, data: bytes) -> bytes:
    """Check the declared sizes in a glTF file, and how often its nodes use each mesh.

    Returns:
        The file's content without its images, because images may be huge after decompression.

    Raises:
        ModelFileError: A declared size is too large, or the file is broken.
    """
    try:
        binary = len(data) >= 20 and struct.unpack_from("<I", data)[0] == _GLB
        length = struct.unpack_from("<I", data, 12)[0] if binary else 0
        text = data[20 : 20 + length] if binary else data
        tree = json.loads(text)
        _check_tree(path, tree)
        if not tree.get("images"):
            return data
        tree["images"] = [{"uri": _PIXEL_URI} for _ in tree["images"]]
        changed = json.dumps(tree, allow_nan=False).encode()
        if not binary:
            return changed
        changed += b" " * (-len(changed) % 4)
        rest = data[20 + length :]
        return b"".join(
            [struct.pack("<IIIII", _GLB, 2, 20 + len(changed) + len(rest), len(changed), _JSON), changed, rest]
        )
    except ModelFileError:
        raise
    except RecursionError as error:
        raise ModelFileError(path, "the mesh is broken: its values are nested too deeply.") from error
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, struct.error) as error:
        raise ModelFileError(path, f"the mesh is broken: {type(error).__name__}: {error}.") from error


def _check_tree(path: Path, tree: Any) -> None:
    counts = [int(accessor["count"]) for accessor in tree.get("accessors", ())]
    for total in (sum(counts), sum(_vertices(part, counts) for part in _primitives(tree))):
        if total > MAX_VERTICES or min(counts, default=0) < 0:
            _refuse(path, f"claims {total:,} vertices", f"{MAX_VERTICES:,}")
    nodes, meshes = tree.get("nodes", []), tree.get("meshes", [])
    below: dict[str, Counter[str]] = {}
    for i, node in enumerate(nodes):
        below[str(i)] = Counter(map(str, node.get("children", ())))
        if "mesh" in node:
            below[str(i)][f"mesh {node['mesh']}"] += 1
    below[""] = Counter(str(i) for scene in tree.get("scenes", ()) for i in scene.get("nodes", ()))
    _check_parts(path, len(_primitives(tree)))
    _check_instances(path, below, {f"mesh {i}": len(mesh["primitives"]) for i, mesh in enumerate(meshes)})


def _primitives(tree: Any) -> list[Any]:
    return [part for mesh in tree.get("meshes", ()) for part in mesh["primitives"]]


def _vertices(part: Any, counts: list[int]) -> int:
    """Return the number of vertices that a part of a mesh uses."""
    return sum(counts[i] for i in (*part["attributes"].values(), *([part["indices"]] if "indices" in part else [])))


def _check_parts(path: Path, count: int) -> None:
    if count > MAX_PARTS:
        _refuse(path, f"has {count:,} parts or more", f"{MAX_PARTS:,}")


def _check_instances(path: Path, below: Mapping[str, Mapping[str, int]], parts: Mapping[str, int]) -> None:
    """Check the number of parts and empty nodes of a scene, including all repetitions.

    ``below`` states how often each node contains other nodes and geometries, and ``parts`` the parts of each geometry.
    """
    totals: dict[str, int] = {}
    opened: set[str] = set()
    for first in below:
        waiting = [(first, False)]
        while waiting:
            name, done = waiting.pop()
            if done:
                opened.discard(name)
                totals[name] = parts.get(name, 0) + sum(n * totals[inner] for inner, n in below.get(name, {}).items())
                _check_parts(path, totals[name])
                totals[name] = max(1, totals[name])  # an empty node also takes time to load
            elif name not in totals:
                if name in opened:
                    raise ModelFileError(path, "the mesh is broken: a node contains itself.")
                opened.add(name)
                waiting += [(name, True), *((inner, False) for inner in below.get(name, {}))]


def _refuse(path: Path, what: str, limit: str) -> NoReturn:
    raise ModelFileError(path, f"the mesh {what}; the limit is {limit}. Simplify it.")
