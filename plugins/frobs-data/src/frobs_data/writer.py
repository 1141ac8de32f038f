"""Writes LeRobotDataset v3.0 folders, one episode at a time."""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ParameterValueError, check_keys, check_name
from frobs_core.util.files import write_json
from frobs_data.dataset import Dataset
from frobs_data.errors import DataError
from frobs_data.joining import (
    PARTIAL,
    Joiner,
    install,
    remove_leftovers,
    write_episodes,
    write_start_state,
    write_summary,
    write_table,
)
from frobs_data.layout import (
    DATA_PATH,
    FILES_PER_CHUNK,
    INDEX,
    RECORDING_CHUNK,
    SETTINGS_PATH,
    VIDEO_PATH,
    Episode,
    Feature,
    Info,
    Place,
    VideoPart,
    data_table,
    fill,
    is_inside,
)
from frobs_data.stats import NAMES, merge_stats, spans, vector_stats
from frobs_data.video import CODECS, Clip

_WAITING = 128
"""Maximum number of pictures and episodes that wait to be written. After that, callers wait."""

_PATIENCE = 0.5
"""Episodes that end within this time [s] share a file while recording, because each file costs time."""

_TYPES = ("float32", "float64", "int64", "int32", "uint8", "bool", "video")

_Columns = dict[str, np.ndarray[Any, Any]]


class DatasetWriter:
    """Writes a data set. After each episode, the folder is a complete data set of all whole episodes.

    One thread in the background writes the files. Episodes that end within half a second share files, and
    :meth:`close` joins all files. If the process is killed, the folder contains all episodes that were written, and
    ``append=True`` continues it.

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
        DataError: The folder is not empty, contains a data set with other features, or is being written.
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
        self._stats: Floats | None = None
        self._clips = 0
        self._batch: list[tuple[Episode, _Columns, list[Floats]]] = []
        self._due = 0.0
        self._error: Exception | None = None
        self._queue: Queue[Callable[[], object] | None] = Queue(_WAITING)
        self._locked = -1
        try:
            self._open(settings)
        except BaseException as error:
            self._unlock()
            if isinstance(error, OSError):
                raise self._failure(error) from error
            raise
        self._thread = Thread(target=self._work, name="dataset-writer", daemon=True)
        self._thread.start()

    def clip(self, key: str) -> Clip:
        """Return an empty sequence of pictures for the camera ``key``, to be filled during an episode.

        Raises:
            UnknownNameError: There is no such camera.
        """
        check_name("camera", key, self.info.cameras)
        self._clips += 1
        path = self.folder / PARTIAL / f"clip-{self._clips}.mp4"
        return Clip(self._submit, path, self.info.fps, self.info.features[key].shape, self._codec)

    def add(
        self,
        columns: Mapping[str, Any],
        task: str,
        start_state: Mapping[str, np.ndarray[Any, Any]] | None = None,
    ) -> None:
        """Add one whole episode. The arrays may be changed afterwards.

        Args:
            columns: Array of each feature, (n, …), or (n,) for the shape ``(1,)``. For a camera: an array, pictures one
                by one, or a clip from :meth:`clip`.
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
        length = next((len(columns[name]) for name in own if name not in self.info.cameras), -1)
        clips: dict[str, Clip] = {}
        for key in self.info.cameras:
            clip = clips[key] = columns[key] if isinstance(columns[key], Clip) else self.clip(key)
            for picture in () if clip is columns[key] else columns[key]:
                clip.append(picture)
            length = clip.length if length < 0 else length
            if clip.length != length:
                raise ParameterValueError(key, clip.length, f"a sequence of {length} pictures")
        if length < 1:
            raise ParameterValueError("columns", length, "an episode of at least one frame")
        values = {
            name: _checked(name, self.info.features[name], columns[name], length) for name in own if name not in clips
        }
        state = {name: np.array(value) for name, value in (start_state or {}).items()}
        if any(value.dtype.hasobject for value in state.values()):
            raise ParameterValueError("start_state", sorted(state), "a mapping to arrays of numbers or strings")
        self._submit(lambda: self._write(values, clips, task, length, state))

    def close(self) -> None:
        """Wait until all episodes are written, and join their files. Further calls have no effect.

        Raises:
            DataError: Writing failed.
        """
        if self._thread.is_alive():
            self._queue.put(self._join)
            self._queue.put(None)
            self._thread.join()
            self._unlock()
            self._check()

    def __enter__(self) -> DatasetWriter:
        """Return the writer."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close the writer. Whole episodes are kept even if the block raised an exception."""
        self.close()

    def _submit(self, job: Callable[[], object]) -> None:
        """Run a function in the background thread, unless an earlier one failed."""
        self._check()
        self._queue.put(job)

    def _check(self) -> None:
        if self._error:
            raise self._failure(self._error) from self._error

    def _work(self) -> None:
        job: Callable[[], object] | None = self._flush
        while job is not None:
            if self._error is None:
                try:
                    job()
                    if self._batch and time.monotonic() >= self._due:
                        self._flush()
                except Exception as error:
                    self._error = error
            try:
                wait = max(0.0, self._due - time.monotonic()) if self._batch and self._error is None else None
                job = self._queue.get(timeout=wait)
            except Empty:
                job = self._flush

    def _failure(self, error: Exception) -> DataError:
        reason = getattr(error, "strerror", None) or str(error).splitlines()[0]
        kept = f"the data set keeps {self.info.episodes:,} whole episodes"
        return DataError(self.folder, f"the data set cannot be written: {reason.rstrip('.')}; {kept}.")

    def _open(self, settings: Mapping[str, Any] | None) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        self._lock()
        if any(self.folder.iterdir()) and not self._append:
            raise DataError(self.folder, "the folder is not empty; choose another folder, or append to the data set.")
        if (self.folder / "meta" / "info.json").exists():
            self._continue(Dataset(self.folder))
        elif (self.folder / "data").exists():
            raise DataError(self.folder, "the folder contains no data set with meta/info.json; choose another folder.")
        (self.folder / PARTIAL).mkdir(exist_ok=True)
        if settings is not None:
            write_json(self.folder / SETTINGS_PATH, settings)
        write_summary(self.folder, self.info, self._tasks, self._stats)

    def _lock(self) -> None:
        """Lock the folder until this process closes the writer or ends."""
        self._locked = os.open(self.folder, os.O_RDONLY)
        try:
            fcntl.flock(self._locked, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise DataError(
                self.folder, "another writer has it open; close that one, or choose another folder."
            ) from None
        except OSError:  # the file system does not support locks
            pass

    def _unlock(self) -> None:
        if self._locked >= 0:
            os.close(self._locked)
            self._locked = -1

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
        if present.episodes:
            self._stats = merge_stats(present.stats(present.episodes, self.info.features))

    def _write(self, values: _Columns, clips: Mapping[str, Clip], task: str, length: int, state: _Columns) -> None:
        """Write the video and the start state of an episode. The rest waits for :meth:`_flush`."""
        index, listed = self.info.episodes + len(self._batch), _place(self.info.episodes)
        if not self._batch:
            self._due = time.monotonic() + _PATIENCE
        if task not in self._tasks:
            self._tasks.append(task)
        videos = {key: VideoPart(_place(index), 0.0, length / self.info.fps) for key in clips}
        for key, clip in clips.items():
            clip.finish()
            install(self.folder, clip.path, fill(VIDEO_PATH, videos[key].place, key))
        if state:
            write_start_state(self.folder, index, state)
        episode = Episode(index, length, (task,), listed, videos, listed)
        self._batch.append((episode, values, [clip.stats.result() for clip in clips.values()]))

    def _flush(self) -> None:
        """Write the waiting episodes. They are part of the data set as soon as ``info.json`` counts them."""
        if not self._batch:
            return
        episodes, values, pictures = zip(*self._batch, strict=True)
        lengths, first = [episode.length for episode in episodes], self.info.frames
        frames = np.concatenate([np.arange(length) for length in lengths])
        columns = {name: np.concatenate([each[name] for each in values]) for name in values[0]}
        columns["timestamp"] = (frames / self.info.fps).astype(np.float32)
        columns["frame_index"], columns["index"] = frames, np.arange(first, first + sum(lengths))
        columns["episode_index"] = np.repeat([episode.index for episode in episodes], lengths)
        columns["task_index"] = np.repeat([self._tasks.index(episode.tasks[0]) for episode in episodes], lengths)
        write_table(self.folder, data_table(self.info.features, columns), fill(DATA_PATH, episodes[0].place))
        stats = self._make_stats(columns, lengths, pictures)
        write_episodes(self.folder, self.info, episodes, first, stats)
        self._stats = merge_stats(stats if self._stats is None else np.concatenate([self._stats[None], stats]))
        self._batch.clear()
        self.info.episodes, self.info.frames = self.info.episodes + len(episodes), first + sum(lengths)
        write_summary(self.folder, self.info, self._tasks, self._stats)

    def _make_stats(self, columns: _Columns, lengths: Sequence[int], pictures: Sequence[Sequence[Floats]]) -> Floats:
        """Return the statistics of episodes, (n, 10, k)."""
        vectors = [name for name in self.info.features if name not in self.info.cameras]
        flat = np.concatenate([columns[name].reshape(sum(lengths), -1) for name in vectors], axis=1, dtype=np.float64)
        columns_of = spans(self.info.features)
        order = np.concatenate([np.r_[columns_of[name]] for name in (*vectors, *self.info.cameras)])
        found = np.empty((len(lengths), len(NAMES), len(order)))
        for stats, part, seen in zip(found, np.split(flat, np.cumsum(lengths)[:-1]), pictures, strict=True):
            stats[:, order] = np.concatenate([vector_stats(part), *seen], axis=1)
        return found

    def _join(self) -> None:
        self._flush()
        written = Dataset(self.folder)
        numbers = [episode.index for episode in written.episodes if episode.listed[0] >= RECORDING_CHUNK]
        if numbers:  # all later ones were recorded as well
            joiner = Joiner(self.folder, self.info, self._tasks, written.episodes[: numbers[0]])
            joiner.add(written, range(numbers[0], len(written.episodes)))
            joiner.commit()
            written = Dataset(self.folder)
        remove_leftovers(written)


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
    if array.shape not in ((length, *feature.shape), (length, *feature.row_shape)):
        raise ParameterValueError(name, array.shape, f"an array of shape {(length, *feature.shape)}")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise ParameterValueError(name, "an array with numbers that are not finite", "finite in every frame")
    return array.reshape(length, *feature.row_shape)
