"""Reads, writes and validates policy bundles. A bundle is a file that contains a policy and its metadata."""

from __future__ import annotations

import hashlib
import io
import json
import stat
import struct
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from frobs_deploy.budgets import BUDGET, exceeds
from frobs_deploy.errors import BundleError

FORMAT = 1
"""Format version of ``bundle.json``. Files of any other format version are rejected."""

GRAPH, MANIFEST, LICENSE = "policy.onnx", "bundle.json", "LICENSE"
_LARGEST = {GRAPH: BUDGET["bytes of policy.onnx"], MANIFEST: BUDGET["bytes of bundle.json"], LICENSE: 2**20}
"""Maximum size of each member of the archive [bytes]. No other members are permitted."""

_LARGEST_FILE = sum(_LARGEST.values()) + 2**16  # [bytes]

_DATE = (1980, 1, 1, 0, 0, 0)  # a constant date, so that bundles with the same content are identical files
_AGAIN = "Copy the file again, or export the policy again."
_DAMAGE = (
    zipfile.BadZipFile,
    zipfile.LargeZipFile,
    struct.error,
    EOFError,
    OSError,
    ValueError,
    RuntimeError,  # for example, an encrypted member or an unknown compression method (NotImplementedError)
    KeyError,
    OverflowError,
    MemoryError,
)


@dataclass(frozen=True)
class Bundle:
    """The content of a bundle file whose checksums are valid.

    Attributes:
        path: Path of the bundle file.
        manifest: Content of ``bundle.json``.
        graph: Content of ``policy.onnx``.
        license: Text of the license.
    """

    path: Path
    manifest: Mapping[str, Any]
    graph: bytes
    license: str


def pack_bundle(manifest: Mapping[str, Any], graph: bytes, license: str) -> bytes:
    """Return the bytes of a bundle file. The checksums of the graph and the license are added to the manifest.

    The file is a zip archive with uncompressed members, so that no member can be larger than the file.

    Args:
        manifest: Content of ``bundle.json``, without ``format`` and ``files``.
        graph: Content of ``policy.onnx``.
        license: Text of the license.
    """
    members = {GRAPH: graph, LICENSE: license.encode()}
    sums = {name: {"bytes": len(data), "sha256": _sha256(data)} for name, data in members.items()}
    text = json.dumps({"format": FORMAT, **manifest, "files": sums}, indent=1, ensure_ascii=False, allow_nan=False)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name, data in {MANIFEST: f"{text}\n".encode(), **members}.items():
            info = zipfile.ZipInfo(name, _DATE)
            info.create_system, info.external_attr = 3, 0o100644 << 16  # the same attributes on all operating systems
            archive.writestr(info, data)
    return buffer.getvalue()


def read_bundle(path: Path | str) -> Bundle:
    """Read the bundle ``path`` without executing or unpickling anything from it.

    Raises:
        BundleError: The file does not exist, is not a bundle, or is damaged.
    """
    path = Path(path)
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise BundleError(path, "this is a folder; specify the bundle file that 'frobs export' printed.")
        if not stat.S_ISREG(status.st_mode):  # a FIFO or a device could block forever
            raise BundleError(path, "this is not a regular file; specify the bundle file that 'frobs export' printed.")
        if status.st_size > _LARGEST_FILE:
            raise BundleError(
                path, f"the file is larger than {_LARGEST_FILE // 2**20} MiB, the maximum size of a bundle."
            )
        data = path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a NUL character in the path
        raise BundleError(path, f"the file cannot be read: {getattr(error, 'strerror', None) or error}.") from error
    return parse_bundle(path, data)


def parse_bundle(path: Path, data: bytes) -> Bundle:
    """Read a bundle from bytes instead of a file. ``path`` only appears in error messages and in the result.

    Raises:
        BundleError: The bytes are not a bundle, or are damaged.
    """
    members = _members(path, data)
    try:
        manifest = json.loads(members[MANIFEST].decode("utf-8"))
        license = members[LICENSE].decode("utf-8")
    except RecursionError as error:
        raise BundleError(path, f"the bundle is damaged: {MANIFEST} is nested too deeply. {_AGAIN}") from error
    except ValueError as error:
        reason = "an integer has too many digits" if "int_max_str_digits" in str(error) else error
        raise BundleError(path, f"the bundle is damaged: {reason}. {_AGAIN}") from error
    if not isinstance(manifest, dict):
        raise BundleError(path, f"the bundle is damaged: {MANIFEST} is not a JSON object. {_AGAIN}")
    _check_size(path, manifest)
    if manifest.get("format") != FORMAT:
        raise BundleError(
            path,
            f"the bundle has format {manifest.get('format')!r}, but this version of FRobs supports only format "
            f"{FORMAT}; export the policy again.",
        )
    sums = manifest.get("files")
    for name in (GRAPH, LICENSE):
        checksum = sums.get(name) if isinstance(sums, dict) else None
        if not isinstance(checksum, dict) or checksum.get("sha256") != _sha256(members[name]):
            raise BundleError(
                path, f"the bundle is damaged: {name} does not match its checksum in {MANIFEST}. {_AGAIN}"
            )
    return Bundle(path, manifest, members[GRAPH], license)


def _members(path: Path, data: bytes) -> dict[str, bytes]:
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            infos = archive.infolist()
            names = [info.filename for info in infos]
            if sorted(names) != sorted(_LARGEST):
                expected = ", ".join(_LARGEST)
                raise BundleError(
                    path, f"the file is not a policy bundle: it contains {_shown(names)}; expected {expected}."
                )
            for info in infos:
                if info.compress_type != zipfile.ZIP_STORED or info.file_size != info.compress_size:
                    raise BundleError(
                        path, f"the file is not a policy bundle, because {info.filename} in the archive is compressed."
                    )
                if info.file_size > _LARGEST[info.filename]:
                    limit = _LARGEST[info.filename]
                    raise BundleError(
                        path,
                        f"{info.filename} is {info.file_size:,} bytes, larger than the limit of {limit:,} bytes.",
                    )
            return {info.filename: archive.read(info) for info in infos}
    except _DAMAGE as error:
        raise BundleError(path, f"the file is damaged, or is not a policy bundle: {error}. {_AGAIN}") from error


def _check_size(path: Path, manifest: Mapping[str, Any]) -> None:
    """Reject a description that is nested too deeply or has too many values, before functions recurse into it."""
    level: list[Any] = [manifest]
    depth = count = 0
    while level:
        depth, count = depth + 1, count + len(level)
        for what, number in (("levels of nesting in bundle.json", depth), ("values in bundle.json", count)):
            if reason := exceeds(what, number):
                raise BundleError(path, f"the bundle is too large: {reason}. {_AGAIN}")
        level = [
            item
            for value in level
            if isinstance(value, (dict, list))
            for item in (value.values() if isinstance(value, dict) else value)
        ]


def _shown(names: list[str]) -> str:
    shown = ", ".join(repr(name)[:60] for name in names[:4])
    return f"{shown}, … ({len(names)} in all)" if len(names) > 4 else shown or "nothing"


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
