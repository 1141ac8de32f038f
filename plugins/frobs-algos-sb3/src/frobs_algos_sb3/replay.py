"""Replay buffers on disk, stored in blocks so that unchanged blocks need not be written again."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3 import HerReplayBuffer
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.vec_env import VecNormalize

from frobs_algos import storage
from frobs_core.util.errors import CheckpointError

BLOCK_STEPS = 16_384
"""Steps per block, over all environments."""

BLOCK_BYTES = 2**25
"""Maximum size of a block [bytes], which applies if steps are large, for example because they contain images."""

Arrays = dict[str, np.ndarray[Any, Any]]


def write(buffer: ReplayBuffer, folder: Path, previous: Path | None = None) -> None:
    """Write a replay buffer into a new folder: ``index.json`` and one file per block.

    Blocks that have not changed since ``previous`` become hard links, or copies if the file system does not support
    links.
    """
    folder.mkdir()
    arrays = buffer_arrays(buffer)
    rows, per_block = _rows(buffer), _rows_per_block(arrays)
    known = {} if previous is None else _known_blocks(previous)
    digests = []
    for index, first in enumerate(range(0, rows, per_block)):
        block = {name: array[first : min(first + per_block, rows)] for name, array in arrays.items()}
        digests.append(_digest(block))
        target = folder / _name(index)
        if previous is None or known.get(index) != digests[-1] or not storage.link(previous / _name(index), target):
            storage.write_arrays(target, block)
    index_file: dict[str, Any] = {
        "pos": buffer.pos,
        "full": buffer.full,
        "rows": rows,
        "rows_per_block": per_block,
        "blocks": digests,
    }
    if isinstance(buffer, HerReplayBuffer):
        index_file["current_ep_start"] = buffer._current_ep_start.tolist()
    storage.write_json(folder / "index.json", index_file)


def read(buffer: ReplayBuffer, folder: Path) -> None:
    """Fill a replay buffer block by block, or raise CheckpointError if a file is damaged or does not match."""
    index_file = storage.read_json(folder / "index.json")
    arrays = buffer_arrays(buffer)
    try:
        rows, per_block = int(index_file["rows"]), int(index_file["rows_per_block"])
        for index, digest in enumerate(index_file["blocks"]):
            first = index * per_block
            path = folder / _name(index)
            block = storage.read_arrays(path)
            if _digest(block) != digest:
                raise CheckpointError(f"{path} is damaged: its content has changed since it was written.")
            for name, array in arrays.items():
                array[first : min(first + per_block, rows)] = block[name]
        buffer.pos, buffer.full = int(index_file["pos"]), bool(index_file["full"])
        if isinstance(buffer, HerReplayBuffer):
            buffer._current_ep_start[:] = index_file["current_ep_start"]
    except (KeyError, TypeError, ValueError) as error:
        raise CheckpointError(f"{folder} does not match the replay buffer in the settings: {error}.") from error


def row_count(folder: Path) -> int:
    """Return the number of rows that :func:`write` has written into a folder, for a buffer of a single environment."""
    try:
        index_file = storage.read_json(folder / "index.json")
        rows = int(index_file["rows"])
        if not 0 < rows <= len(index_file["blocks"]) * BLOCK_STEPS:
            raise ValueError(f"its blocks cannot have {rows} rows")
        return rows
    except (KeyError, TypeError, ValueError) as error:
        raise CheckpointError(f"{folder / 'index.json'} is damaged: {error}.") from error


def fill(buffer: ReplayBuffer, columns: Mapping[str, Any]) -> None:
    """Fill a buffer of a single environment."""
    arrays = buffer_arrays(buffer)
    for name, column in columns.items():
        parts = {f"{name}/{key}": part for key, part in column.items()} if isinstance(column, dict) else {name: column}
        for key, part in parts.items():
            arrays[key][:] = np.reshape(part, arrays[key].shape)
    buffer.full = True


def mix(buffer: ReplayBuffer, demonstrations: ReplayBuffer) -> None:
    """Make a buffer draw every second sample from demonstrations.

    Samples alternate, because the algorithms of sbx draw the batches of several gradient steps at once. Therefore,
    demonstrations make up half of each batch.
    """
    draw = buffer.sample

    def sample(batch_size: int, env: VecNormalize | None = None) -> Any:
        replayed = draw(batch_size - batch_size // 2, env=env)
        demonstrated = demonstrations.sample(batch_size // 2, env=env)
        return type(replayed)(*map(_alternate, replayed, demonstrated))

    buffer.sample = sample  # type: ignore[method-assign]


def _alternate(first: Any, second: Any) -> Any:
    """Return the rows of two tensors, or of dictionaries of tensors, in turn. ``first`` may have one more row."""
    if first is None:
        return None
    if isinstance(first, dict):
        return {key: _alternate(first[key], second[key]) for key in first}
    mixed = first.new_empty((len(first) + len(second), *first.shape[1:]))
    mixed[::2], mixed[1::2] = first, second
    return mixed


def buffer_arrays(buffer: ReplayBuffer) -> Arrays:
    """Return views of all arrays of a buffer, each of shape (rows, num_envs, …)."""
    arrays: Arrays = {}
    names = ["observations", "next_observations", "actions", "rewards", "dones", "timeouts"]
    if isinstance(buffer, HerReplayBuffer):
        names += ["ep_start", "ep_length"]
    for name in names:
        value = getattr(buffer, name, None)  # next observations are not stored if memory usage is optimized
        if isinstance(value, dict):
            arrays |= {f"{name}/{key}": array for key, array in value.items()}
        elif value is not None:
            arrays[name] = value
    return arrays


def _rows(buffer: ReplayBuffer) -> int:
    if buffer.full:
        return int(buffer.buffer_size)
    # With optimized memory usage, the newest observation is stored in the row of the next step.
    return int(min(buffer.pos + buffer.optimize_memory_usage, buffer.buffer_size))


def _rows_per_block(arrays: Arrays) -> int:
    bytes_per_row = sum(array.nbytes // len(array) for array in arrays.values())
    num_envs = int(arrays["rewards"].shape[1])
    return max(1, min(BLOCK_STEPS // num_envs, BLOCK_BYTES // bytes_per_row))


def _digest(block: Arrays) -> str:
    digest = hashlib.blake2b(digest_size=16)
    for name in sorted(block):
        digest.update(f"{name} {block[name].dtype.str} {block[name].shape}".encode())
        digest.update(np.ascontiguousarray(block[name]).data)
    return digest.hexdigest()


def _name(index: int) -> str:
    return f"block_{index:05d}.npz"


def _known_blocks(previous: Path) -> dict[int, str]:
    try:
        return dict(enumerate(storage.read_json(previous / "index.json")["blocks"]))
    except (CheckpointError, KeyError, TypeError):
        return {}
