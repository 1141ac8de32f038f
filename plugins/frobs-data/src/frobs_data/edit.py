"""Merges, splits, checks and exports data sets."""

from __future__ import annotations

import math
import shutil
import warnings
from collections.abc import Iterable, Mapping, Sequence
from itertools import accumulate, groupby, product
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import MissingDependencyError, ParameterValueError
from frobs_core.util.files import read_json, write_json
from frobs_data.dataset import Dataset
from frobs_data.errors import DataError
from frobs_data.joining import PARTIAL, Joiner, write_start_state, write_summary
from frobs_data.layout import SETTINGS_PATH, Episode, Info
from frobs_data.stats import PictureStats, merge_stats, shape_of, stats_dict, vector_stats

_CLOSE = 1e-3
"""Permitted difference of statistics, relative to the range of a feature. LeRobot computes some in single precision."""


def merge(folders: Sequence[Path | str], out: Path | str) -> Dataset:
    """Combine data sets into a new one. The videos are copied without encoding them again.

    Args:
        folders: The data sets. They must have the same rate, robot and features.
        out: Folder of the new data set, which must not exist or must be empty.

    Raises:
        DataError: The data sets differ, one of them is damaged, or the folder is not empty.
    """
    sets = [Dataset(folder) for folder in folders]
    for name in ("fps", "robot_type", "features"):
        values = [getattr(dataset.info, name) for dataset in sets]
        if other := next((i for i, value in enumerate(values) if value != values[0]), None):
            raise DataError(sets[other].folder, f"the data set has other {name} than {sets[0].folder}.")
    return _assemble([(dataset, range(len(dataset.episodes))) for dataset in sets], Path(out))


def split(folder: Path | str, parts: Mapping[str, float | Sequence[int]], out: Path | str) -> dict[str, Dataset]:
    """Divide a data set into several new ones. The videos are copied without encoding them again.

    Args:
        folder: The data set.
        parts: Fraction of the episodes, or the numbers of the episodes, of each part. Fractions take successive
            episodes.
        out: Folder in which each part gets a folder with its name.

    Returns:
        The parts by name.

    Raises:
        ParameterValueError: The fractions exceed 1, an episode does not exist, or a part is empty.
        DataError: The data set is damaged, or the folder of a part is not empty.
    """
    dataset = Dataset(folder)
    count = len(dataset.episodes)
    fractions = [share if isinstance(share, int | float) else 0.0 for share in parts.values()]
    if not all(math.isfinite(share) and share >= 0 for share in fractions) or sum(fractions) > 1 + 1e-9:
        raise ParameterValueError("parts", dict(parts), "fractions with a sum of at most 1, or lists of episodes")
    ends = [round(count * end) for end in accumulate(fractions, initial=0.0)]
    chosen: dict[str, Sequence[int]] = {}
    for (name, part), begin, end in zip(parts.items(), ends, ends[1:], strict=False):
        chosen[name] = range(begin, end) if isinstance(part, int | float) else list(part)
        if not chosen[name] or not all(0 <= index < count for index in chosen[name]) or Path(name).name != name:
            raise ParameterValueError(f"parts.{name}", part, f"at least one of {count} episodes, for a folder's name")
    return {name: _assemble([(dataset, episodes)], Path(out) / name) for name, episodes in chosen.items()}


def _assemble(sources: Sequence[tuple[Dataset, Sequence[int]]], out: Path) -> Dataset:
    first = sources[0][0]
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise DataError(out, "it is not a folder, or not empty; choose another folder.")
    if others := [name for name, each in first.features.items() if not (each.is_video or each.is_numeric)]:
        reason = f"{', '.join(others)[:300]} cannot be copied, because only numbers and color videos can"
        raise DataError(first.folder, f"{reason}; remove these features with lerobot-edit-dataset first.")
    info = Info(first.fps, first.robot_type, dict(first.features), codecs=first.info.codecs)
    tasks: list[str] = []
    try:
        (out / PARTIAL).mkdir(parents=True, exist_ok=True)
        joiner = Joiner(out, info, tasks)
        for dataset, episodes in sources:
            for index, episode in enumerate(episodes, info.episodes):
                if state := dataset.start_state(episode):
                    write_start_state(out, index, state)
            joiner.add(dataset, episodes)
            info.episodes, info.frames = len(joiner.episodes), joiner.frames
        settings = [dataset.settings or {} for dataset, _ in sources]
        first_settings = settings[0].items()
        if shared := {
            key: value for key, value in first_settings if all(other.get(key) == value for other in settings)
        }:
            write_json(out / SETTINGS_PATH, shared)
        joiner.commit()
        write_summary(out, info, tasks, merge_stats(np.concatenate(joiner.stats)) if joiner.episodes else None)
        (out / PARTIAL).rmdir()
    except BaseException as error:  # half a data set would look like a data set, and block the next try
        shutil.rmtree(out, ignore_errors=True)
        if isinstance(error, OSError):
            raise DataError(out, f"the data set cannot be written: {error.strerror or error}.") from error
        raise
    return Dataset(out)


def check(folder: Path | str) -> list[str]:
    """Read everything in the data set ``folder``.

    Returns:
        One line for each problem of the content: numbers that are not finite, frames whose index or time is wrong,
        statistics that differ from the data, and videos that cannot be decoded.

    Raises:
        DataError: The data set cannot be opened.
    """
    dataset = Dataset(folder)
    problems: list[str] = []
    try:
        expected = read_json(dataset.folder / "meta" / "stats.json")
    except OSError as error:
        expected = {}
        problems.append(f"meta/stats.json cannot be read: {error.strerror}")
    merged: dict[str, Floats] = {}

    def add(name: str, stats: Floats) -> None:
        merged[name] = merge_stats(np.stack([merged[name], stats])) if name in merged else stats

    names = [name for name, feature in dataset.features.items() if feature.is_numeric]
    firsts = list(accumulate((episode.length for episode in dataset.episodes), initial=0))
    for _, group in groupby(dataset.episodes, key=lambda episode: episode.place):
        try:
            for episodes, columns in dataset.iter_files(names, [episode.index for episode in group]):
                problems += _check_columns(episodes, columns, firsts[episodes[0].index], dataset)
                for name, values in columns.items():
                    add(name, vector_stats(values.reshape(len(values), -1).astype(np.float64)))
        except DataError as error:
            problems.append(str(error))
    for camera, index in product(dataset.info.cameras, range(len(dataset.episodes))):
        pictures = PictureStats()
        try:
            for picture in dataset.iter_pictures(index, camera):
                pictures.add(picture)
            add(camera, pictures.result())
        except DataError as error:
            problems.append(f"episode {index}: {error}")
    for name, stats in merged.items():
        found = stats_dict(stats, shape_of(dataset.features[name]))
        if found["count"][0] == len(dataset):  # otherwise, some of the data is damaged
            problems += _compare(name, found, expected.get(name), dataset.features[name].is_video)
    return problems


def _check_columns(
    episodes: Sequence[Episode], columns: Mapping[str, np.ndarray[Any, Any]], first: int, dataset: Dataset
) -> Iterable[str]:
    where = f"episodes {episodes[0].index} to {episodes[-1].index}"
    frames = np.concatenate([np.arange(episode.length) for episode in episodes])
    for name, values in columns.items():
        if count := np.sum(~np.isfinite(values)):
            yield f"{where}: '{name}' is not finite in {count} places"
    for name, right in (("frame_index", frames), ("index", np.arange(first, first + len(frames)))):
        if not np.array_equal(columns[name], right):
            yield f"{where}: '{name}' does not count the frames"
    if not np.allclose(columns["timestamp"], frames / dataset.fps, atol=1e-3):
        yield f"{where}: 'timestamp' does not fit {dataset.fps} frames per second"
    if not np.isin(columns["task_index"], range(len(dataset.tasks))).all():
        yield f"{where}: 'task_index' has no sentence in meta/tasks.parquet"


def _compare(name: str, stats: Mapping[str, Floats], expected: Any, is_video: bool) -> Iterable[str]:
    """Compare statistics. Quantiles depend on the method, and pictures on the encoder."""
    for key in ("min", "max", "mean", "std") if not is_video else ("mean",):
        try:
            given = np.asarray(expected[key], float).reshape(stats[key].shape)
        except (KeyError, TypeError, ValueError):
            yield f"meta/stats.json has no valid {key} of '{name}'"
            return
        scale = 20.0 if is_video else np.maximum(stats["max"] - stats["min"], 1e-3)
        if not np.all(np.abs(given - stats[key]) <= _CLOSE * scale):
            yield f"the {key} of '{name}' in meta/stats.json differs from the data"


def export_minari(folder: Path | str, name: str) -> Path:
    """Write a data set for Minari, with the vectors of the observation side by side.

    Minari needs an observation after the last action, which LeRobot does not store: the last one is repeated.

    Args:
        folder: The data set.
        name: ID of the Minari data set, such as ``"frobs/pick-v0"``. It is stored in Minari's folder.

    Returns:
        The folder of the Minari data set.

    Raises:
        MissingDependencyError: Minari is not installed.
        DataError: The data set is damaged, or Minari rejects the name.
    """
    try:
        import minari
        from minari.data_collector import EpisodeBuffer
    except ImportError as error:
        raise MissingDependencyError("the export", ["minari"], "pip install 'frobs-data[minari]'") from error
    from gymnasium.spaces import Box

    dataset, optional = Dataset(folder), ("next.reward", "next.terminated")
    numeric = [name for name, feature in dataset.features.items() if feature.is_numeric]
    vectors = [name for name in numeric if name.startswith("observation.")]
    if not (vectors and "action" in numeric and dataset.episodes):
        raise DataError(folder, "Minari needs episodes with vectors of observations and with actions.")
    columns = dataset.columns([*vectors, "action", *(name for name in optional if name in numeric)])
    observations = np.concatenate(
        [columns[name].reshape(len(dataset), -1) for name in vectors], axis=1, dtype=np.float32
    )
    actions = columns["action"].reshape(len(dataset), -1).astype(np.float32)
    rewards, ended = (columns.get(name, np.zeros(len(dataset), np.float32)) for name in optional)
    buffers, end = [], 0
    for episode in dataset.episodes:
        begin, end = end, end + episode.length
        rows, last = slice(begin, end), np.arange(begin, end) == end - 1
        buffers.append(
            EpisodeBuffer(
                id=episode.index,
                observations=np.concatenate([observations[rows], observations[end - 1 : end]]),
                actions=actions[rows],
                rewards=rewards[rows],
                terminations=ended[rows].astype(bool),
                truncations=last & ~ended[rows].astype(bool),
            )
        )
    sizes = observations.shape[1], dataset.features["action"].size
    spaces = [Box(-np.inf, np.inf, (size,), np.float32) for size in sizes]
    try:
        with warnings.catch_warnings(action="ignore"):  # Minari warns about each description that is missing
            made = minari.create_dataset_from_buffers(
                name, buffers, observation_space=spaces[0], action_space=spaces[1]
            )
    except (ValueError, OSError) as error:
        raise DataError(folder, f"Minari cannot write '{name}': {error}") from error
    return Path(made.storage.data_path).parent
