"""Encodes and decodes the messages of the world plugin. The C++ counterpart is ``wire.hh``."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from enum import IntEnum
from typing import Any

import numpy as np
import numpy.typing as npt


class Op(IntEnum):
    """Operations of the plugin."""

    HELLO = 0
    SETUP = 1
    SPAWN = 2
    REMOVE = 3
    LAYOUT = 4
    PART = 5
    STEP = 6
    GAINS = 7
    WRITE = 8
    PLACE = 9
    RAYS = 10
    PUSH = 11
    GRAVITY = 12
    MASS = 13
    FRICTION = 14
    STATE = 15
    CLEAR = 16
    MODELS = 17


HEADER = struct.Struct("<IB")
"""Message header: the size of the message body, and the operation.

In an answer, the operation is replaced by 1 if the request was executed, and by 0 if the request was rejected.
"""


def count(value: int) -> bytes:
    """Encode a count or an index."""
    return struct.pack("<I", value)


def numbers(values: npt.ArrayLike) -> bytes:
    """Encode numbers, without a count."""
    return np.ascontiguousarray(values, "<f8").tobytes()


def text(value: str) -> bytes:
    """Encode a string."""
    data = value.encode()
    return count(len(data)) + data


def texts(*values: str) -> bytes:
    """Encode several strings, without a count."""
    return b"".join(map(text, values))


def indices(values: Iterable[int]) -> bytes:
    """Encode indices, preceded by the number of indices."""
    items = list(values)
    return struct.pack(f"<{len(items) + 1}I", len(items), *items)


def read_numbers(body: bytes) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Decode the numbers in an answer."""
    return np.frombuffer(body, "<f8")


def step(decimation: int, commands: npt.ArrayLike) -> bytes:
    """Return the body of a step request.

    Args:
        decimation: Number of physics steps.
        commands: Drive commands, (rows, joints), with a single row for all physics steps or one row per physics step.
    """
    rows, joints = np.shape(commands)
    return struct.pack("<III", decimation, rows, joints) + numbers(commands)
