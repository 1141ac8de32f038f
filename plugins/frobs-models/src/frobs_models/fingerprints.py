"""Fingerprints of robot models, which are equal for two files that describe the same robot."""

from __future__ import annotations

import hashlib
import json
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from frobs_core.models import RobotModel
from frobs_core.util.errors import ModelFileError
from frobs_core.util.files import read_limited
from frobs_models.meshes.files import MAX_BYTES

_DIGITS = 9
"""Number of significant digits to compare. Further digits may differ between machines."""


def fingerprint(model: RobotModel) -> str:
    """Return the hexadecimal SHA-256 hash of a robot's links, joints, limits, inertias, shapes and mesh files.

    File locations, comments, whitespace, macros and the robot's name are ignored.

    Raises:
        ModelFileError: A mesh file cannot be read.
    """
    content = {"links": _plain(model.links), "joints": _plain(model.joints)}
    return hashlib.sha256(json.dumps(content, sort_keys=True, allow_nan=False).encode()).hexdigest()


def _plain(value: Any) -> Any:
    if isinstance(value, bool) or value is None or isinstance(value, str):
        return value
    if isinstance(value, int | float):
        return f"{float(value) + 0.0:.{_DIGITS}g}"  # + 0.0 converts −0 to 0
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Path):
        return _file(value)
    if is_dataclass(value) and not isinstance(value, type):
        return {"": type(value).__name__, **{field.name: _plain(getattr(value, field.name)) for field in fields(value)}}
    return [_plain(item) for item in value]


def _file(path: Path) -> str:
    try:
        return hashlib.sha256(read_limited(path, MAX_BYTES)).hexdigest()
    except OSError as error:
        raise ModelFileError(path, f"cannot be read: {error.strerror}.") from error
