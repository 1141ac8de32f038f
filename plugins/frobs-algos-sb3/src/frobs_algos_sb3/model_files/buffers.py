"""Replay buffers as plain arrays."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.buffers import DictReplayBuffer, ReplayBuffer

from frobs_algos.storage import read_arrays, write_arrays
from frobs_algos_sb3.replay import buffer_arrays
from frobs_core.util.errors import CheckpointError, ConfigurationError, UntrustedFileError
from frobs_core.util.files import write_aside

FORMAT = 1
"""Version of the file format."""


def write_replay_buffer(buffer: ReplayBuffer, path: Path) -> None:
    """Write the filled part of a replay buffer atomically, by writing a temporary file and then renaming it.

    Raises:
        ConfigurationError: The buffer is not a plain replay buffer, or uses ``optimize_memory_usage``.
        OSError: The disk is full, or the folder cannot be written.
    """
    if type(buffer) not in (ReplayBuffer, DictReplayBuffer) or buffer.optimize_memory_usage:
        raise ConfigurationError(
            f"a {type(buffer).__name__}{' with optimize_memory_usage=True' if buffer.optimize_memory_usage else ''} "
            "cannot be saved as arrays; use ReplayBuffer or DictReplayBuffer with optimize_memory_usage=False."
        )
    size = buffer.size()
    arrays = {"format": np.array(FORMAT), "next": np.array(buffer.pos % buffer.buffer_size if buffer.full else size)}
    for name, array in buffer_arrays(buffer).items():
        arrays[name] = array[:size]
    write_aside(path, lambda aside: write_arrays(aside, arrays))


def read_replay_buffer(buffer: ReplayBuffer, path: Path) -> None:
    """Fill a model's replay buffer from a file. A buffer that is too small receives only the newest steps.

    Raises:
        CheckpointError: The file is missing or damaged, or it does not match the buffer. The buffer remains unchanged.
        UntrustedFileError: The file is a pickle or contains Python objects.
    """
    saved = _read(path)
    own = buffer_arrays(buffer)
    rows = {len(saved[name]) for name in own if name in saved}
    if set(saved) != {*own, "format", "next"} or len(rows) != 1 or int(saved["format"]) != FORMAT:
        raise CheckpointError(
            f"{path} does not match the model's replay buffer: it contains the arrays {', '.join(sorted(saved))}."
        )
    for name, array in own.items():
        if saved[name].shape[1:] != array.shape[1:] or saved[name].dtype != array.dtype:
            raise CheckpointError(
                f"{path} does not match the model: its array '{name}' contains values of the type {saved[name].dtype} "
                f"and the shape {saved[name].shape[1:]} per step; expected {array.dtype} and {array.shape[1:]}."
            )
    count, following, capacity = rows.pop(), int(saved["next"]), buffer.buffer_size
    if not 0 <= following <= count:
        raise CheckpointError(
            f"{path} is damaged: the index of the next step is {following}, but the buffer contains {count} steps."
        )
    if count <= capacity and (count == capacity or following == count):
        order, start = np.arange(count), following % capacity
    else:  # different capacity: use the newest steps that fit, oldest first
        order = (following + np.arange(count))[-capacity:] % count
        start = len(order) % capacity
    for name, array in own.items():
        array[: len(order)] = saved[name][order]
    buffer.pos, buffer.full = start, len(order) == capacity


def _read(path: Path) -> dict[str, np.ndarray[Any, Any]]:
    try:
        with path.open("rb") as file:
            if file.read(2) != b"PK":
                raise UntrustedFileError(path, "the file is a pickle, and opening a pickle can execute code in it")
            with zipfile.ZipFile(file) as archive:
                for member in archive.infolist():
                    if member.compress_type != zipfile.ZIP_STORED or member.flag_bits & 0x1:
                        raise CheckpointError(f"{path} is rejected: its array '{member.filename}' is compressed.")
    except (OSError, zipfile.BadZipFile) as error:
        raise CheckpointError(f"{path} cannot be read: {error}.") from error
    return read_arrays(path)
