"""Reads and writes state as tensors, plain arrays and JSON, so that files cannot execute code."""

from __future__ import annotations

import io
import os
import pickle
import shutil
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import torch as th

from frobs_core.util import files
from frobs_core.util.errors import CheckpointError, NonFiniteValueError, UntrustedFileError
from frobs_core.util.plain import read_numbers, spell_numbers, to_json

__all__ = [
    "check_networks",
    "link",
    "matching",
    "read_arrays",
    "read_json",
    "read_networks",
    "read_saved",
    "read_tensors",
    "write_arrays",
    "write_json",
    "write_networks",
    "write_tensors",
]


def write_json(path: Path, value: Any) -> None:
    """Write a value as JSON. Infinite bounds and settings are kept."""
    path.write_text(to_json(spell_numbers(value), indent=2) + "\n", encoding="utf-8")


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object, or raise CheckpointError."""
    try:
        return dict(read_numbers(files.read_json(path)))
    except OSError as error:
        raise CheckpointError(f"{path} cannot be read: {error.strerror}.") from error


def read_saved(folder: Path, algorithm: str, format: int) -> dict[str, Any]:
    """Read the ``algorithm.json`` of a saved algorithm.

    Raises:
        CheckpointError: The file is missing or damaged, or another algorithm or format wrote it.
    """
    saved = read_json(folder / "algorithm.json")
    if saved.get("format") != format or saved.get("algorithm") != algorithm:
        raise CheckpointError(
            f"{folder} was saved by algorithm '{saved.get('algorithm')}' in format {saved.get('format')}; "
            f"expected algorithm '{algorithm}' in format {format}."
        )
    return saved


def link(source: Path, target: Path) -> bool:
    """Create ``target`` as a hard link to ``source`` or as a copy, and return whether the operation succeeded."""
    try:
        os.link(source, target)
    except OSError:
        try:
            shutil.copyfile(source, target)
        except FileNotFoundError:
            return False
    return True


def write_tensors(path: Path, value: Any) -> None:
    """Write nested dictionaries of tensors and numbers.

    The data is serialized in memory first, because PyTorch does not report errors if the disk is full.
    """
    buffer = io.BytesIO()
    th.save(value, buffer)
    path.write_bytes(buffer.getbuffer())


def read_tensors(path: Path) -> Any:
    """Read tensors from a file.

    UntrustedFileError is raised if the file contains other objects, and CheckpointError if the file is damaged.
    """
    data = _read_zip(path)
    try:
        return th.load(io.BytesIO(data), map_location="cpu", weights_only=True)
    except pickle.UnpicklingError as error:
        raise UntrustedFileError(
            path, "the file contains objects that can only be created by executing code"
        ) from error
    except (RuntimeError, EOFError, KeyError, ValueError) as error:
        raise CheckpointError(f"{path} is damaged: {error}.") from error


def check_networks(source: Path | str, weights: Mapping[str, Any]) -> None:
    """Check that all weights, given as arrays or tensors by name, are finite.

    Args:
        source: File of the networks, or the algorithm, for the error message.
        weights: The weights.

    Raises:
        NonFiniteValueError: A weight is not finite.
    """
    for name, value in weights.items():
        array = value.detach().cpu().numpy() if isinstance(value, th.Tensor) else np.asarray(value)
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            raise NonFiniteValueError(
                str(source),
                f"contains a network that has diverged: the weight '{name}' is not finite",
                "train again, for example with a lower learning_rate or with normalized observations and rewards",
            )


@contextmanager
def matching(path: Path) -> Iterator[None]:
    """Convert errors about contents that do not match the settings, such as tensors of other shapes.

    Raises:
        CheckpointError: An error occurred.
    """
    try:
        yield
    except (KeyError, RuntimeError, TypeError, ValueError) as error:
        raise CheckpointError(f"{path} does not match the settings in the same folder: {error}.") from error


def write_networks(path: Path, owner: str, weights: Mapping[str, Any]) -> None:
    """Write weights by name, as tensors or, if the path ends in ``.npz``, as arrays.

    Args:
        path: Path of the file.
        owner: Name of the algorithm, for the error message.
        weights: The weights, as tensors or arrays.

    Raises:
        NonFiniteValueError: A weight is not finite.
    """
    check_networks(owner, weights)
    if path.suffix == ".npz":
        write_arrays(path, {name: np.asarray(value) for name, value in weights.items()})
    else:
        write_tensors(path, weights)


def read_networks(path: Path) -> dict[str, th.Tensor]:
    """Read weights that :func:`write_networks` wrote.

    Raises:
        CheckpointError: The file is missing or damaged.
        UntrustedFileError: The file contains objects other than tensors and arrays.
        NonFiniteValueError: A weight is not finite.
    """
    if path.suffix == ".npz":
        weights = {name: th.from_numpy(array) for name, array in read_arrays(path).items()}
    else:
        weights = dict(read_tensors(path))
    check_networks(path, weights)
    return weights


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Write arrays by name."""
    with path.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def read_arrays(path: Path) -> dict[str, np.ndarray[Any, Any]]:
    """Read arrays from a file.

    UntrustedFileError is raised if the file contains Python objects, and CheckpointError if the file is damaged.
    """
    data = _read_zip(path)
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except ValueError as error:
        if "allow_pickle" in str(error):
            raise UntrustedFileError(path, "the file contains arrays of Python objects") from error
        raise CheckpointError(f"{path} is damaged: {error}.") from error
    except (OSError, EOFError, KeyError, zipfile.BadZipFile) as error:
        raise CheckpointError(f"{path} is damaged: {error}.") from error


def _read_zip(path: Path) -> bytes:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise CheckpointError(f"{path} cannot be read: {error.strerror}.") from error
    if not zipfile.is_zipfile(io.BytesIO(data)):
        raise CheckpointError(f"{path} is damaged: it is not a zip archive.")
    return data
