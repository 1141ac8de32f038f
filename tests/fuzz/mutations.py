"""Changes to valid files, at the level of their structure: elements, values, archive members, nodes of a graph, files.

A mutation is three integers and the name of an operation, so that a case can be stored, repeated and shortened. Integers
select an element or a value modulo the number of choices.
"""

from __future__ import annotations

import copy
import functools
import hashlib
import io
import json
import os
import re
import shutil
import stat
import xml.etree.ElementTree as ET
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import values
import yaml

XACRO = "http://www.ros.org/wiki/xacro"
MARK = "@@FUZZ@@"
ET.register_namespace("xacro", XACRO)

XML, DATA, TEXT, ARCHIVE, GRAPH = "xml", "data", "text", "archive", "graph"
FORMATS = {
    ".urdf": XML, ".xacro": XML, ".xml": XML, ".dae": XML, ".json": DATA, ".gltf": DATA, ".yaml": DATA, ".obj": TEXT,
    ".off": TEXT, ".csv": TEXT, ".mtl": TEXT, ".py": TEXT, ".txt": TEXT, ".launch": XML, ".frobs": ARCHIVE, ".npz": ARCHIVE,
    ".pt": ARCHIVE, ".zip": ARCHIVE, ".onnx": GRAPH,
}  # fmt: skip
"""Format by ending. Files with other endings are binary."""


@dataclass(frozen=True)
class Mutation:
    """One change.

    Attributes:
        operation: Key of :data:`OPERATIONS`.
        file: Selects the file among the files of the input.
        where: Selects the place in the file.
        value: Selects the value.
    """

    operation: str
    file: int
    where: int
    value: int


class UnchangedError(Exception):
    """The operation does not apply to this file."""


def pick(choices: Any, index: int) -> Any:
    """Return a choice by an index of any size."""
    if not choices:
        raise UnchangedError
    return choices[index % len(choices)]


def format_of(name: str) -> str:
    """Return the format of a file by its name."""
    return FORMATS.get(Path(name).suffix, "binary")


# XML -------------------------------------------------------------------------------------------------------------


def in_tree(change: Callable[[ET.Element, int, int], str | None]) -> Callable[..., bytes]:
    """Return an operation on bytes for one on the tree. If it returns a text, the text replaces the mark."""

    @functools.wraps(change)
    def apply(data: bytes, where: int, value: int, name: str) -> bytes:
        try:
            root = ET.fromstring(data)
        except (ET.ParseError, ValueError, LookupError, RecursionError):
            raise UnchangedError from None
        raw = change(root, where, value)
        try:
            text = ET.tostring(root, encoding="unicode")
        except (RecursionError, TypeError, ValueError):
            raise UnchangedError from None
        if raw is not None:
            text = re.sub(f"<{MARK}[^>]*>|{MARK}", lambda _: raw.replace("SELF", name), text, count=1)
        return text.encode("utf-8", "surrogatepass")

    return apply


def _children(root: ET.Element) -> list[tuple[ET.Element, int]]:
    return [(parent, index) for parent in root.iter() for index in range(len(parent))]


def _attributes(root: ET.Element) -> list[tuple[ET.Element, str]]:
    return [(element, key) for element in root.iter() for key in element.attrib]


def xml_delete(root: ET.Element, where: int, value: int) -> None:
    parent, index = pick(_children(root), where)
    del parent[index]


def xml_duplicate(root: ET.Element, where: int, value: int) -> None:
    parent, index = pick(_children(root), where)
    for _ in range(pick((1, 2, 50, 3000), value) if len(parent[index]) < 20 else 1):
        parent.insert(index, copy.deepcopy(parent[index]))


def xml_rename(root: ET.Element, where: int, value: int) -> None:
    parent, index = pick(_children(root), where)
    parent[index].tag = pick([*{element.tag for element in root.iter()}, "x", "Link", f"{{{XACRO}}}m"], value)


def xml_nest(root: ET.Element, where: int, value: int) -> None:
    parent, index = pick(_children(root), where)
    for _ in range(pick((1, 20, 200), value)):
        outer = ET.Element(parent[index].tag, parent[index].attrib)
        outer.append(parent[index])
        parent[index] = outer


def xml_move(root: ET.Element, where: int, value: int) -> None:
    parent, index = pick(_children(root), where)
    element = parent[index]
    del parent[index]
    pick(list(root.iter()), value).append(element)


def xml_swap(root: ET.Element, where: int, value: int) -> None:
    (one, key), (other, name) = pick(_attributes(root), where), pick(_attributes(root), value)
    one.attrib[key], other.attrib[name] = other.attrib[name], one.attrib[key]


def xml_number(root: ET.Element, where: int, value: int) -> None:
    numeric = [(e, k) for e, k in _attributes(root) if re.fullmatch(r"[\d\s.eE+-]+", e.attrib[k])]
    element, key = pick(numeric or _attributes(root), where)
    words = element.attrib[key].split() or [""]
    words[where % len(words)] = pick(values.NUMBERS, value)
    element.attrib[key] = " ".join(words)


def xml_more_numbers(root: ET.Element, where: int, value: int) -> None:
    element, key = pick(_attributes(root), where)
    element.attrib[key] += pick((" 1", " 1" * 20_000, " ", "\u00a0", ","), value)


def xml_name(root: ET.Element, where: int, value: int) -> None:
    element, key = pick(_attributes(root), where)
    element.attrib[key] = pick((*values.NAMES, *values.IMPORTS), value)


def xml_drop_attribute(root: ET.Element, where: int, value: int) -> None:
    element, key = pick(_attributes(root), where)
    del element.attrib[key]


def xml_add_attribute(root: ET.Element, where: int, value: int) -> None:
    element, key = pick(_attributes(root), value)
    pick(list(root.iter()), where).set(key, element.attrib[key])


def xml_insert(root: ET.Element, where: int, value: int) -> str:
    pick(list(root.iter()), where).insert(0, ET.Element(MARK))
    return str(pick(values.XML, value))


def xml_text(root: ET.Element, where: int, value: int) -> str:
    pick(list(root.iter()), where).text = MARK
    return str(pick((*values.NUMBERS, *values.XML), value))


def xml_prologue(data: bytes, where: int, value: int, name: str) -> bytes:
    start = b'<?xml version="1.0" encoding="%s"?>'
    entities = "".join(f'<!ENTITY e{i + 1} "{f"&e{i};" * 10}">' for i in range(12)).encode()
    body = re.sub(rb"^\s*<\?xml[^>]*>", b"", data)
    kinds = (
        lambda: start % b"utf-16" + body,
        lambda: body.decode("utf-8", "replace").encode("utf-16"),
        lambda: start % b"utf-7" + body,
        lambda: start % b"no-such-encoding" + body,
        lambda: b"\xef\xbb\xbf" + body,
        lambda: b"\n\n" + start % b"utf-8" + body,
        lambda: b"<!DOCTYPE r [" + entities + b"]>" + body.replace(b">", b">&e12;", 1),
        lambda: b'<!DOCTYPE r SYSTEM "file:///etc/passwd">' + body,
        lambda: b'<?xml version="1.1"?>' + body,
        lambda: body + body,
        lambda: body + b"<a/>",
        lambda: b"\x00" + body,
    )
    return bytes(pick(kinds, value)())


# JSON and YAML ---------------------------------------------------------------------------------------------------


def _load(data: bytes) -> Any:
    """Return the tree of a file, unless it has aliases: nested ones can describe more values than memory holds."""
    try:
        text = data.decode("utf-8")
        if text.lstrip().startswith(("{", "[")):
            return json.loads(text)
        if any(isinstance(event, yaml.AliasEvent) for event in yaml.parse(text)):
            raise UnchangedError
        return yaml.safe_load(text)
    except (ValueError, yaml.YAMLError, RecursionError, OverflowError):
        raise UnchangedError from None


def _dump(tree: Any, name: str, raw: str | None) -> bytes:
    """Return the text of a tree, as YAML or JSON by the file's name; ``raw`` replaces the mark."""
    try:
        text = (
            yaml.safe_dump(tree, sort_keys=False, width=10**6, allow_unicode=True)
            if name.endswith(".yaml")
            else json.dumps(tree, indent=1)
        )
    except (RecursionError, yaml.YAMLError, TypeError, ValueError):
        raise UnchangedError from None
    if raw is not None:
        text = re.sub(f"[\"']?{MARK}[\"']?", lambda _: raw, text, count=1)
    return text.encode("utf-8", "surrogatepass")


def _places(tree: Any) -> list[tuple[Any, Any]]:
    """Return all places that hold a value: a container and a key or an index."""
    found: list[tuple[Any, Any]] = []
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, dict | list):
            keys = list(node) if isinstance(node, dict) else list(range(min(len(node), 50)))
            found += [(node, key) for key in keys]
            waiting += [node[key] for key in keys]
    return found


def in_data(change: Callable[[list[tuple[Any, Any]], int, int, str], str | None]) -> Callable[..., bytes]:
    """Return an operation on bytes for one on the places of a tree."""

    @functools.wraps(change)
    def apply(data: bytes, where: int, value: int, name: str) -> bytes:
        tree = _load(data)
        return _dump(tree, name, change(_places(tree), where, value, name))

    return apply


def data_replace(places: list[tuple[Any, Any]], where: int, value: int, name: str) -> str:
    node, key = pick(places, where)
    node[key] = MARK
    return str(pick((*values.RAW, *values.YAML) if name.endswith(".yaml") else values.RAW, value))


def data_number(places: list[tuple[Any, Any]], where: int, value: int, name: str) -> None:
    numeric = [(n, k) for n, k in places if isinstance(n[k], int | float) and not isinstance(n[k], bool)]
    node, key = pick(numeric, where)
    old = node[key]
    extremes = (
        0,
        -1,
        1,
        -old,
        old * 10,
        old * 1e6,
        old / 1e6,
        10**9,
        10**18,
        10**400,
        0.5,
        1e308,
        1e-308,
        float("nan"),
        True,
    )
    try:
        node[key] = pick(extremes, value)
    except OverflowError:
        raise UnchangedError from None


def data_text(places: list[tuple[Any, Any]], where: int, value: int, name: str) -> None:
    node, key = pick([(n, k) for n, k in places if isinstance(n[k], str)], where)
    node[key] = pick(values.NAMES, value)


def data_import(places: list[tuple[Any, Any]], where: int, value: int, name: str) -> None:
    node, key = pick([(n, k) for n, k in places if isinstance(n[k], str) or n[k] is None], where)
    node[key] = pick(values.IMPORTS, value)


def data_delete(places: list[tuple[Any, Any]], where: int, value: int, name: str) -> None:
    node, key = pick(places, where)
    del node[key]


def data_rename(places: list[tuple[Any, Any]], where: int, value: int, name: str) -> None:
    node, key = pick([(n, k) for n, k in places if isinstance(n, dict)], where)
    node[pick((*values.NAMES, 5, None, True, 1.5), value)] = node.pop(key)


def data_swap(places: list[tuple[Any, Any]], where: int, value: int, name: str) -> None:
    (one, key), (other, place) = pick(places, where), pick(places, value)
    one[key], other[place] = copy.deepcopy(other[place]), copy.deepcopy(one[key])


def data_wrap(places: list[tuple[Any, Any]], where: int, value: int, name: str) -> None:
    node, key = pick(places, where)
    for _ in range(pick((1, 2, 40), value)):
        node[key] = [node[key]] if value % 2 else {"a": node[key]}


def data_repeat(places: list[tuple[Any, Any]], where: int, value: int, name: str) -> None:
    node, key = pick([(n, k) for n, k in places if isinstance(n[k], list) and n[k]], where)
    node[key] = node[key] * pick((2, 100, 5000), value)


def data_whole(data: bytes, where: int, value: int, name: str) -> bytes:
    text = str(pick((*values.RAW, *values.YAML), value))
    return text.encode("utf-8", "surrogatepass")


def data_key_again(data: bytes, where: int, value: int, name: str) -> bytes:
    lines = data.decode("utf-8", "replace").splitlines()
    line = pick(lines, where)
    return "\n".join([*lines[: where % len(lines)], line, *lines[where % len(lines) :]]).encode()


# Text and bytes --------------------------------------------------------------------------------------------------


def text_token(data: bytes, where: int, value: int, name: str) -> bytes:
    words = re.split(rb"(\s+|,)", data)
    words[where % len(words)] = str(pick(values.TOKENS, value)).encode()
    return b"".join(words)


def text_line(data: bytes, where: int, value: int, name: str) -> bytes:
    lines = data.split(b"\n")
    index = where % len(lines)
    again = pick((0, 2, 3, 2000), value)
    return b"\n".join(
        [*lines[:index], *([lines[index]] * again)[: max(1, 2**20 // (1 + len(lines[index])))], *lines[index + 1 :]]
    )


def bytes_cut(data: bytes, where: int, value: int, name: str) -> bytes:
    return data[: where * len(data) // 1009]


def bytes_flip(data: bytes, where: int, value: int, name: str) -> bytes:
    changed = bytearray(data)
    for i in range(pick((1, 3, 16), value)):
        if changed:
            changed[(where * 7919 + i * 104729 + value) % len(changed)] ^= 1 << (value % 8)
    return bytes(changed)


def bytes_number(data: bytes, where: int, value: int, name: str) -> bytes:
    size = pick((1, 2, 4, 8), value)
    number = pick(
        (b"\xff" * 8, b"\x00" * 8, b"\xff\xff\xff\x7f" * 2, b"\x00\x00\xc0\x7f" * 2, b"\x00\x00\x80\x7f" * 2),
        value // 4,
    )
    place = where % max(1, min(len(data), 4096))
    return data[:place] + number[:size] + data[place + size :]


def bytes_insert(data: bytes, where: int, value: int, name: str) -> bytes:
    place = where * len(data) // 1009
    more = pick((b"\x00", b"\xff", b"\n" * 200_000, b"\x00" * 300_000, data[:1000], b"\x1b[31m", b" " * 200_000), value)
    return data[:place] + more + data[place:]


# Archives --------------------------------------------------------------------------------------------------------


@functools.lru_cache(1)
def bomb() -> bytes:
    """Return a deflated member of 200 MB of zeros."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    block = b"\0" * 2**20
    return b"".join(packer.compress(block) for _ in range(200)) + packer.flush()


def _members(data: bytes) -> list[tuple[zipfile.ZipInfo, bytes]]:
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return [(info, archive.read(info)) for info in archive.infolist() if info.file_size < 2**26]
    except (zipfile.BadZipFile, OSError, ValueError, RuntimeError, EOFError, zlib.error, NotImplementedError):
        raise UnchangedError from None


def _pack(members: list[tuple[zipfile.ZipInfo, bytes]], comment: bytes = b"") -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.comment = comment
        for info, content in members:
            try:
                archive.writestr(info, content, info.compress_type)
            except (UserWarning, ValueError, UnicodeError, NotImplementedError):
                raise UnchangedError from None
    return buffer.getvalue()


def archive_rename(data: bytes, where: int, value: int, name: str) -> bytes:
    members = _members(data)
    _, content = pick(members, where)
    renamed = zipfile.ZipInfo(
        (pick(values.NAMES, value) or "x")[:60_000].encode("utf-8", "replace").decode().replace("\0", "?")
    )
    members[where % len(members)] = (renamed, content)
    return _pack(members)


def archive_repeat(data: bytes, where: int, value: int, name: str) -> bytes:
    import warnings

    members = _members(data)
    info, content = pick(members, where)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a name that is already there
        return _pack(members + [(copy.copy(info), content)] * pick((1, 200), value))


def archive_drop(data: bytes, where: int, value: int, name: str) -> bytes:
    members = _members(data)
    del members[where % len(members)]
    return _pack(members)


def archive_link(data: bytes, where: int, value: int, name: str) -> bytes:
    members = _members(data)
    info, _ = pick(members, where)
    link = zipfile.ZipInfo(info.filename)
    link.create_system, link.external_attr = 3, (stat.S_IFLNK | 0o777) << 16
    members[where % len(members)] = (link, b"../outside/secret.txt")
    return _pack(members)


def archive_bomb(data: bytes, where: int, value: int, name: str) -> bytes:
    """Replace a member by one that claims to be, and is, much larger than the archive."""
    members = _members(data)
    info, _ = pick(members, where)
    packed = _pack(
        [*((i, c) for i, c in members if i.filename != info.filename), (zipfile.ZipInfo(info.filename), bomb())]
    )
    # The stored member becomes a deflated one: its method, checksum and size are replaced in both headers.
    size, method = 200 * 2**20, (8).to_bytes(2, "little")
    crc = zlib.crc32(b"\0" * size).to_bytes(4, "little") if value % 4 == 0 else b"\0" * 4
    changed = bytearray(packed)
    encoded = info.filename.encode()
    for signature, at_method, at_crc, at_name in ((b"PK\x03\x04", 8, 14, 30), (b"PK\x01\x02", 10, 16, 46)):
        start = changed.rfind(signature + b"")
        while start >= 0 and changed[start + at_name : start + at_name + len(encoded)] != encoded:
            start = changed.rfind(signature, 0, start)
        if start >= 0:
            changed[start + at_method : start + at_method + 2] = method
            changed[start + at_crc : start + at_crc + 4] = crc
            changed[start + at_crc + 8 : start + at_crc + 12] = size.to_bytes(4, "little")
    return bytes(changed)


def archive_comment(data: bytes, where: int, value: int, name: str) -> bytes:
    return _pack(_members(data), pick((b"\x1b[31m", b"x" * 65_000, b"PK\x05\x06" * 100), value))


def archive_inner(data: bytes, where: int, value: int, name: str) -> bytes:
    """Change a member as a file of its own."""
    members = _members(data)
    chosen = where % len(members)
    info, content = members[chosen]
    operations = [key for key in OPERATIONS if key.startswith(f"{format_of(info.filename)}_")] or [
        key for key in OPERATIONS if key.startswith("binary_")
    ]
    operation = OPERATIONS[pick(operations, value)]
    members[chosen] = (info, operation(content, where * 31 + value * 17, value * 13 + where, info.filename))
    for index, (info, _) in enumerate(members):  # zipfile changes the records that it writes
        members[index] = (copy.copy(info), members[index][1])
    return _pack(members)


# Graphs of policies ----------------------------------------------------------------------------------------------


def in_graph(change: Callable[[Any, int, int], None]) -> Callable[..., bytes]:
    """Return an operation on bytes for one on an ONNX model."""

    @functools.wraps(change)
    def apply(data: bytes, where: int, value: int, name: str) -> bytes:
        import onnx
        from google.protobuf.message import DecodeError

        try:
            model = onnx.load_from_string(data)
            change(model, where, value)
            return bytes(model.SerializeToString())
        except (DecodeError, ValueError, TypeError):
            raise UnchangedError from None

    return apply


def graph_type(model: Any, where: int, value: int) -> None:
    kinds = ("Loop", "If", "Scan", "Nope", "", "ConstantOfShape", "Expand", "Tile", "RandomNormal", "StringConcat", "MatMul",
             "NonZero", "Einsum", "SequenceMap", "CumSum", "Range", "Resize", "Conv")  # fmt: skip
    pick(model.graph.node, where).op_type = pick(kinds, value)


def graph_repeat(model: Any, where: int, value: int) -> None:
    node = pick(model.graph.node, where)
    for _ in range(pick((1, 1000, 20_000), value)):
        model.graph.node.append(node)


def graph_wire(model: Any, where: int, value: int) -> None:
    node = pick(model.graph.node, where)
    names = [name for other in model.graph.node for name in (*other.input, *other.output)]
    if node.input:
        node.input[value % len(node.input)] = pick(names, value)


def graph_external(model: Any, where: int, value: int) -> None:
    tensor = pick(model.graph.initializer, where)
    tensor.ClearField("raw_data")
    tensor.data_location = 1
    entry = tensor.external_data.add()
    entry.key, entry.value = "location", pick(("../outside/secret.txt", "/etc/passwd", "/dev/zero", "x"), value)


def graph_dimensions(model: Any, where: int, value: int) -> None:
    tensor = pick(model.graph.initializer, where)
    number = pick((0, -1, 30_000, 2**31, 2**62), value)
    if tensor.dims:
        tensor.dims[0] = number
    else:
        tensor.dims.append(number)


def graph_large(model: Any, where: int, value: int) -> None:
    """Insert a node that makes a huge tensor out of nothing, and use it as a constant."""
    import numpy as np
    from onnx import helper, numpy_helper

    size = pick(([30_000, 30_000], [2**20, 4096], [10**9], [2**40]), value)
    model.graph.initializer.append(numpy_helper.from_array(np.array(size), "fuzz_shape"))
    model.graph.node.insert(0, helper.make_node("ConstantOfShape", ["fuzz_shape"], ["fuzz_large"]))
    node = helper.make_node("ReduceSum", ["fuzz_large"], ["fuzz_sum"], keepdims=0)
    model.graph.node.insert(1, node)
    last = model.graph.node[-1]
    if last.output:
        model.graph.node.append(helper.make_node("Add", [last.output[0], "fuzz_sum"], ["fuzz_action"]))


def graph_names(model: Any, where: int, value: int) -> None:
    hostile = pick(values.NAMES, value).encode("utf-8", "replace").decode()[:10_000]
    named = [*model.graph.input, *model.graph.output, *model.graph.node, *model.graph.initializer]
    pick(named, where).name = hostile


def graph_shape(model: Any, where: int, value: int) -> None:
    info = pick([*model.graph.input, *model.graph.output], where)
    shape = info.type.tensor_type.shape
    if value % 3 == 0:
        info.type.tensor_type.elem_type = pick((1, 7, 8, 11, 99), value)
    elif shape.dim:
        shape.dim[value % len(shape.dim)].dim_value = pick((0, 1, 7, 2**40, -5), value)


def graph_meta(model: Any, where: int, value: int) -> None:
    if value % 2:
        model.opset_import[0].version = pick((0, -1, 10**6), where)
    else:
        model.ir_version = pick((0, 99, 2**40), where)


# Files and folders -----------------------------------------------------------------------------------------------


def path_fifo(path: Path, value: int) -> None:
    _clear(path)
    os.mkfifo(path)


def path_folder(path: Path, value: int) -> None:
    _clear(path)
    path.mkdir()


def path_link(path: Path, value: int) -> None:
    _clear(path)
    path.symlink_to(pick(("/dev/zero", "/etc/passwd", "loop_to_nothing", path.name, "/proc/self/environ", "/"), value))


def path_link_outside(path: Path, value: int) -> None:
    """Let a file or its folder lead to the folder in which nothing may change."""
    target = path if value % 2 else path.parent
    work = next(parent for parent in path.parents if parent.name == "work")
    if target in (work, work / "my_run", work / "package"):
        target = path
    file = work.parent / "outside" / ("plots" if target.is_dir() else "secret.txt")
    _clear(target)
    target.symlink_to(file, target_is_directory=file.is_dir())


def path_add_link(path: Path, value: int) -> None:
    """Put links to the outer folder where commands write."""
    work = next(parent for parent in path.parents if parent.name == "work")
    name = pick(
        ("plots", "evaluations", "videos", "policy.frobs", "progress.csv.tmp", ".lock", "tensorboard", "parity"), value
    )
    target = path.parent / name
    _clear(target)
    target.symlink_to(work.parent / "outside" / ("secret.txt" if "." in name else "plots"))


def path_add_folder(path: Path, value: int) -> None:
    work = next(parent for parent in path.parents if parent.name == "work")
    for parent in {path.parent, path.parent.parent} - {work.parent}:
        for name in (
            "step_abc",
            "step_99999999999999999999",
            "step_000000064 ",
            "step_-1",
            "\x1b[31m",
            "é" * 80,
            ".hidden",
        ):
            (parent / name).mkdir(exist_ok=True)


def path_missing(path: Path, value: int) -> None:
    _clear(path)


def path_empty(path: Path, value: int) -> None:
    _clear(path)
    path.write_bytes(b"")


def path_sparse(path: Path, value: int) -> None:
    _clear(path)
    with path.open("wb") as file:
        file.truncate(pick((2**30, 2**33, 2**40), value))


def path_noise(path: Path, value: int) -> None:
    _clear(path)
    path.write_bytes(hashlib.shake_128(str(value).encode()).digest(5000))


def path_other(path: Path, value: int) -> None:
    """Give a file the content of another file of the input."""
    work = next(parent for parent in path.parents if parent.name == "work")
    data = pick([file for file in sorted(work.rglob("*")) if regular(file)], value).read_bytes()
    _clear(path)
    path.write_bytes(data)


def _clear(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def regular(path: Path) -> bool:
    """Return whether a path is a file that can be read, and no link."""
    return stat.S_ISREG(path.lstat().st_mode) and path.lstat().st_size < 2**26


def _named(prefix: str, wrapped: Callable[[Any], Any] | None = None) -> Iterator[tuple[str, Any]]:
    for name, function in globals().copy().items():
        if name.startswith(f"{prefix}_") and callable(function):
            takes_tree = function.__code__.co_varnames[0] in ("root", "places", "model")
            yield name, wrapped(function) if wrapped is not None and takes_tree else function


OPERATIONS: dict[str, Callable[[bytes, int, int, str], bytes]] = {
    **dict(_named("xml", in_tree)),
    **dict(_named("data", in_data)),
    **dict(_named("graph", in_graph)),
    **dict(_named("archive")),
    **dict(_named("text")),
    **{
        f"{kind}_{name}": function
        for name, function in _named("bytes")
        for kind in ("binary", XML, DATA, TEXT, ARCHIVE, GRAPH)
    },
}
"""Operations on the content of a file, by name. The name starts with the format."""

PATH_OPERATIONS: dict[str, Callable[[Path, int], None]] = dict(_named("path"))
"""Operations on a file as such."""


def apply(mutation: Mutation, files: list[Path]) -> bool:
    """Change one of the files and return whether the operation applied."""
    there = [file for file in files if os.path.lexists(file)]
    if mutation.operation in PATH_OPERATIONS:
        if not there:
            return False
        try:
            PATH_OPERATIONS[mutation.operation](pick(there, mutation.file), mutation.value)
        except (UnchangedError, StopIteration, OSError):
            return False
        return True
    kind = mutation.operation.partition("_")[0]
    fitting = [file for file in there if format_of(file.name) == kind and regular(file)]
    if not fitting:
        return False
    path = pick(fitting, mutation.file)
    try:
        data = OPERATIONS[mutation.operation](path.read_bytes(), mutation.where, mutation.value, path.name)
    except UnchangedError:
        return False
    path.write_bytes(data[: 2**26])
    return True


def sign(work: Path) -> None:
    """Write the checksums of changed files into bundles and checkpoints, as an attacker would."""
    for path in work.rglob("*"):
        if not regular(path):
            continue
        if path.suffix == ".frobs":
            with_sums = _sign_bundle(path.read_bytes())
            if with_sums is not None:
                path.write_bytes(with_sums)
        elif path.name == "checksums.json":
            sums = {
                file.relative_to(path.parent).as_posix(): hashlib.sha256(file.read_bytes()).hexdigest()
                for file in path.parent.rglob("*")
                if file != path and regular(file)
            }
            path.write_text(json.dumps(sums))


def _sign_bundle(data: bytes) -> bytes | None:
    try:
        members = _members(data)
        content = {info.filename: text for info, text in members}
        manifest = json.loads(content["bundle.json"])
        if not isinstance(manifest["files"], dict):
            return None
    except (UnchangedError, ValueError, KeyError, TypeError, RecursionError):
        return None
    sums = {
        name: {"bytes": len(text), "sha256": hashlib.sha256(text).hexdigest()}
        for name, text in content.items()
        if name in manifest["files"]
    }
    old = content["bundle.json"].decode("utf-8", "surrogatepass")
    for name, entry in sums.items():  # replaced in the text, so that odd texts elsewhere stay as they are
        before = manifest["files"][name]
        if isinstance(before, dict) and isinstance(before.get("sha256"), str) and isinstance(before.get("bytes"), int):
            old = old.replace(before["sha256"], str(entry["sha256"]))
            old = old.replace(f'"bytes": {before["bytes"]}', f'"bytes": {entry["bytes"]}')
    return _pack(
        [
            (copy.copy(info), old.encode("utf-8", "surrogatepass") if info.filename == "bundle.json" else text)
            for info, text in members
        ]
    )
