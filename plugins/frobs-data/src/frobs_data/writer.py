"""Writes LeRobotDataset v3.0 folders, one episode at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from queue import Queue
from threading import Thread
from types import TracebackType
from typing import Any

import numpy as np
import pyarrow as pa

from frobs_core.util.errors import ParameterValueError, check_keys, check_name
from frobs_core.util.files import write_json
from frobs_data.dataset import Dataset
from frobs_data.errors import DataError
from frobs_data.joining import (
    PARTIAL,
    Joiner,
    episode_table,
    install,
    place_row,
    remove_leftovers,
    row_stats,
    stats_row,
    video_row,
    write_start_state,
    write_summary,
    write_tables,
)
from frobs_data.layout import (
    DATA_PATH,
    EPISODES_PATH,
    FILES_PER_CHUNK,
    INDEX,
    RECORDING_CHUNK,
    SETTINGS_PATH,
    VIDEO_PATH,
    Feature,
    Info,
    Place,
    VideoPart,
    data_table,
    fill,
    is_inside,
)
from frobs_data.stats import PictureStats, Stats, merge_stats, vector_stats
from frobs_data.video import CODECS, Encoder

_WAITING = 128
"""Maximum number of pictures and episodes that wait to be written. After that, callers wait."""

_BATCH = 64
"""Maximum number of episodes that share files while recording, because more of them were waiting to be written."""

_TYPES = ("float32", "float64", "int64", "int32", "uint8", "bool", "video")


class Clip:
    """Pictures of one camera during one episode. They are encoded in the background while they are added.

    Use :meth:`DatasetWriter.clip` to make one, and give it to :meth:`DatasetWriter.add` as the column of the camera.
    """

    def __init__(self, writer: DatasetWriter, key: str, path: Path, codec: str) -> None:
        self._writer, self.key, self.path, self._codec = writer, key, path, codec
        self._shape = writer.info.features[key].shape
        self._encoder: Encoder | None = None
        self.stats = PictureStats()
        self.length = 0

    def append(self, picture: np.ndarray[Any, Any]) -> None:
        """Add a picture, (height, width, 3) uint8. The array may be changed afterwards.

        Raises:
            ParameterValueError: The picture has the wrong shape or data type.
            DataError: Writing failed earlier.
        """
        if np.shape(picture) != self._shape or picture.dtype != np.uint8:
            raise ParameterValueError(self.key, np.shape(picture), f"a picture of shape {self._shape}, uint8")
        copied = np.array(picture)
        self.length += 1
        self._writer.submit(lambda: self._encode(copied))

    def discard(self) -> None:
        """Delete the pictures, because the episode is not recorded."""
        self._writer.submit(self._abort)

    def finish(self) -> None:
        """Complete the video. Only the writer's thread calls this method."""
        if self._encoder:
            self._encoder.close()
            self._encoder = None

    def _encode(self, picture: np.ndarray[Any, Any]) -> None:
        if self._encoder is None:
            self._encoder = Encoder(self.path, self._writer.info.fps, self._shape, self._codec)
        self._encoder.add(picture)
        self.stats.add(picture)

    def _abort(self) -> None:
        if self._encoder:
            self._encoder.abort()
            self._encoder = None
        self.path.unlink(missing_ok=True)


class DatasetWriter:
    """Writes a data set. After each episode, the folder is a complete data set of all whole episodes.

    One thread in the background writes the files. While recording, each episode has files of its own; :meth:`close`
    joins them. If the process is killed, the folder contains all episodes that were written, and ``append=True``
    continues it.

    Args:
        folder: Folder of the data set.
        fps: Frames per second [1/s].
        features: Columns and cameras by name, without the columns of every data set, such as ``timestamp``.
        robot_type: Name of the robot, or None.
        settings: Facts about the recording, which ``meta/frobs/settings.json`` stores. None stores no file.
        codec: Encoder of the videos: ``"libsvtav1"`` (small files) or ``"libx264"`` (fast).
        append: Whether to continue an existing data set. Otherwise, the folder must not exist or must be empty.
        data_mb: Size limit of a joined data file [MB]. A single longer episode exceeds it.
        video_mb: Size limit of a joined video file [MB].

    Attributes:
        info: Features and counts of the data set.

    Raises:
        DataError: The folder is not empty, or contains a data set with other features.
        ParameterValueError: A feature cannot be stored.
    """

    def __init__(
        self,
        folder: Path | str,
        fps: int,
        features: Mapping[str, Feature],
        robot_type: str | None = None,
        settings: Mapping[str, Any] | None = None,
        *,
        codec: str = "libsvtav1",
        append: bool = False,
        data_mb: float = 100,
        video_mb: float = 200,
    ) -> None:
        self.folder = Path(folder)
        check_name("video codec", codec, CODECS)
        for name, feature in features.items():
            _check_feature(name, feature)
        self._codec, self._append = codec, append
        codecs = {name: CODECS[codec] for name, feature in features.items() if feature.is_video}
        self.info = Info(fps, robot_type, {**features, **INDEX}, codecs=codecs, sizes=(data_mb, video_mb))
        self._tasks: list[str] = []
        self._stats: dict[str, Stats] = {}
        self._clips = 0
        self._batch: list[tuple[dict[str, Any], pa.Table, dict[str, Stats]]] = []
        self._error: Exception | None = None
        self._queue: Queue[Callable[[], object] | None] = Queue(_WAITING)
        try:
            self._open(settings)
        except OSError as error:
            raise self._failure(error) from error
        self._thread = Thread(target=self._work, name="dataset-writer", daemon=True)
        self._thread.start()

    def clip(self, key: str) -> Clip:
        """Return an empty sequence of pictures for the camera ``key``, to be filled during an episode.

        Raises:
            UnknownNameError: There is no such camera.
        """
        check_name("camera", key, self.info.cameras)
        self._clips += 1
        return Clip(self, key, self.folder / PARTIAL / f"clip-{self._clips}.mp4", self._codec)

    def add(
        self,
        columns: Mapping[str, np.ndarray[Any, Any] | Iterable[np.ndarray[Any, Any]] | Clip],
        task: str,
        start_state: Mapping[str, np.ndarray[Any, Any]] | None = None,
    ) -> None:
        """Add one whole episode. The arrays may be changed afterwards.

        Args:
            columns: Array of each feature, (n, …), or (n,) for the shape ``(1,)``. For a camera: an array, pictures one
                by one, or a :class:`Clip`.
            task: Sentence that describes the task.
            start_state: State of the simulation at the start of the episode.

        Raises:
            ParameterValueError: An array has the wrong shape, or contains numbers that are not finite.
            UnknownParameterError: A feature is missing or unknown.
            DataError: Writing failed earlier, for example because the disk is full.
        """
        own = [name for name in self.info.features if name not in INDEX]
        check_keys("the data set", columns, own)
        check_keys("the episode", own, columns)
        vectors = [name for name in own if name not in self.info.cameras]
        clips = {name: self._as_clip(name, columns[name]) for name in self.info.cameras}
        length = len(columns[vectors[0]]) if vectors else clips[self.info.cameras[0]].length  # type: ignore[arg-type]
        values = {name: _checked(name, self.info.features[name], columns[name], length) for name in vectors}
        for name, clip in clips.items():
            if clip.length != length or not length:
                raise ParameterValueError(name, clip.length, f"a sequence of {length} pictures, at least 1")
        state = {name: np.array(value) for name, value in (start_state or {}).items()}
        if any(value.dtype.hasobject for value in state.values()):
            raise ParameterValueError("start_state", sorted(state), "a mapping to arrays of numbers or strings")
        self.submit(lambda: self._write(values, clips, task, length, None if start_state is None else state))

    def close(self) -> None:
        """Wait until all episodes are written, and join their files. Further calls have no effect.

        Raises:
            DataError: Writing failed.
        """
        if self._thread.is_alive():
            self._queue.put(self._join)
            self._queue.put(None)
            self._thread.join()
            self._raise_error()

    def __enter__(self) -> DatasetWriter:
        """Return the writer."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        """Close the writer. Whole episodes are kept even if the block raised an exception."""
        self.close()

    def submit(self, job: Callable[[], object]) -> None:
        """Run a function in the background thread.

        Raises:
            DataError: An earlier function failed.
        """
        self._raise_error()
        self._queue.put(job)

    def _work(self) -> None:
        while (job := self._queue.get()) is not None:
            if self._error is None:
                try:
                    job()
                    if self._batch and (self._queue.empty() or len(self._batch) == _BATCH or self.info.cameras):
                        self._flush()
                except Exception as error:
                    self._error = error

    def _raise_error(self) -> None:
        if self._error:
            raise self._failure(self._error) from self._error

    def _failure(self, error: Exception) -> DataError:
        reason = getattr(error, "strerror", None) or str(error).splitlines()[0]
        kept = f"the data set keeps {self.info.episodes:,} whole episodes"
        return DataError(self.folder, f"the data set cannot be written: {reason.rstrip('.')}; {kept}.")

    def _open(self, settings: Mapping[str, Any] | None) -> None:
        used = self.folder.is_dir() and any(self.folder.iterdir())
        if used and not self._append:
            raise DataError(self.folder, "the folder is not empty; choose another folder, or append to the data set.")
        if (self.folder / "meta" / "info.json").exists():
            self._continue(Dataset(self.folder))
        elif (self.folder / "data").exists():
            raise DataError(self.folder, "the folder contains no data set with meta/info.json; choose another folder.")
        (self.folder / PARTIAL).mkdir(parents=True, exist_ok=True)
        if settings is not None:
            write_json(self.folder / SETTINGS_PATH, settings)
        write_summary(self.folder, self.info, self._tasks, self._stats)

    def _continue(self, present: Dataset) -> None:
        for name in ("fps", "robot_type", "features"):
            old, new = getattr(present.info, name), getattr(self.info, name)
            if old != new:
                raise DataError(self.folder, f"the data set has other {name}: {old!r:.300}, not {new!r:.300}.")
        if (present.info.data_path, present.info.video_path) != (DATA_PATH, VIDEO_PATH):
            raise DataError(self.folder, "the files have unusual names; merge the data set into a new folder first.")
        remove_leftovers(present)
        self.info.episodes, self.info.frames = present.info.episodes, present.info.frames
        self.info.codecs |= present.info.codecs
        self._tasks = list(present.tasks)
        self._add_stats([row_stats(row, self.info.features) for row in present.rows(range(len(present.episodes)))])

    def _as_clip(self, key: str, pictures: Any) -> Clip:
        if isinstance(pictures, Clip):
            return pictures
        clip = self.clip(key)
        for picture in pictures:
            clip.append(picture)
        return clip

    def _write(
        self,
        values: dict[str, np.ndarray[Any, Any]],
        clips: Mapping[str, Clip],
        task: str,
        length: int,
        start_state: Mapping[str, np.ndarray[Any, Any]] | None,
    ) -> None:
        """Write the video and the start state of an episode, and prepare the rest for :meth:`_flush`."""
        index, frames = self.info.episodes + len(self._batch), np.arange(length)
        first = self._batch[-1][0]["dataset_to_index"] if self._batch else self.info.frames
        place = _place(self.info.episodes)
        if task not in self._tasks:
            self._tasks.append(task)
        values["timestamp"] = (frames / self.info.fps).astype(np.float32)
        values["frame_index"], values["index"] = frames, frames + first
        values["episode_index"] = np.full(length, index)
        values["task_index"] = np.full(length, self._tasks.index(task))
        stats = vector_stats(values)
        row: dict[str, Any] = {"episode_index": index, "tasks": [task], "length": length}
        row |= {**place_row("data", place), **place_row("meta/episodes", place)}
        row |= {"dataset_from_index": first, "dataset_to_index": first + length}
        for key, clip in clips.items():
            clip.finish()
            install(self.folder, clip.path, fill(VIDEO_PATH, place, key))
            row |= video_row(key, VideoPart(place, 0.0, length / self.info.fps))
            stats[key] = clip.stats.result()
        if start_state is not None:
            write_start_state(self.folder, index, start_state)
        self._batch.append((row | stats_row(stats), data_table(self.info.features, values), stats))

    def _flush(self) -> None:
        """Write the waiting episodes. They are part of the data set as soon as ``info.json`` counts them."""
        place = _place(self.info.episodes)
        rows, tables, stats = zip(*self._batch, strict=True)
        write_tables(self.folder, tables, fill(DATA_PATH, place))
        write_tables(self.folder, [episode_table(rows)], fill(EPISODES_PATH, place))
        self._add_stats(stats)
        self.info.episodes, self.info.frames = self.info.episodes + len(rows), rows[-1]["dataset_to_index"]
        self._batch.clear()
        write_summary(self.folder, self.info, self._tasks, self._stats)

    def _add_stats(self, parts: Sequence[Mapping[str, Stats]]) -> None:
        for name in self.info.features:
            found = [stats[name] for stats in (self._stats, *parts) if name in stats]
            if found:
                self._stats[name] = merge_stats(found)

    def _join(self) -> None:
        if self._batch:
            self._flush()
        written = Dataset(self.folder)
        joiner = Joiner(self.folder, self.info, self._tasks, written.episodes)
        for episode in written.episodes:
            if episode.listed[0] >= RECORDING_CHUNK:  # all later ones were recorded as well
                rest = range(episode.index, len(written.episodes))
                first = sum(joined.length for joined in written.episodes[: episode.index])
                joiner.add(written, rest, episode.index, first)
                break
        joiner.commit()
        remove_leftovers(Dataset(self.folder))


def _place(index: int) -> Place:
    """Return the chunk and file index of the files in which an episode is recorded."""
    return RECORDING_CHUNK + index // FILES_PER_CHUNK, index % FILES_PER_CHUNK


def _check_feature(name: str, feature: Feature) -> None:
    rule = f"a feature with one of the dtypes {', '.join(_TYPES)}"
    if feature.dtype not in _TYPES or not is_inside(name) or name in INDEX:
        raise ParameterValueError(name, feature.dtype, f"{rule}, and a name other than those of the index columns")
    even = len(feature.shape) == 3 and feature.shape[2] == 3 and not feature.shape[0] % 2 and not feature.shape[1] % 2
    if feature.is_video and not even:
        raise ParameterValueError(name, feature.shape, "the shape (height, width, 3) with even height and width")


def _checked(name: str, feature: Feature, value: Any, length: int) -> np.ndarray[Any, Any]:
    """Return a copy of a column with the right data type, (n, …), or (n,) for the shape ``(1,)``."""
    array = np.array(value, feature.dtype)
    shape = (length, *feature.shape)
    if array.size != length * feature.size or array.shape[:1] != (length,) or not length:
        raise ParameterValueError(name, array.shape, f"an array of shape {shape} with at least one frame")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise ParameterValueError(name, "an array with numbers that are not finite", "finite in every frame")
    return array.reshape(length) if feature.shape == (1,) else array.reshape(shape)
