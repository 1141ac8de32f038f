"""Reads the plain JSON and the tensors, but not the pickles, in the zip file of a model.

stable-baselines3 writes each attribute of a model into the JSON file ``data``. If JSON cannot represent a value, the
file contains a base64-encoded pickle under ``:serialized:`` and a readable text description. This module never loads
these pickles. PyTorch reads the tensors with ``weights_only``, which creates only tensors, numbers and containers.
"""

from __future__ import annotations

import io
import json
import pickle
import re
import struct
import warnings
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch as th

from frobs_core.util.errors import CheckpointError, UntrustedFileError
from frobs_core.util.files import read_limited
from frobs_core.util.plain import to_json

MAX_FILE_BYTES = 2**32
"""Maximum size of a model file."""

MAX_JSON_BYTES = 64 * 2**20
"""Maximum size of the JSON file ``data``, in which attributes with images can occupy several megabytes."""

MAX_MEMBERS = 64
"""Maximum number of files in an archive. stable-baselines3 writes at most eight files."""

MAX_GROWTH = 20
"""Maximum ratio of uncompressed to compressed size. Files written by stable-baselines3 are not compressed."""

_NAME = re.compile(r"^[A-Za-z_][A-Za-z0-9_.]*$")
_INNER_NAME = re.compile(r"^(?!/)(?!.*\.\.)[A-Za-z0-9_./-]+$")
_DAMAGE = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, OSError, RuntimeError, KeyError, OverflowError)
_VARIABLES = ("pytorch_variables.pth", "tensors.pth")


@dataclass(frozen=True)
class ModelArchive:
    """Contents of a model file."""

    path: Path  # the file
    content: bytes  # its bytes
    data: Mapping[str, Any]  # the JSON without ``:serialized:`` entries
    pickled: frozenset[str]  # keys of ``data`` whose values are pickled
    tensors: Mapping[str, Any]  # state dictionaries by part: ``policy``, ``policy.optimizer``, …
    version: str  # version of stable-baselines3


def read_archive(path: Path | str) -> ModelArchive:
    """Read a model file without executing code in it or writing to disk.

    Args:
        path: Path of the file. A missing ``.zip`` suffix is added.

    Raises:
        CheckpointError: The file is missing or damaged, or opening it would exhaust memory.
        UntrustedFileError: A tensor file contains other objects.
    """
    path = find_file(path)
    try:
        content = read_limited(path, MAX_FILE_BYTES)
    except OSError as error:
        raise CheckpointError(f"{path} cannot be read: {error.strerror or error}.") from error
    with _open(path, io.BytesIO(content), len(content), _NAME) as archive:
        names = archive.namelist()
        if "data" not in names or "policy.pth" not in names:
            raise CheckpointError(
                f"{path} is not a model of stable-baselines3: it must contain the files 'data' and 'policy.pth'."
            )
        data, pickled = _read_json(path, archive)
        tensors = {
            name.removesuffix(".pth"): _read_tensors(path, name, _member(path, archive, name))
            for name in names
            if name.endswith(".pth")
        }
        known_version = "_stable_baselines3_version" in names
        version = _member(path, archive, "_stable_baselines3_version")[:64] if known_version else b""
    for name in _VARIABLES:
        tensors.pop(name.removesuffix(".pth"), None)  # checked but not kept, because the loader reads the file again
    return ModelArchive(path, content, data, pickled, tensors, version.decode("ascii", "replace").strip())


def find_file(path: Path | str, suffix: str = ".zip") -> Path:
    """Return the path of the file, with the suffix added if necessary, or raise CheckpointError if no file exists."""
    path = Path(path)
    for candidate in (path, path.with_name(path.name + suffix)):
        if candidate.is_file():
            return candidate
    raise CheckpointError(f"{path} does not exist, with or without the suffix '{suffix}'; check the path.")


def clean_copy(archive: ModelArchive, keys: Mapping[str, Any]) -> io.BytesIO:
    """Return a copy of the model file that contains its tensors and the attribute names in ``keys``, but no pickles."""
    target = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(archive.content)) as old, zipfile.ZipFile(target, "w") as new:
        new.writestr("data", to_json(dict.fromkeys(keys)))
        for name in old.namelist():
            if name.endswith(".pth"):
                new.writestr(name, old.read(name))
    target.seek(0)
    return target


def _open(path: Path, file: io.BytesIO, size: int, allowed: re.Pattern[str], part: str = "") -> zipfile.ZipFile:
    """Open an archive and check its table of contents."""
    where = f"{path}{f' ({part})' if part else ''}"
    try:
        archive = zipfile.ZipFile(file)
    except (*_DAMAGE, ValueError) as error:
        raise CheckpointError(f"{where} is damaged: it is not a zip archive ({error}).") from error
    members = archive.infolist()
    names = [member.filename for member in members]
    for member in members:
        if not allowed.match(member.filename):
            raise CheckpointError(f"{where} is rejected: it contains an unexpected file named {member.filename!r}.")
        if member.flag_bits & 0x1:
            raise CheckpointError(f"{where} is rejected: its file '{member.filename}' is encrypted.")
    if len(set(names)) < len(names):
        raise CheckpointError(f"{where} is rejected: it contains two files with the same name.")
    if not part and len(names) > MAX_MEMBERS:
        raise CheckpointError(
            f"{where} is rejected: it contains {len(names)} files, more than the limit of {MAX_MEMBERS} files."
        )
    total = sum(member.file_size for member in members)
    if total > MAX_GROWTH * size:
        raise CheckpointError(
            f"{where} is rejected: its size would grow from {size:,} to {total:,} bytes when unpacked."
        )
    return archive


def _member(path: Path, archive: zipfile.ZipFile, name: str) -> bytes:
    try:
        return archive.read(name)
    except (*_DAMAGE, ValueError) as error:
        raise CheckpointError(f"{path} is damaged: its file '{name}' cannot be read ({error}).") from error


def _read_json(path: Path, archive: zipfile.ZipFile) -> tuple[dict[str, Any], frozenset[str]]:
    size = archive.getinfo("data").file_size
    if size > MAX_JSON_BYTES:
        raise CheckpointError(
            f"{path} is rejected: its file 'data' has {size:,} bytes, more than the limit of {MAX_JSON_BYTES:,} bytes."
        )
    try:
        data = json.loads(_member(path, archive, "data"))
    except (ValueError, RecursionError) as error:
        raise CheckpointError(f"{path} is damaged: its file 'data' is not valid JSON ({error}).") from error
    if not isinstance(data, dict):
        raise CheckpointError(f"{path} is damaged: its file 'data' is not a JSON object.")
    pickled = frozenset(key for key, value in data.items() if isinstance(value, dict) and ":serialized:" in value)
    for key in pickled:
        data[key] = {name: value for name, value in data[key].items() if name != ":serialized:"}
    return data, pickled


def _read_tensors(path: Path, name: str, content: bytes) -> Any:
    if zipfile.is_zipfile(io.BytesIO(content)):
        _open(path, io.BytesIO(content), len(content), _INNER_NAME, name).close()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # ignore warnings, because problems with the file are reported below
            value = th.load(io.BytesIO(content), map_location="cpu", weights_only=True)
    except pickle.UnpicklingError as error:
        raise UntrustedFileError(
            path, f"its file '{name}' contains objects that can only be created by executing code"
        ) from error
    except (RuntimeError, EOFError, KeyError, ValueError, TypeError, AttributeError, IndexError) as error:
        raise CheckpointError(f"{path} is damaged: its file '{name}' cannot be read ({error}).") from error
    for tensor in _walk(value):
        if tensor.numel() * tensor.element_size() > max(tensor.untyped_storage().nbytes(), 1):
            raise CheckpointError(f"{path} is rejected: a tensor in its file '{name}' is larger than the stored data.")
    return value


def _walk(value: Any) -> list[th.Tensor]:
    if isinstance(value, th.Tensor):
        return [] if value.layout != th.strided else [value]
    if isinstance(value, Mapping):
        return [tensor for item in value.values() for tensor in _walk(item)]
    if isinstance(value, list | tuple):
        return [tensor for item in value for tensor in _walk(item)]
    return []
