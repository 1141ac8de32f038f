"""Copies episodes into data and video files of limited size, without decoding the videos."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from frobs_core.util.arrays import Floats
from frobs_core.util.plain import to_json
from frobs_data.dataset import Dataset
from frobs_data.errors import DataError
from frobs_data.layout import (
    DATA_PATH,
    EPISODES_PATH,
    RECORDING_CHUNK,
    START_PATH,
    VIDEO_PATH,
    Episode,
    Info,
    Place,
    VideoPart,
    data_table,
    fill,
    next_place,
    tasks_table,
)
from frobs_data.stats import spans, stats_columns, stats_json, vector_stats
from frobs_data.video import Muxer, Packets

PARTIAL = ".partial"
"""Folder with the files that are being written. Complete files are renamed."""

_MB, _DATA = 2**20, ""  # no camera has an empty name
_RENUMBERED = ("task_index", "episode_index", "index")


def install(folder: Path, aside: Path, relative: str) -> None:
    """Move a complete file to its place in a data set."""
    target = folder / relative
    target.parent.mkdir(parents=True, exist_ok=True)
    os.replace(aside, target)


def open_parquet(aside: Path, schema: pa.Schema) -> pq.ParquetWriter:
    """Open a Parquet file for writing. Dictionaries and bounds only cost time for numbers that rarely repeat."""
    integers = [field.name for field in schema if pa.types.is_integer(field.type) or pa.types.is_boolean(field.type)]
    statistics = ["episode_index"] if "episode_index" in schema.names else False
    return pq.ParquetWriter(
        aside, schema, compression="snappy", use_dictionary=integers or False, write_statistics=statistics
    )


def write_table(folder: Path, table: pa.Table, relative: str) -> None:
    """Write a Parquet file atomically."""
    aside = folder / PARTIAL / "table.parquet"
    with open_parquet(aside, table.schema) as file:
        file.write_table(table)
    install(folder, aside, relative)


def write_episodes(folder: Path, info: Info, episodes: Sequence[Episode], first: int, stats: Floats) -> None:
    """Write a file of ``meta/episodes``.

    Args:
        folder: Folder of the data set.
        info: Its features.
        episodes: Successive episodes that the file lists.
        first: Number of the first frame.
        stats: Their statistics, (n, 10, k).
    """
    ends = first + np.cumsum([episode.length for episode in episodes])
    columns: dict[str, Any] = {
        "episode_index": [episode.index for episode in episodes],
        "tasks": [list(episode.tasks) for episode in episodes],
        "length": [episode.length for episode in episodes],
        **_place_columns("data", [episode.place for episode in episodes]),
        "dataset_from_index": [first, *ends[:-1]],
        "dataset_to_index": ends,
        **_place_columns("meta/episodes", [episode.listed for episode in episodes]),
    }
    for camera in info.cameras:
        parts = [episode.videos[camera] for episode in episodes]
        columns |= _place_columns(f"videos/{camera}", [part.place for part in parts])
        columns[f"videos/{camera}/from_timestamp"] = [part.start for part in parts]
        columns[f"videos/{camera}/to_timestamp"] = [part.end for part in parts]
    table = pa.table({**columns, **stats_columns(info.features, stats)})
    write_table(folder, table, fill(EPISODES_PATH, episodes[0].listed))


def _place_columns(key: str, places: Sequence[Place]) -> dict[str, Any]:
    chunks, files = zip(*places, strict=True)
    return {f"{key}/chunk_index": chunks, f"{key}/file_index": files}


def write_start_state(folder: Path, index: int, state: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Write the state of the simulation at the start of an episode, as one structured array."""
    packed = np.empty((), [(name, values.dtype, values.shape) for name, values in state.items()])
    for name, values in state.items():
        packed[name] = values
    aside = folder / PARTIAL / "start.npy"
    np.save(aside, packed)
    install(folder, aside, START_PATH.format(index))


def write_summary(folder: Path, info: Info, tasks: Sequence[str], stats: Floats | None) -> None:
    """Write ``tasks.parquet``, ``stats.json`` and ``info.json``. The last of them makes new episodes visible."""
    write_table(folder, tasks_table(tasks), "meta/tasks.parquet")
    merged = {} if stats is None else stats_json(info.features, stats)
    for name, value in {"stats": merged, "info": info.to_json(len(tasks))}.items():
        aside = folder / PARTIAL / f"{name}.json"
        aside.write_text(to_json(value, indent=4), encoding="utf-8")
        install(folder, aside, f"meta/{name}.json")


class Joiner:
    """Appends episodes of data sets to a data set. Nothing is visible in the data set before :meth:`commit`.

    Args:
        folder: Folder of the data set.
        info: Its features and size limits.
        tasks: Sentences of its tasks. New ones are appended.
        present: Episodes before those that are appended.

    Attributes:
        episodes: Appended episodes.
        frames: Number of frames of the data set, with those that are appended.
        stats: Statistics of the appended episodes: arrays (n, 10, k), to be concatenated.
    """

    def __init__(self, folder: Path, info: Info, tasks: list[str], present: Sequence[Episode] = ()) -> None:
        self._folder, self._info, self._tasks = folder, info, tasks
        self._index, self._first = len(present), sum(episode.length for episode in present)
        self._listed = _free_place([episode.listed for episode in present])
        self._places = {_DATA: _free_place([episode.place for episode in present])}
        for camera in info.cameras:
            self._places[camera] = _free_place([episode.videos[camera].place for episode in present])
        self._data_limit, self._video_limit = (size * _MB for size in info.sizes)
        self._files: dict[str, Any] = {}
        self._asides: dict[str, Path] = {}
        self._data_bytes = 0
        self.episodes: list[Episode] = []
        self.frames, self.stats = self._first, list[Floats]()

    def add(self, source: Dataset, episodes: Sequence[int]) -> None:
        """Copy the episodes with these numbers.

        Raises:
            DataError: The source is damaged.
        """
        names = [name for name, feature in source.features.items() if not feature.is_video]
        self._tasks += [task for task in source.tasks if task not in self._tasks]
        task_indices = np.array([self._tasks.index(task) for task in source.tasks])
        columns_of = spans(self._info.features)
        for group, columns in source.iter_files(names, episodes):
            lengths, index = [episode.length for episode in group], self._index + len(self.episodes)
            if not 0 <= columns["task_index"].min() <= columns["task_index"].max() < len(task_indices):
                raise DataError(source.data_path(group[0].place), "an episode has a task_index without a sentence.")
            columns["task_index"] = task_indices[columns["task_index"]]
            columns["episode_index"] = np.repeat(np.arange(index, index + len(group)), lengths)
            columns["index"] = np.arange(self.frames, self.frames + sum(lengths))
            stats = source.stats(group, self._info.features)
            numbers = np.stack([columns[name] for name in _RENUMBERED], axis=1, dtype=np.float64)
            for row, part in enumerate(np.split(numbers, np.cumsum(lengths)[:-1])):
                for name, values in zip(_RENUMBERED, vector_stats(part).T, strict=True):
                    stats[row, :, columns_of[name].start] = values
            self.stats.append(stats)
            self._add_rows(source, group, data_table(self._info.features, columns))
            self.frames += sum(lengths)

    def commit(self) -> None:
        """Complete the files, and move them to their places. The metadata comes last."""
        if self.episodes:
            for kind in list(self._files):
                self._close(kind)
            for relative, aside in self._asides.items():
                install(self._folder, aside, relative)
            write_episodes(self._folder, self._info, self.episodes, self._first, np.concatenate(self.stats))

    def _add_rows(self, source: Dataset, group: Sequence[Episode], table: pa.Table) -> None:
        """Write the rows of episodes from one file, and begin a new file before an episode that does not fit."""
        begin = end = 0
        for episode in group:
            size = table.nbytes * episode.length // len(table)
            if self._data_bytes and self._data_bytes + size > self._data_limit:
                self._write_rows(table.slice(begin, end - begin))
                self._close(_DATA)
                begin, self._data_bytes = end, 0
            end, self._data_bytes = end + episode.length, self._data_bytes + size
            videos = {camera: self._add_video(source, episode, camera) for camera in self._info.cameras}
            index = self._index + len(self.episodes)
            self.episodes.append(
                Episode(index, episode.length, episode.tasks, self._places[_DATA], videos, self._listed)
            )
        self._write_rows(table.slice(begin))

    def _write_rows(self, table: pa.Table) -> None:
        if len(table):
            self._file(_DATA, lambda aside: open_parquet(aside, table.schema)).write_table(table)

    def _add_video(self, source: Dataset, episode: Episode, camera: str) -> VideoPart:
        part = episode.videos[camera]
        packets = Packets(source.video_path(camera, part.place), part, source.fps)
        muxer = self._files.get(camera)
        if muxer and not muxer.fits(packets, self._video_limit):
            self._close(camera)
        muxer = self._file(camera, lambda aside: Muxer(aside, packets, self._info.fps))
        return VideoPart(self._places[camera], *muxer.add(packets, episode.length))

    def _file(self, kind: str, make: Callable[[Path], Any]) -> Any:
        """Return the current data file, or the current video of a camera. Open a new one if there is none."""
        if kind not in self._files:
            aside = self._folder / PARTIAL / f"join-{len(self._asides)}{'.mp4' if kind else '.parquet'}"
            self._files[kind] = make(aside)
            self._asides[fill(VIDEO_PATH if kind else DATA_PATH, self._places[kind], kind)] = aside
        return self._files[kind]

    def _close(self, kind: str) -> None:
        if file := self._files.pop(kind, None):
            file.close()
            self._places[kind] = next_place(self._places[kind])


def _free_place(places: Sequence[Place]) -> Place:
    """Return the first place after those of joined files."""
    joined = [place for place in places if place[0] < RECORDING_CHUNK]
    return next_place(max(joined)) if joined else (0, 0)


def remove_leftovers(dataset: Dataset) -> None:
    """Delete files that belong to no episode: parts of interrupted recordings, and those that were joined."""
    folder = dataset.folder
    shutil.rmtree(folder / PARTIAL, ignore_errors=True)
    kept = set()
    for episode in dataset.episodes:
        kept |= {fill(EPISODES_PATH, episode.listed), fill(DATA_PATH, episode.place), START_PATH.format(episode.index)}
        kept |= {fill(VIDEO_PATH, part.place, camera) for camera, part in episode.videos.items()}
    for pattern in ("meta/episodes/*/*.parquet", "data/*/*.parquet", "videos/**/*.mp4", "meta/frobs/start/*.npy"):
        for path in folder.glob(pattern):
            if path.relative_to(folder).as_posix() not in kept:
                path.unlink()
    for chunk in [*folder.glob("data/*"), *folder.glob("videos/**/chunk-*"), *folder.glob("meta/episodes/*")]:
        with suppress(OSError):  # it is not empty
            chunk.rmdir()
