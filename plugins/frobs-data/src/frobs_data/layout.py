"""Features, episodes, paths and tables of a LeRobotDataset v3.0 folder."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any, TypeAlias

import numpy as np
import pyarrow as pa

from frobs_core.util.files import read_json
from frobs_core.util.plain import to_json
from frobs_data.budgets import BUDGET
from frobs_data.errors import DataError

VERSION = "v3.0"
FILES_PER_CHUNK = 1000
RECORDING_CHUNK = 500
"""First chunk of the files that contain one episode each. They exist while a data set is being recorded."""

DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO_PATH = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
EPISODES_PATH = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
SETTINGS_PATH = "meta/frobs/settings.json"
START_PATH = "meta/frobs/start/episode-{:06d}.npy"

Place: TypeAlias = tuple[int, int]
"""Chunk and file index of a file."""

_NUMBERS = ("float32", "float64", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64", "bool")
_DTYPES = (*_NUMBERS, "float16", "string", "language", "image", "depth", "video")


@dataclass(frozen=True)
class Feature:
    """One column or camera of a data set.

    Attributes:
        dtype: NumPy data type, ``"video"`` for a camera, or a type that is not read, such as ``"string"``.
        shape: Shape of one frame's value. ``(1,)`` for a number, ``(height, width, 3)`` for a camera.
        names: Name of each element, or of each axis of a picture. Empty if the data set does not name them.
    """

    dtype: str
    shape: tuple[int, ...]
    names: tuple[str, ...] = ()

    @property
    def is_video(self) -> bool:
        """Whether the feature is a camera."""
        return self.dtype == "video"

    @property
    def is_numeric(self) -> bool:
        """Whether the feature is a column of numbers."""
        return self.dtype in _NUMBERS

    @property
    def size(self) -> int:
        """Number of elements of one frame's value."""
        return math.prod(self.shape)

    @property
    def row_shape(self) -> tuple[int, ...]:
        """Shape of one frame's value in an array: numbers have no axis."""
        return () if self.shape == (1,) else self.shape


INDEX: Mapping[str, Feature] = {
    "timestamp": Feature("float32", (1,)),
    **{name: Feature("int64", (1,)) for name in ("frame_index", "episode_index", "index", "task_index")},
}
"""Columns of every data set."""


@dataclass(frozen=True)
class VideoPart:
    """Part of a video file that shows one episode.

    Attributes:
        place: Chunk and file index of the video file.
        start: Time of the first picture in the file [s].
        end: Time after the last picture in the file [s].
    """

    place: Place
    start: float
    end: float


@dataclass(frozen=True)
class Episode:
    """One episode of a data set.

    Attributes:
        index: Number of the episode, from 0.
        length: Number of frames.
        tasks: Sentences that describe the task.
        place: Chunk and file index of the data file.
        videos: Part of a video for each camera.
        listed: Chunk and file index of the metadata file that lists the episode.
    """

    index: int
    length: int
    tasks: tuple[str, ...]
    place: Place
    videos: Mapping[str, VideoPart]
    listed: Place


@dataclass
class Info:
    """Content of ``meta/info.json``.

    Attributes:
        fps: Frames per second [1/s].
        robot_type: Name of the robot, or None.
        features: Features by name, with those of :data:`INDEX`.
        episodes: Number of episodes.
        frames: Number of frames.
        data_path: Template of the data files' paths.
        video_path: Template of the videos' paths.
        codecs: Codec of each camera's video.
        sizes: Size limits of data and video files [MB].
    """

    fps: int
    robot_type: str | None
    features: dict[str, Feature]
    episodes: int = 0
    frames: int = 0
    data_path: str = DATA_PATH
    video_path: str = VIDEO_PATH
    codecs: dict[str, str] = field(default_factory=dict)
    sizes: tuple[float, float] = (100, 200)

    @property
    def cameras(self) -> list[str]:
        """Names of the features that are cameras."""
        return [name for name, feature in self.features.items() if feature.is_video]

    def to_json(self, tasks: int) -> dict[str, Any]:
        """Return the content of ``info.json`` for a data set with this number of tasks."""
        features: dict[str, Any] = {}
        for name, feature in self.features.items():
            features[name] = {"dtype": feature.dtype, "shape": feature.shape, "names": feature.names or None}
            if feature.is_video:
                size = dict(zip(("video.height", "video.width", "video.channels"), feature.shape, strict=True))
                coding = {"video.codec": self.codecs.get(name, "av1"), "video.pix_fmt": "yuv420p"}
                others = {"video.is_depth_map": False, "video.fps": self.fps, "has_audio": False}
                features[name]["info"] = {**size, **coding, **others}
        data_mb, video_mb = (max(1, round(size)) for size in self.sizes)
        counts = {"total_episodes": self.episodes, "total_frames": self.frames, "total_tasks": tasks}
        sizes = {"data_files_size_in_mb": data_mb, "video_files_size_in_mb": video_mb, "chunks_size": FILES_PER_CHUNK}
        paths = {"data_path": DATA_PATH, "video_path": VIDEO_PATH if self.cameras else None}
        split = {"fps": self.fps, "splits": {"train": f"0:{self.episodes}"}}
        head = {"codebase_version": VERSION, "robot_type": self.robot_type}
        return {**head, **counts, **sizes, **split, **paths, "features": features}


def read_info(folder: Path) -> Info:
    """Read and validate ``meta/info.json``.

    Raises:
        DataError: The file is missing or damaged, has another format version, or exceeds a limit.
    """
    path = folder / "meta" / "info.json"
    try:
        found = read_json(path)
    except OSError as error:
        advice = "specify the folder of a LeRobotDataset v3.0, which contains meta/info.json"
        raise DataError(path, f"the file cannot be read: {error.strerror}; {advice}.") from error
    version = found.get("codebase_version")
    if version != VERSION:
        raise DataError(
            path,
            f"the data set has the format version {str(version)!r:.40}, but FRobs reads {VERSION} only; convert an "
            "older data set with LeRobot: python -m lerobot.scripts.convert_dataset_v21_to_v30",
        )
    features = found.get("features")
    if not isinstance(features, dict) or not 0 < len(features) <= BUDGET["features"]:
        raise DataError(path, f"'features' must be a mapping with 1 to {BUDGET['features']:,} entries.")
    robot_type = found.get("robot_type")
    read = {name: _read_feature(path, name, value) for name, value in features.items()}
    details = {name: value.get("info") for name, value in features.items() if read[name].is_video}
    codecs = {name: str(info.get("video.codec", "av1")) for name, info in details.items() if isinstance(info, dict)}
    return Info(
        fps=read_whole(path, found, "fps", 1, BUDGET["frames per second"]),
        robot_type=robot_type if isinstance(robot_type, str) else None,
        features={**read, **INDEX},
        episodes=read_whole(path, found, "total_episodes", 0, BUDGET["episodes"]),
        frames=read_whole(path, found, "total_frames", 0, BUDGET["frames"]),
        data_path=_read_template(path, found, "data_path", DATA_PATH),
        video_path=_read_template(path, found, "video_path", VIDEO_PATH),
        codecs=codecs,
    )


def read_whole(path: Path, values: Mapping[str, Any], key: str, least: int, most: int) -> int:
    """Return a whole number from a file of a stranger.

    Raises:
        DataError: The value is something else, or out of range.
    """
    value: Any = values.get(key)
    if type(value) not in (int, float) or not least <= value <= most or int(value) != value:
        raise DataError(path, f"'{key}' is {value!r:.40}; it must be a whole number from {least:,} to {most:,}.")
    return int(value)


def _read_template(path: Path, values: Mapping[str, Any], key: str, default: str) -> str:
    value = values.get(key) or default
    if not isinstance(value, str) or not is_inside(value):
        raise DataError(path, f"'{key}' is {value!r:.80}; it must be a path inside the data set.")
    return value


def _read_feature(path: Path, name: str, value: Any) -> Feature:
    if not is_inside(name) or len(name) > 200:
        raise DataError(path, f"the feature name {name!r:.80} cannot be part of a path inside the data set.")
    shape = value.get("shape") if isinstance(value, dict) else None
    if not isinstance(shape, list) or not all(type(size) is int and 0 < size < 2**31 for size in shape):
        raise DataError(path, f"the feature '{name}' needs a 'shape' that is a list of positive whole numbers.")
    dtype, names = value.get("dtype"), _read_names(value.get("names"))
    if dtype == "video" and len(shape) == 3:
        if shape[0] == 3 != shape[2]:  # LeRobot also writes this order
            shape, names = [*shape[1:], 3], (*names[1:], *names[:1])
        elif 1 in (shape[0], shape[2]):
            dtype = "depth"
    feature = Feature(dtype, tuple(shape) or (1,), names)
    if feature.dtype not in _DTYPES:
        raise DataError(path, f"the feature '{name}' has the unknown dtype {feature.dtype!r:.40}.")
    if feature.is_video and (len(shape) != 3 or shape[2] != 3):
        raise DataError(path, f"the video '{name}' has the shape {shape}; it must be (height, width, 3).")
    is_picture = feature.dtype in ("video", "depth", "image")
    limit = BUDGET["pixels of a picture"] * 3 if is_picture else BUDGET["elements of a feature"]
    if len(shape) > 10 or feature.size > limit:
        raise DataError(path, f"the feature '{name}' has more than {limit:,} elements.")
    return feature


def _read_names(value: Any) -> tuple[str, ...]:
    if isinstance(value, dict):  # LeRobot also writes {"motors": [names]}
        value = [name for names in value.values() if isinstance(names, list) for name in names]
    return tuple(value) if isinstance(value, list) and all(isinstance(name, str) for name in value) else ()


def is_inside(name: str) -> bool:
    """Return whether a relative path, or a template of one, stays inside its folder."""
    path = PurePosixPath(name.replace("\\", "/"))
    forbidden = path.is_absolute() or ".." in path.parts or "\0" in name
    return bool(path.parts) and not forbidden and not re.search(r"[{}:]", re.sub(r"\{\w+(:03d)?\}", "", name))


def fill(template: str, place: Place, camera: str = "") -> str:
    """Return the relative path of a file.

    ``str.format`` would let a template read attributes and allocate memory, so only known fields are replaced.

    Args:
        template: Template such as :data:`DATA_PATH`.
        place: Chunk and file index.
        camera: Name of the camera.
    """
    path = template.replace("{video_key}", camera)
    for name, value in zip(("chunk_index", "file_index"), place, strict=True):
        path = path.replace(f"{{{name}:03d}}", f"{value:03d}").replace(f"{{{name}}}", str(value))
    return path


def next_place(place: Place) -> Place:
    """Return the chunk and file index of the file after ``place``."""
    return (place[0], place[1] + 1) if place[1] + 1 < FILES_PER_CHUNK else (place[0] + 1, 0)


def nested_lists(values: np.ndarray[Any, Any], shape: Sequence[int], *, fixed: bool) -> pa.Array:
    """Return an Arrow array of nested lists, of fixed or variable size, for the flat values of arrays of a shape."""
    array = pa.array(values)
    for size in reversed(shape):
        if fixed:
            array = pa.FixedSizeListArray.from_arrays(array, size)
        else:
            array = pa.ListArray.from_arrays(np.arange(0, len(array) + 1, size, dtype=np.int32), array)
    return array


def data_table(features: Mapping[str, Feature], columns: Mapping[str, np.ndarray[Any, Any]]) -> pa.Table:
    """Return the Arrow table of frames, with the metadata that Hugging Face's ``datasets`` expects.

    Args:
        features: Features of the data set. Cameras are left out.
        columns: Array of each feature, (n, k), or (n,) for the shape ``(1,)``.
    """
    described: dict[str, Any] = {}
    arrays = {}
    for name, feature in features.items():
        if not feature.is_video:
            arrays[name] = nested_lists(columns[name].reshape(-1), feature.row_shape, fixed=True)
            described[name] = {"dtype": feature.dtype, "_type": "Value"}
            for size in reversed(feature.row_shape):
                described[name] = {"feature": described[name], "length": size, "_type": "List"}
    return pa.table(arrays).replace_schema_metadata({"huggingface": to_json({"info": {"features": described}})})


def tasks_table(tasks: Sequence[str]) -> pa.Table:
    """Return the Arrow table of ``meta/tasks.parquet``: for pandas, the sentences are the index of the frame."""
    kinds = {"task_index": ("int64", "int64"), "task": ("unicode", "object")}
    described = [
        {"name": name, "field_name": name, "pandas_type": pandas, "numpy_type": numpy, "metadata": None}
        for name, (pandas, numpy) in kinds.items()
    ]
    frame = {"index_columns": ["task"], "column_indexes": [], "columns": described, "pandas_version": "2.3.3"}
    table = pa.table({"task_index": pa.array(range(len(tasks)), pa.int64()), "task": pa.array(tasks, pa.string())})
    return table.replace_schema_metadata({"pandas": to_json(frame)})
