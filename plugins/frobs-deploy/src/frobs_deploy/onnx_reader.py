"""Reads the structure of an ONNX file, and rejects everything that an exported policy does not need.

ONNX files are protocol buffers, which can encode the same content in several ways. This reader accepts only the shortest
encoding and the fields listed here, so that it cannot disagree with the reader of onnxruntime. The fields are numbered as
in onnx.proto (https://github.com/onnx/onnx/blob/main/onnx/onnx.proto).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

from frobs_deploy.budgets import exceeds

_ALLOWED = {
    "model": {1, 2, 3, 4, 5, 6, 7, 8, 14},  # not: training information, functions
    "graph": {1, 2, 5, 10, 11, 12, 13, 14, 16},  # not: sparse initializers
    "node": {1, 2, 3, 4, 5, 6, 7, 9},  # not: overloads of functions
    "attribute": {1, 2, 3, 4, 5, 7, 8, 9, 13, 20},  # not: graphs, references to attributes, types, sparse tensors
    "tensor": {1, 2, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 16},  # not: segments, data in other files
}
_ONCE = {"model": {7}, "graph": set(), "node": {3, 4, 7}, "attribute": {1, 5, 20}, "tensor": {2, 8, 9, 14}}
_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5


class GraphError(Exception):
    """The file is not an ONNX file that this reader accepts. The message completes a sentence about the file."""


@dataclass
class Node:
    """A node: its operator, and the names of its inputs and outputs."""

    operator: str = ""
    inputs: list[str] = field(default_factory=list)
    outputs: list[str] = field(default_factory=list)


class OnnxReader:
    """Structure of an ONNX file.

    Args:
        data: Content of the file.

    Attributes:
        nodes: Nodes in the order of the file.
        shapes: Shape of each initializer, by name.
        batch_names: Names of the symbolic dimensions of the inputs.

    Raises:
        GraphError: The file is not a valid ONNX file, or contains something that is not allowed.
    """

    def __init__(self, data: bytes) -> None:
        self.nodes: list[Node] = []
        self.shapes: dict[str, tuple[int, ...]] = {}
        self.batch_names: set[str] = set()
        self._fields = 0
        self._head, self._body = bytearray(), bytearray()  # the model without its graph, the graph without its outputs
        for number, value, raw in self._read(memoryview(data), "model"):
            if number != 7:
                self._head += raw
                continue
            for part, content, encoded in self._read(_bytes(value), "graph"):
                if part == 1:
                    self._node(_bytes(content))
                elif part == 5:
                    self._tensor(_bytes(content))
                elif part == 11:
                    self._input(_bytes(content))
                if part not in (12, 13):  # declared shapes of values could be wrong
                    self._body += encoded

    def with_all_outputs(self) -> bytes:
        """Return the file with every value of the graph as an output, without declared shapes."""
        names = [name.encode() for node in self.nodes for name in node.outputs if name]
        outputs = b"".join(_field(12, _field(1, name)) for name in names)
        return bytes(self._head) + _field(7, bytes(self._body) + outputs)

    def _node(self, data: memoryview) -> None:
        node, domain = Node(), ""
        for number, value, _ in self._read(data, "node"):
            if number == 1:
                node.inputs.append(_text(value))
            elif number == 2:
                node.outputs.append(_text(value))
            elif number == 4:
                node.operator = _text(value)
            elif number == 7:
                domain = _text(value)
            elif number == 5:
                for part, content, _ in self._read(_bytes(value), "attribute"):
                    if part == 5:
                        self._tensor(_bytes(content))
        if domain not in ("", "ai.onnx"):
            raise GraphError(f"contains the operator '{node.operator:.60}' of the domain '{domain:.60}'")
        self.nodes.append(node)
        if reason := exceeds("nodes of the graph", len(self.nodes)):
            raise GraphError(f"is too large: {reason}")

    def _tensor(self, data: memoryview) -> None:
        shape: list[int] = []
        name = ""
        for number, value, _ in self._read(data, "tensor"):
            if number == 1 and isinstance(value, memoryview):
                at = 0
                while at < len(value):
                    size, at = _varint(value, at)
                    shape.append(size)
            elif number == 1 and isinstance(value, int):
                shape.append(value)
            elif number == 8:
                name = _text(value)
            elif number == 14 and value != 0:
                raise GraphError("contains a tensor whose values are in another file")
        if math.prod(shape) > 2 * len(data):  # the smallest elements have four bits
            raise GraphError(f"contains a tensor of {math.prod(shape):,} elements in {len(data):,} bytes")
        self.shapes[name] = tuple(shape)

    def _input(self, data: memoryview) -> None:
        """Store the names of an input's symbolic dimensions: ValueInfo → type → tensor type → shape → dim → dim_param."""
        parts = [data]
        for tag in (2, 1, 2, 1, 2):
            parts = [_bytes(value) for part in parts for number, value, _ in self._read(part, None) if number == tag
                     and isinstance(value, memoryview)]  # fmt: skip
        self.batch_names |= {_text(part) for part in parts}

    def _read(self, data: memoryview, kind: str | None) -> Iterator[tuple[int, int | memoryview, memoryview]]:
        """Yield the number, the value and the encoding of each field of a message."""
        at, seen = 0, set()
        while at < len(data):
            self._fields += 1
            if reason := exceeds("fields of the graph", self._fields):
                raise GraphError(f"is too large: {reason}")
            start = at
            key, at = _varint(data, at)
            number, wire = key >> 3, key & 7
            value: int | memoryview
            if wire == _VARINT:
                value, at = _varint(data, at)
            elif wire in (_FIXED64, _BYTES, _FIXED32):
                length, at = _varint(data, at) if wire == _BYTES else (8 if wire == _FIXED64 else 4, at)
                if length > len(data) - at:
                    raise GraphError("is incomplete")
                value, at = data[at : at + length], at + length
            else:
                raise GraphError(f"contains data of the unknown type {wire}")
            if kind is not None and number not in _ALLOWED[kind]:
                raise GraphError(f"contains the field {number} in a {kind}, which no exported policy has")
            if kind is not None and number in _ONCE[kind] and number in seen:
                raise GraphError(f"contains the field {number} of a {kind} twice")
            seen.add(number)
            yield number, value, data[start:at]


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    """Return an integer and the position after it."""
    value = 0
    for i in range(10):
        if at + i >= len(data):
            raise GraphError("is incomplete")
        byte = data[at + i]
        value |= (byte & 0x7F) << (7 * i)
        if byte < 0x80:
            if (byte == 0 and i) or value >= 2**64:
                break
            return value, at + i + 1
    raise GraphError("contains an integer that is not encoded in the usual way")


def _field(number: int, content: bytes) -> bytes:
    key, length, encoded = number << 3 | _BYTES, len(content), bytearray()
    for value in (key, length):
        while value >= 0x80:
            encoded.append(value & 0x7F | 0x80)
            value >>= 7
        encoded.append(value)
    return bytes(encoded) + content


def _bytes(value: int | memoryview) -> memoryview:
    if isinstance(value, int):
        raise GraphError("contains an integer where text or a message is expected")
    return value


def _text(value: int | memoryview) -> str:
    try:
        return str(_bytes(value), "utf-8")
    except UnicodeDecodeError as error:
        raise GraphError("contains a name that is not UTF-8 text") from error
