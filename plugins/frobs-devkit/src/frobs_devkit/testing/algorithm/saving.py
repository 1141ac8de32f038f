"""Checks of the files that an algorithm saves."""

from __future__ import annotations

import io
import pickle
import pickletools
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np

from frobs_core.util.errors import CheckpointError, UntrustedFileError
from frobs_devkit.testing.algorithm.under_test import AlgorithmUnderTest
from frobs_devkit.testing.checks import expect, expect_raises
from frobs_devkit.testing.compare import expect_same

_SAFE_MODULES = ("torch", "collections", "_codecs", "numpy")


def load_equals_save(subject: AlgorithmUnderTest) -> None:
    """A saved algorithm predicts the same actions when it is loaded, with and without an environment."""
    algorithm = subject.trained[0]
    with tempfile.TemporaryDirectory() as folder:
        algorithm.save(Path(folder))
        expected, load = subject.predictions(algorithm), type(algorithm).load
        expect_same(expected, subject.predictions(load(Path(folder))), "predictions of the loaded algorithm")
        with closing(subject.make_env()) as env:
            expect_same(expected, subject.predictions(load(Path(folder), env)), "predictions loaded with an env")


def files_execute_nothing(subject: AlgorithmUnderTest) -> None:
    """Saved files contain only tensors and plain values, so opening them creates no arbitrary Python objects."""
    with tempfile.TemporaryDirectory() as folder:
        subject.trained[0].save(Path(folder))
        files = [path for path in sorted(Path(folder).rglob("*")) if path.is_file()]
        expect(files, "save() wrote no file.")
        for path in files:
            for name, content in _contents(path):
                builds = _what_a_pickle_builds(content)
                expect(
                    not builds,
                    f"the saved file {name} is a pickle that imports {', '.join(sorted(builds)[:5])}; save only "
                    "tensors and JSON.",
                )
                expect(b'":serialized:"' not in content, f"{name} contains a serialized Python object.")
                expect(
                    not _holds_objects(content),
                    f"the saved file {name} is an array of Python objects, which NumPy stores as a pickle; save only "
                    "arrays of numbers.",
                )


def missing_files_are_told(subject: AlgorithmUnderTest) -> None:
    """Loading a checkpoint with a missing or damaged file raises CheckpointError or UntrustedFileError."""
    algorithm = subject.untrained
    with tempfile.TemporaryDirectory() as folder, closing(subject.make_env()) as env:
        algorithm.save(Path(folder))
        files = [path for path in Path(folder).rglob("*") if path.is_file()]
        largest = max(files, key=lambda path: path.stat().st_size)
        for damage in ("is cut in half", "is missing"):
            if damage == "is missing":
                largest.unlink()
            else:
                largest.write_bytes(largest.read_bytes()[: largest.stat().st_size // 2])
            with expect_raises((CheckpointError, UntrustedFileError), f"load() where {largest.name} {damage}"):
                type(algorithm).load(Path(folder), env)


def _contents(path: Path) -> Iterator[tuple[str, bytes]]:
    """Yield the name and content of a file, or of each file in a ZIP archive."""
    data = path.read_bytes()
    if not zipfile.is_zipfile(io.BytesIO(data)):
        yield path.name, data
        return
    with zipfile.ZipFile(io.BytesIO(data)) as packed:
        for name in packed.namelist():
            yield f"{path.name}:{name}", packed.read(name)


def _holds_objects(content: bytes) -> bool:
    if not content.startswith(np.lib.format.MAGIC_PREFIX):
        return False
    try:
        np.load(io.BytesIO(content), allow_pickle=False)
    except ValueError:
        return True
    return False


def _what_a_pickle_builds(content: bytes) -> set[str]:
    """Return the names that a pickle imports from unsafe modules, or an empty set if the content is not a pickle."""
    if content[:1] != pickle.PROTO:
        return set()
    names, strings = set(), []
    try:
        for opcode, argument, _ in pickletools.genops(content):
            if opcode.name in ("SHORT_BINUNICODE", "BINUNICODE", "UNICODE"):
                strings.append(str(argument))
            elif opcode.name == "GLOBAL":
                names.add(str(argument).replace(" ", "."))
            elif opcode.name == "STACK_GLOBAL":
                names.add(".".join(strings[-2:]))
    except ValueError:
        return set()
    return {name for name in names if name.split(".")[0] not in _SAFE_MODULES}
