"""Copies episodes into data and video files of limited size, without decoding the videos."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

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
    Feature,
    Info,
    Place,
    VideoPart,
    data_table,
    fill,
    next_place,
    tasks_table,
)
from frobs_data.stats import NAMES, Stats, vector_stats
from frobs_data.video import Muxer, Packets

PARTIAL = ".partial"
"""Folder with the files that are being written. Complete files are renamed."""

_MB = 2**20


def install(folder: Path, aside: Path, relative: str) -> None:
    """Move a complete file to its place in a data set."""
    target = folder / relative
    target.parent.mkdir(parents=True, exist_ok=True)
    os.replace(aside, target)


def write_tables(folder: Path, tables: Sequence[pa.Table], relative: str) -> None:
    """Write a Parquet file atomically, with one row group for each table."""
    aside = folder / PARTIAL / "table.parquet"
    with pq.ParquetWriter(aside, tables[0].schema, compression="snappy") as file:
        for table in tables:
            file.write_table(table)
    install(folder, aside, relative)


def episode_table(rows: Sequence[Mapping[str, Any]]) -> pa.Table:
    """Return the Arrow table of ``meta/episodes``. All statistics but counts are double."""
    names = dict.fromkeys(name for row in rows for name in row)
    columns = {}
    for name in names:
        values = [row.get(name) for row in rows]
        if name.startswith("stats/") and not name.endswith("/count"):
            values = [None if value is None else np.asarray(value, float).tolist() for value in values]
        columns[name] = values
    return pa.table({name: pa.array(values) for name, values in columns.items()})


def stats_row(stats: Mapping[str, Stats]) -> dict[str, Any]:
    """Return the statistics of features as columns of ``meta/episodes``."""
    return {f"stats/{name}/{key}": value.tolist() for name, found in stats.items() for key, value in found.items()}


def place_row(key: str, place: Place) -> dict[str, Any]:
    """Return the place of a file as columns of ``meta/episodes``."""
    return {f"{key}/chunk_index": place[0], f"{key}/file_index": place[1]}


def video_row(camera: str, part: VideoPart) -> dict[str, Any]:
    """Return the part of a video as columns of ``meta/episodes``."""
    key = f"videos/{camera}"
    return {**place_row(key, part.place), f"{key}/from_timestamp": part.start, f"{key}/to_timestamp": part.end}


def row_stats(row: Mapping[str, Any], features: Mapping[str, Feature]) -> dict[str, Stats]:
    """Return the statistics in a row of ``meta/episodes``, of the features for which they are complete."""
    found: dict[str, Stats] = {}
    for name, feature in features.items():
        try:
            stats = {key: np.asarray(row[f"stats/{name}/{key}"], float) for key in NAMES}
        except (KeyError, TypeError, ValueError):
            continue
        shape = (3, 1, 1) if feature.is_video else feature.shape
        shapes = all(value.shape == ((1,) if key == "count" else shape) for key, value in stats.items())
        if shapes and stats["count"][0] > 0 and all(np.isfinite(value).all() for value in stats.values()):
            found[name] = {**stats, "count": stats["count"].astype(np.int64)}
    return found


def write_start_state(folder: Path, index: int, state: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Write the state of the simulation at the start of an episode."""
    aside = folder / PARTIAL / "start.npz"
    np.savez(aside, **state)  # type: ignore[arg-type]
    install(folder, aside, START_PATH.format(index))


def write_summary(folder: Path, info: Info, tasks: Sequence[str], stats: Mapping[str, Stats]) -> None:
    """Write ``tasks.parquet``, ``stats.json`` and ``info.json``. The last of them makes new episodes visible."""
    write_tables(folder, [tasks_table(tasks)], "meta/tasks.parquet")
    for name, value in {"stats": stats, "info": info.to_json(len(tasks))}.items():
        aside = folder / PARTIAL / f"{name}.json"
        aside.write_text(to_json(value, indent=4), encoding="utf-8")
        install(folder, aside, f"meta/{name}.json")


class Joiner:
    """Appends episodes of data sets to a data set. Nothing is visible in the data set before :meth:`commit`.

    Args:
        folder: Folder of the data set.
        info: Its features and size limits.
        tasks: Sentences of its tasks. New ones are appended.
        present: Episodes that the data set contains already.
    """

    def __init__(self, folder: Path, info: Info, tasks: list[str], present: Sequence[Episode] = ()) -> None:
        self._folder, self._info, self._tasks = folder, info, tasks
        self._data_limit, self._video_limit = (size * _MB for size in info.sizes)
        self._data_place = _free_place(episode.place for episode in present)
        self._listed = _free_place(episode.listed for episode in present)
        self._video_places = {
            camera: _free_place(episode.videos[camera].place for episode in present) for camera in info.cameras
        }
        self._data: pq.ParquetWriter | None = None
        self._videos: dict[str, Muxer] = {}
        self._complete: dict[str, Path] = {}
        self.rows: list[dict[str, Any]] = []

    def add(self, source: Dataset, episodes: Sequence[int], index: int, first: int) -> int:
        """Copy episodes.

        Args:
            source: Data set that contains the episodes.
            episodes: Numbers of the episodes.
            index: Number of the first of them in the new data set.
            first: Number of its first frame in the new data set.

        Returns:
            Number of the frame after the last.
        """
        names = [name for name, feature in source.features.items() if not feature.is_video]
        self._tasks += [task for task in source.tasks if task not in self._tasks]
        task_indices = np.array([self._tasks.index(task) for task in source.tasks])
        rows = iter(source.rows(episodes))
        for episode, part in source.iter_columns(names, episodes):
            if not 0 <= part["task_index"].min() <= part["task_index"].max() < len(task_indices):
                raise DataError(source.folder, f"episode {episode.index} has a task_index without a sentence.")
            part["task_index"] = task_indices[part["task_index"]]
            part["episode_index"] = np.full(episode.length, index)
            part["index"] = np.arange(first, first + episode.length)
            self._add_episode(source, episode, part, next(rows))
            index, first = index + 1, first + episode.length
        return first

    def commit(self) -> None:
        """Complete the files, and move them to their places. The metadata comes last."""
        if not self.rows:
            return
        self._close_data()
        for camera in self._info.cameras:
            self._close_video(camera)
        for relative, aside in self._complete.items():
            install(self._folder, aside, relative)
        write_tables(self._folder, [episode_table(self.rows)], fill(EPISODES_PATH, self._listed))

    def _add_episode(
        self, source: Dataset, episode: Episode, columns: dict[str, np.ndarray[Any, Any]], row: Mapping[str, Any]
    ) -> None:
        first = int(columns["index"][0])
        kept: dict[str, Any] = {"episode_index": int(columns["episode_index"][0]), "tasks": list(episode.tasks)}
        kept |= {"length": episode.length, "dataset_from_index": first, "dataset_to_index": first + episode.length}
        kept |= stats_row(row_stats(row, self._info.features))
        kept |= stats_row(vector_stats({name: columns[name] for name in ("task_index", "episode_index", "index")}))
        table = data_table(self._info.features, columns)
        if self._data and self._aside("data").stat().st_size + table.nbytes > self._data_limit:
            self._close_data()
        if self._data is None:
            self._data = pq.ParquetWriter(self._aside("data"), table.schema, compression="snappy")
        self._data.write_table(table)
        kept |= place_row("data", self._data_place)
        for camera in self._info.cameras:
            part = episode.videos[camera]
            packets = Packets(source.video_path(camera, part.place), part, source.fps)
            kept |= self._add_video(camera, packets, episode.length)
        self.rows.append(kept | place_row("meta/episodes", self._listed))

    def _add_video(self, camera: str, packets: Packets, length: int) -> dict[str, Any]:
        muxer = self._videos.get(camera)
        if muxer and (muxer.kind != packets.kind or muxer.size + packets.size > self._video_limit):
            self._close_video(camera)
        if camera not in self._videos:
            self._videos[camera] = Muxer(self._aside(camera), packets, self._info.fps)
        start, end = self._videos[camera].add(packets, length)
        return video_row(camera, VideoPart(self._video_places[camera], start, end))

    def _close_data(self) -> None:
        if self._data:
            self._data.close()
            self._data = None
            self._complete[fill(DATA_PATH, self._data_place)] = self._aside("data")
            self._data_place = next_place(self._data_place)

    def _close_video(self, camera: str) -> None:
        if camera in self._videos:
            self._videos.pop(camera).close()
            place = self._video_places[camera]
            self._complete[fill(VIDEO_PATH, place, camera)] = self._aside(camera)
            self._video_places[camera] = next_place(place)

    def _aside(self, kind: str) -> Path:
        """Return the temporary path of the current data file, or of the current video of a camera."""
        place = self._video_places.get(kind, self._data_place)
        suffix = "mp4" if kind in self._video_places else "parquet"
        number = self._info.cameras.index(kind) if kind in self._video_places else "data"
        return self._folder / PARTIAL / f"join-{number}-{place[0]}-{place[1]}.{suffix}"


def _free_place(places: Iterable[Place]) -> Place:
    """Return the first place after those of joined files."""
    joined = [place for place in places if place[0] < RECORDING_CHUNK]
    return next_place(max(joined)) if joined else (0, 0)


def remove_leftovers(dataset: Dataset) -> None:
    """Delete files that belong to no episode: parts of interrupted recordings, and those that were joined."""
    folder = dataset.folder
    shutil.rmtree(folder / PARTIAL, ignore_errors=True)
    kept = {fill(EPISODES_PATH, episode.listed) for episode in dataset.episodes}
    kept |= {fill(DATA_PATH, episode.place) for episode in dataset.episodes}
    kept |= {START_PATH.format(episode.index) for episode in dataset.episodes}
    for episode in dataset.episodes:
        kept |= {fill(VIDEO_PATH, part.place, camera) for camera, part in episode.videos.items()}
    for pattern in ("meta/episodes/*/*.parquet", "data/*/*.parquet", "videos/**/*.mp4", "meta/frobs/start/*.npz"):
        for path in folder.glob(pattern):
            if path.relative_to(folder).as_posix() not in kept:
                path.unlink()
    for chunk in [*folder.glob("data/*"), *folder.glob("videos/**/chunk-*"), *folder.glob("meta/episodes/*")]:
        with suppress(OSError):  # it is not empty
            chunk.rmdir()
