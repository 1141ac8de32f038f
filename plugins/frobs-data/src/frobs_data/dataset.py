"""Reads LeRobotDataset v3.0 folders."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import check_name
from frobs_core.util.files import check_regular, read_json
from frobs_data.budgets import BUDGET
from frobs_data.errors import DataError
from frobs_data.layout import (
    EPISODES_PATH,
    INDEX,
    SETTINGS_PATH,
    START_PATH,
    Episode,
    Feature,
    Place,
    VideoPart,
    fill,
    read_info,
    read_whole,
)
from frobs_data.stats import NAMES, shape_of, table_stats
from frobs_data.tables import column_array, damaged, read_table, text_lists
from frobs_data.video import decode

_METADATA = "bytes of a metadata file, decompressed"


class Dataset:
    """A data set in a LeRobotDataset v3.0 folder. Frames and pictures are read when they are requested.

    Args:
        folder: The folder, which contains ``meta/info.json``.

    Attributes:
        folder: The folder.
        fps: Frames per second [1/s].
        robot_type: Name of the robot, or None.
        features: Columns and cameras by name.
        tasks: Sentences that describe the tasks, by task index.
        episodes: Episodes in order.
        settings: What ``frobs record`` stored about the environment, or None for data sets of other programs.

    Raises:
        DataError: A file is missing or damaged, contradicts another file, or exceeds a limit.
    """

    def __init__(self, folder: Path | str) -> None:
        self.folder = Path(folder)
        self.info = read_info(self.folder)
        self.fps, self.robot_type = self.info.fps, self.info.robot_type
        self.features: Mapping[str, Feature] = self.info.features
        self.tasks: Sequence[str] = self._read_tasks()
        self.episodes: Sequence[Episode] = self._read_episodes()
        self.settings: Mapping[str, Any] | None = self._read_settings()
        self._check_files()

    def __len__(self) -> int:
        """Return the number of frames."""
        return self.info.frames

    def data_path(self, place: Place) -> Path:
        """Return the path of a data file."""
        return self.folder / fill(self.info.data_path, place)

    def video_path(self, key: str, place: Place) -> Path:
        """Return the path of a video of the camera ``key``."""
        return self.folder / fill(self.info.video_path, place, key)

    def columns(self, names: Sequence[str], episodes: Sequence[int] | None = None) -> dict[str, np.ndarray[Any, Any]]:
        """Read columns.

        Args:
            names: Features that are columns of numbers.
            episodes: Numbers of the episodes, or None for all.

        Returns:
            One array per name, (frames, …) with the dtype of the feature, or (frames,) for the shape ``(1,)``. The
            episodes follow each other in the given order.

        Raises:
            UnknownNameError: There is no such feature.
            DataError: A file is damaged, or a feature is not numeric.
        """
        for name in names:
            if not self.features[check_name("feature", name, self.features)].is_numeric:
                raise DataError(self.folder, f"the feature '{name}' is not a column of numbers.")
        files = list(self.iter_files(names, range(len(self.episodes)) if episodes is None else episodes))
        if not files:
            features = {name: self.features[name] for name in names}
            return {name: np.zeros((0, *feature.row_shape), feature.dtype) for name, feature in features.items()}
        return {name: np.concatenate([columns[name] for _, columns in files]) for name in names}

    def iter_files(
        self, names: Sequence[str], episodes: Sequence[int]
    ) -> Iterator[tuple[list[Episode], dict[str, np.ndarray[Any, Any]]]]:
        """Yield successive episodes that are in the same file, with their part of :meth:`columns`.

        For the arguments, see :meth:`columns`.
        """
        for place, group in groupby((self.episodes[index] for index in episodes), key=lambda episode: episode.place):
            chosen = list(group)
            yield chosen, self._read_file(place, chosen, names)

    def pictures(self, episode: int, key: str) -> np.ndarray[Any, Any]:
        """Return the pictures of the camera ``key`` in one episode, (length, height, width, 3) uint8.

        Raises:
            UnknownNameError: There is no such camera.
            DataError: The video is damaged, or the pictures would need too much memory.
        """
        check_name("camera", key, self.info.cameras)
        shape = (self.episodes[episode].length, *self.features[key].shape)
        limit = BUDGET["bytes of decoded pictures in memory"]
        if math.prod(shape) > limit:
            raise DataError(self.folder, f"the pictures of episode {episode} need more than {limit:,} bytes of memory.")
        pictures = np.empty(shape, np.uint8)
        for row, picture in zip(pictures, self.iter_pictures(episode, key), strict=True):
            row[:] = picture
        return pictures

    def iter_pictures(self, episode: int, key: str) -> Iterator[np.ndarray[Any, Any]]:
        """Yield the pictures of the camera ``key`` in one ``episode``, (height, width, 3) uint8 each."""
        check_name("camera", key, self.info.cameras)
        found = self.episodes[episode]
        part = found.videos[key]
        return decode(self.video_path(key, part.place), part, found.length, self.fps, self.features[key])

    def start_state(self, episode: int) -> dict[str, np.ndarray[Any, Any]] | None:
        """Return the state of the simulation at the start of an episode, or None if it was not recorded.

        Raises:
            DataError: The file is damaged or too large.
        """
        path = self.folder / START_PATH.format(self.episodes[episode].index)
        try:
            check_regular(path, BUDGET["bytes of a start state"])
            # A mapped file cannot declare more data than it contains.
            packed = np.load(path, mmap_mode="r", max_header_size=100_000)
            return {name: np.array(packed[name]) for name in packed.dtype.names or ()}
        except FileNotFoundError:
            return None
        except (OSError, ValueError, RuntimeError, EOFError, MemoryError, SyntaxError, TypeError) as error:
            raise damaged(path, error) from error

    def stats(self, episodes: Sequence[Episode], features: Mapping[str, Feature]) -> Floats:
        """Return the statistics of episodes as ``meta/episodes`` lists them, see :data:`~frobs_data.stats.NAMES`.

        Args:
            episodes: The episodes.
            features: The features of the data set, in the order of the returned columns.

        Returns:
            Array (episodes, 10, k), NaN for features without valid statistics.
        """
        width = sum(math.prod(shape_of(feature)) for feature in features.values())
        if len(episodes) * len(NAMES) * width * 8 > (limit := BUDGET["bytes of a metadata file, decompressed"]):
            raise DataError(self.folder, f"the statistics of the episodes need more than {limit:,} bytes of memory.")
        found: dict[int, Floats] = {}
        for place in dict.fromkeys(episode.listed for episode in episodes):
            path = self.folder / fill(EPISODES_PATH, place)
            table = read_table(path, _METADATA, BUDGET["episodes"], _stats_names)
            found |= zip(table["episode_index"].to_pylist(), table_stats(features, table, path), strict=True)
        return np.stack([found[episode.index] for episode in episodes])

    def _read_file(
        self, place: Place, episodes: Sequence[Episode], names: Sequence[str]
    ) -> dict[str, np.ndarray[Any, Any]]:
        path = self.data_path(place)
        indices = [episode.index for episode in episodes]
        bounds = "episode_index", min(indices), max(indices)
        table = read_table(path, "bytes of a data file", BUDGET["frames"], [*names, "episode_index"], bounds)
        numbers = column_array(table["episode_index"], INDEX["episode_index"], path, "episode_index")
        if np.any(np.diff(numbers) < 0):
            raise DataError(path, "the rows are not in the order of the episodes.")
        firsts, ends = np.searchsorted(numbers, indices), np.searchsorted(numbers, indices, side="right")
        for episode, first, end in zip(episodes, firsts, ends, strict=True):
            if end - first != episode.length:
                expected = f"meta/episodes lists {episode.length:,}"
                raise DataError(path, f"episode {episode.index} has {end - first:,} rows, but {expected}.")
        arrays = {name: column_array(table[name], self.features[name], path, name) for name in names}
        rows = np.concatenate([np.arange(first, end) for first, end in zip(firsts, ends, strict=True)])
        return {name: values[rows] for name, values in arrays.items()}

    def _read_tasks(self) -> list[str]:
        path = self.folder / "meta" / "tasks.parquet"
        if self.info.episodes == 0 and not path.exists():
            return []
        table = read_table(path, _METADATA, BUDGET["tasks"], lambda names: {"task_index", *names})
        text = next((name for name in table.column_names if name != "task_index"), "task_index")
        indices = column_array(table["task_index"], INDEX["task_index"], path, "task_index").tolist()
        tasks = sorted(zip(indices, text_lists(table[text], path), strict=True))
        if any(index != number or len(texts) != 1 for number, (index, texts) in enumerate(tasks)):
            raise DataError(path, "the table must contain one sentence for each task index.")
        return [texts[0] for _, texts in tasks]

    def _read_settings(self) -> Mapping[str, Any] | None:
        path = self.folder / SETTINGS_PATH
        try:
            return read_json(path) if path.exists() else None
        except OSError as error:
            raise damaged(path, error) from error

    def _read_episodes(self) -> list[Episode]:
        """Read ``meta/episodes``. An episode that two files list was being moved to the first of them."""
        found: dict[int, Episode] = {}
        names = ["episode_index", "length", "tasks", "data/chunk_index", "data/file_index"]
        parts = ("chunk_index", "file_index", "from_timestamp", "to_timestamp")
        names += [f"videos/{camera}/{part}" for camera in self.info.cameras for part in parts]
        for path in sorted(self.folder.glob("meta/episodes/chunk-*/file-*.parquet")):
            try:
                listed = int(path.parent.name[6:]), int(path.stem[5:])
            except ValueError:
                raise DataError(path, "the file's name must be file-NNN.parquet, in a folder chunk-NNN.") from None
            table = read_table(path, _METADATA, BUDGET["episodes"], names)
            tasks = text_lists(table["tasks"], path)
            for row, sentences in zip(table.drop_columns("tasks").to_pylist(), tasks, strict=True):
                episode = self._episode(path, row, sentences, listed)
                if episode.index < self.info.episodes:
                    found.setdefault(episode.index, episode)
        episodes = [found[index] for index in range(self.info.episodes) if index in found]
        if len(episodes) != self.info.episodes:
            missing = next(index for index in range(self.info.episodes) if index not in found)
            raise DataError(self.folder / "meta" / "episodes", f"episode {missing} is not listed.")
        frames = sum(episode.length for episode in episodes)
        if frames != self.info.frames:
            reason = f"the episodes have {frames:,} frames, but info.json says {self.info.frames:,}"
            raise DataError(self.folder / "meta" / "info.json", f"{reason}.")
        return episodes

    def _episode(self, path: Path, row: Mapping[str, Any], tasks: tuple[str, ...], listed: Place) -> Episode:
        def place(key: str) -> Place:
            chunk, file = (read_whole(path, row, f"{key}/{part}_index", 0, 10**6) for part in ("chunk", "file"))
            return chunk, file

        length = read_whole(path, row, "length", 1, BUDGET["frames"])
        videos = {}
        for camera in self.info.cameras:
            name = f"videos/{camera}"
            start, end = row[f"{name}/from_timestamp"], row[f"{name}/to_timestamp"]
            if type(start) is not float or type(end) is not float or not 0 <= start < end < 1e9:
                raise DataError(path, f"the times {start!r:.30} and {end!r:.30} of '{name}' are not within a video.")
            if abs((end - start) * self.fps - length) > 1:
                raise DataError(path, f"'{name}' lasts {end - start:.3f} s, which does not fit {length:,} frames.")
            videos[camera] = VideoPart(place(name), start, end)
        index = read_whole(path, row, "episode_index", 0, BUDGET["episodes"])
        return Episode(index, length, tasks, place("data"), videos, listed)

    def _check_files(self) -> None:
        videos = {(key, part.place) for episode in self.episodes for key, part in episode.videos.items()}
        paths = {self.data_path(place): "data" for place in {episode.place for episode in self.episodes}}
        paths.update({self.video_path(key, place): "video" for key, place in videos})
        for path, kind in paths.items():
            try:
                check_regular(path, BUDGET[f"bytes of a {kind} file"])
            except OSError as error:
                raise damaged(path, error) from error


def _stats_names(names: list[str]) -> list[str]:
    return ["episode_index", *(name for name in names if name.startswith("stats/"))]
