from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from stable_baselines3.common.buffers import DictReplayBuffer, ReplayBuffer

from frobs_algos import storage
from frobs_algos_sb3 import replay
from frobs_core.util.errors import CheckpointError

BOX = gym.spaces.Box(-1.0, 1.0, (3,))
DICT = gym.spaces.Dict({"a": BOX, "b": gym.spaces.Box(0, 255, (2, 2), np.uint8)})
NUM_ENVS = 2


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of ten rows."""
    monkeypatch.setattr(replay, "BLOCK_STEPS", 10 * NUM_ENVS)


def make_buffer(space: gym.Space[Any] = BOX, size: int = 100, **kwargs: Any) -> ReplayBuffer:
    cls = DictReplayBuffer if isinstance(space, gym.spaces.Dict) else ReplayBuffer
    return cls(size * NUM_ENVS, space, BOX, "cpu", NUM_ENVS, **kwargs)


def add(buffer: ReplayBuffer, count: int) -> None:
    def observation() -> Any:
        samples = [buffer.observation_space.sample() for _ in range(NUM_ENVS)]
        if isinstance(buffer.observation_space, gym.spaces.Dict):
            return {key: np.stack([sample[key] for sample in samples]) for key in buffer.observation_space}
        return np.stack(samples)

    for _ in range(count):
        rewards, dones = np.random.default_rng(count).normal(size=NUM_ENVS), np.zeros(NUM_ENVS, bool)
        infos: list[dict[str, Any]] = [{}, {"TimeLimit.truncated": True}]
        buffer.add(observation(), observation(), np.stack([BOX.sample()] * NUM_ENVS), rewards, dones, infos)


def same(first: ReplayBuffer, second: ReplayBuffer) -> bool:
    assert (first.pos, first.full) == (second.pos, second.full)
    pairs = zip(replay.buffer_arrays(first).values(), replay.buffer_arrays(second).values(), strict=True)
    return all(np.array_equal(a, b) for a, b in pairs)


@pytest.mark.parametrize("space", [BOX, DICT], ids=["box", "dict"])
@pytest.mark.parametrize("count", [0, 7, 30, 100, 123])
def test_a_buffer_comes_back(space: gym.Space[Any], count: int, tmp_path: Path) -> None:
    buffer, other = make_buffer(space), make_buffer(space)
    add(buffer, count)
    replay.write(buffer, tmp_path / "replay")
    replay.read(other, tmp_path / "replay")
    assert same(buffer, other)


@pytest.mark.parametrize("count", [7, 30, 99, 100, 123])
def test_a_buffer_that_keeps_each_observation_once_comes_back(count: int, tmp_path: Path) -> None:
    kwargs: dict[str, Any] = {"optimize_memory_usage": True, "handle_timeout_termination": False}
    buffer, other = make_buffer(**kwargs), make_buffer(**kwargs)
    add(buffer, count)
    replay.write(buffer, tmp_path / "replay")
    replay.read(other, tmp_path / "replay")
    assert same(buffer, other)


def test_only_blocks_that_changed_are_written_again(tmp_path: Path) -> None:
    buffer, other = make_buffer(), make_buffer()
    add(buffer, 35)
    replay.write(buffer, tmp_path / "first")
    add(buffer, 10)
    replay.write(buffer, tmp_path / "second", tmp_path / "first")
    assert linked(tmp_path / "second", tmp_path / "first") == [0, 1, 2]
    add(buffer, 60)  # the buffer is full now, and begins anew
    replay.write(buffer, tmp_path / "third", tmp_path / "second")
    assert linked(tmp_path / "third", tmp_path / "second") == [1, 2, 3]
    replay.read(other, tmp_path / "third")
    assert same(buffer, other)


def linked(folder: Path, previous: Path) -> list[int]:
    return [
        index
        for index in range(len(list(folder.glob("block_*"))))
        if (previous / replay._name(index)).exists()
        and (folder / replay._name(index)).samefile(previous / replay._name(index))
    ]


def test_where_the_disk_knows_no_links_blocks_are_copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*args: Any) -> None:
        raise PermissionError("no links here")

    monkeypatch.setattr(os, "link", refuse)
    buffer, other = make_buffer(), make_buffer()
    add(buffer, 35)
    replay.write(buffer, tmp_path / "first")
    replay.write(buffer, tmp_path / "second", tmp_path / "first")
    assert linked(tmp_path / "second", tmp_path / "first") == []
    replay.read(other, tmp_path / "second")
    assert same(buffer, other)


@pytest.mark.parametrize("damage", ["index.json", "block_00001.npz"])
def test_a_previous_folder_that_lacks_something_is_no_hindrance(damage: str, tmp_path: Path) -> None:
    buffer, other = make_buffer(), make_buffer()
    add(buffer, 35)
    replay.write(buffer, tmp_path / "first")
    (tmp_path / "first" / damage).unlink()
    replay.write(buffer, tmp_path / "second", tmp_path / "first")
    replay.read(other, tmp_path / "second")
    assert same(buffer, other)


def test_steps_that_are_large_make_small_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replay, "BLOCK_BYTES", 1)
    buffer = make_buffer()
    add(buffer, 3)
    replay.write(buffer, tmp_path / "replay")
    assert len(list((tmp_path / "replay").glob("block_*"))) == 3


@pytest.mark.parametrize("name", ["index.json", "block_00001.npz"])
@pytest.mark.parametrize("damage", ["missing", "cut", "other"])
def test_a_damaged_file_of_a_buffer_is_named(name: str, damage: str, tmp_path: Path) -> None:
    buffer = make_buffer()
    add(buffer, 35)
    replay.write(buffer, tmp_path / "replay")
    path = tmp_path / "replay" / name
    if damage == "missing":
        path.unlink()
    elif damage == "cut":
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    elif name == "index.json":
        storage.write_json(path, {"rows": 3})
    else:
        path.write_bytes((tmp_path / "replay" / "block_00000.npz").read_bytes())
    with pytest.raises(CheckpointError, match="replay"):
        replay.read(make_buffer(), tmp_path / "replay")


@pytest.mark.parametrize("other", [make_buffer(size=20), make_buffer(DICT)], ids=["smaller", "dict"])
def test_a_buffer_of_another_shape_is_refused(other: ReplayBuffer, tmp_path: Path) -> None:
    buffer = make_buffer()
    add(buffer, 35)
    replay.write(buffer, tmp_path / "replay")
    with pytest.raises(CheckpointError, match="does not match the replay buffer"):
        replay.read(other, tmp_path / "replay")
