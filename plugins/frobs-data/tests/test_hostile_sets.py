"""Data sets that are damaged, or made to harm."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from made_sets import CAMERAS, make_set

from frobs_data import DataError, Dataset, check, merge

DATA, EPISODES = "data/chunk-000/file-000.parquet", "meta/episodes/chunk-000/file-000.parquet"
VIDEO = f"videos/{CAMERAS[0]}/chunk-000/file-000.mp4"
STATE = "observation.state"


def change_info(folder: Path, change: Callable[[dict[str, Any]], object]) -> None:
    path = folder / "meta/info.json"
    info = json.loads(path.read_text())
    change(info)
    path.write_text(json.dumps(info))


def change_table(path: Path, name: str, values: Any) -> None:
    table = pq.read_table(path)
    array = values if isinstance(values, pa.Array) else pa.array(values)
    pq.write_table(table.set_column(table.schema.get_field_index(name), name, array), path)


def read_all(folder: Path) -> None:
    dataset = Dataset(folder)
    dataset.columns([name for name, feature in dataset.features.items() if feature.is_numeric])
    for index in range(len(dataset.episodes)):
        dataset.start_state(index)
        for camera in dataset.info.cameras:
            dataset.pictures(index, camera)


INFOS: dict[str, tuple[dict[str, Any], str]] = {
    "v2": ({"codebase_version": "v2.1"}, "format version 'v2.1'"),
    "no version": ({"codebase_version": None}, "format version"),
    "outside": ({"data_path": "../x/{chunk_index:03d}.parquet"}, "inside the data set"),
    "absolute": ({"video_path": "/etc/{video_key}"}, "inside the data set"),
    "attributes": ({"data_path": "{chunk_index.__class__}"}, "inside the data set"),
    "wide": ({"data_path": "data/{chunk_index:9999999999d}"}, "inside the data set"),
    "path type": ({"data_path": ["data"]}, "inside the data set"),
    "fps 0": ({"fps": 0}, "'fps' is 0"),
    "fps text": ({"fps": "25"}, "'fps' is '25'"),
    "fps nan": ({"fps": float("nan")}, "'fps' is nan"),
    "fps infinite": ({"fps": float("inf")}, "'fps' is inf"),
    "huge": ({"total_frames": 10**30}, "'total_frames'"),
    "negative": ({"total_episodes": -1}, "'total_episodes'"),
    "many": ({"total_episodes": 1_000_000}, "episode 3 is not listed"),
    "frames": ({"total_frames": 7}, "episodes have 18 frames"),
    "features list": ({"features": [1]}, "'features' must be a mapping"),
    "no features": ({"features": {}}, "'features' must be a mapping"),
    "feature text": ({"features": {"a": "float32"}}, "needs a 'shape'"),
    "feature name": ({"features": {"../../a": {"dtype": "video", "shape": [2, 2, 3]}}}, "cannot be part of a path"),
    "dtype": ({"features": {"a": {"dtype": ["x"], "shape": [1]}}}, "unknown dtype"),
    "shape": ({"features": {"a": {"dtype": "float32", "shape": [-1]}}}, "needs a 'shape'"),
    "large shape": ({"features": {"a": {"dtype": "float32", "shape": [10**9]}}}, "more than 100,000 elements"),
    "large product": ({"features": {"a": {"dtype": "float32", "shape": [2**30, 2**30, 2**30]}}}, "elements"),
    "large picture": ({"features": {"a": {"dtype": "video", "shape": [10**6, 10**6, 3]}}}, "elements"),
    "details": ({"features": {"a": {"dtype": "video", "shape": [32, 32, 3], "info": 5}}}, "no column 'videos/a/"),
    "gray picture": ({"features": {"a": {"dtype": "video", "shape": [32, 32]}}}, "height, width, 3"),
}


@pytest.mark.parametrize(("change", "message"), INFOS.values(), ids=INFOS)
def test_a_wrong_info_raises_one_clear_line(copied: Path, change: dict[str, Any], message: str) -> None:
    change_info(copied, lambda info: info.update(change))
    with pytest.raises(DataError, match=message) as raised:
        read_all(copied)
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 800


@pytest.mark.parametrize("content", [b"", b"[]", b"{", b"[" * 10_000, b"\xff\xfe", b'{"a": ' + b"9" * 10_000 + b"}"])
def test_an_info_that_is_no_object_raises(copied: Path, content: bytes) -> None:
    (copied / "meta/info.json").write_bytes(content)
    with pytest.raises(DataError, match=r"info\.json"):
        Dataset(copied)


FILES = [DATA, EPISODES, VIDEO, "meta/tasks.parquet", "meta/frobs/start/episode-000001.npy", "meta/frobs/settings.json"]


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("damage", ["half", "empty", "text", "folder"])
def test_a_damaged_file_raises_one_clear_line(copied: Path, name: str, damage: str) -> None:
    path = copied / name
    whole = path.read_bytes()
    path.unlink()
    if damage == "folder":
        path.mkdir()
    else:
        path.write_bytes({"half": whole[: len(whole) // 2], "empty": b"", "text": b"#EXTM3U\n/etc/passwd\n"}[damage])
    with pytest.raises(DataError) as raised:
        read_all(copied)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("name", FILES[:4])
def test_a_missing_file_raises_when_the_set_is_opened(copied: Path, name: str) -> None:
    (copied / name).unlink()
    with pytest.raises(DataError, match=r"missing|not listed"):
        Dataset(copied)


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("length", [5, 6, 10**9], "'length' is"),
        ("length", [5, 5, 8], "lasts 0.280 s, which does not fit 8"),
        ("length", ["5", "6", "7"], "'length' is '5'"),
        ("episode_index", [0, 0, 2], "episode 1 is not listed"),
        ("episode_index", [0, None, 2], "'episode_index' is None"),
        ("data/chunk_index", [0, 0, -1], "'data/chunk_index' is -1"),
        ("data/file_index", [0, 0, 5], "file-005"),
        ("tasks", [["a"], None, None], "the tasks must be sentences"),
        ("tasks", [[1], [2], [3]], "the tasks must be sentences"),
        (f"videos/{CAMERAS[0]}/from_timestamp", [0.0, float("nan"), 1.0], "not within a video"),
        (f"videos/{CAMERAS[0]}/to_timestamp", [0.2, 1e300, 1.0], "not within a video"),
        (f"videos/{CAMERAS[0]}/file_index", [0, 0, 9], "file-009"),
    ],
)
def test_a_wrong_list_of_episodes_raises(copied: Path, name: str, values: list[Any], message: str) -> None:
    change_table(copied / EPISODES, name, values)
    with pytest.raises(DataError, match=message):
        read_all(copied)


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("action", [[1.0]] * 18, "float32 values of shape"),
        ("action", [1.0] * 18, "float32 values of shape"),
        ("action", [[1.0, None]] * 18, "empty values"),
        ("action", ["a"] * 18, "no numbers"),
        (STATE, [[1.0] * 3] * 17 + [[1.0] * 4], "float32 values of shape"),
        ("episode_index", [2] * 18, "episode 0 has 0 rows"),
        ("episode_index", [*range(18)], "rows"),
        ("episode_index", [1, 0] * 9, "not in the order"),
    ],
)
def test_a_wrong_column_raises(copied: Path, name: str, values: list[Any], message: str) -> None:
    change_table(copied / DATA, name, values)
    with pytest.raises(DataError, match=message):
        read_all(copied)


def test_a_missing_column_raises(copied: Path) -> None:
    path = copied / DATA
    pq.write_table(pq.read_table(path).drop_columns(["action"]), path)
    with pytest.raises(DataError, match="no column 'action'"):
        read_all(copied)


def test_check_reports_what_is_wrong(copied: Path) -> None:
    change_table(copied / DATA, "next.reward", pa.array([0.0] * 17 + [float("nan")], pa.float32()))
    change_table(copied / DATA, "frame_index", pa.array([3] * 18))
    change_info(copied, lambda info: info.update(fps=24))
    with open(copied / VIDEO, "r+b") as file:
        file.seek(400)
        file.write(bytes(300))
    problems = "\n".join(check(copied))
    for part in ("'next.reward' is not finite in 1 places", "'frame_index' does not count", "'timestamp' does not fit"):
        assert part in problems
    assert "the mean of 'frame_index' in meta/stats.json differs" in problems
    assert CAMERAS[0] in problems


def test_pictures_of_another_size_raise(copied: Path) -> None:
    change_info(copied, lambda info: info["features"][CAMERAS[0]].update(shape=[64, 32, 3]))
    with pytest.raises(DataError, match="32 × 32 pixels, not 64 × 32"):
        read_all(copied)


def test_pictures_need_limited_memory(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("frobs_data.budgets").budgets.BUDGET, "bytes of decoded pictures in memory", 1000)
    with pytest.raises(DataError, match="more than 1,000 bytes"):
        read_all(copied)


def test_a_start_state_is_never_unpickled(copied: Path) -> None:
    np.save(copied / FILES[4], np.array([{"a": 1}], object))
    with pytest.raises(DataError, match="missing or damaged"):
        Dataset(copied).start_state(1)


def test_a_table_with_huge_values_is_not_decompressed(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(
        __import__("frobs_data.budgets").budgets.BUDGET, "bytes of a metadata file, decompressed", 200_000
    )
    pq.write_table(pa.table({"task_index": [0, 1], "task": ["a" * 300_000, "b"]}), copied / "meta/tasks.parquet")
    with pytest.raises(DataError, match="the limit is 200,000"):
        Dataset(copied)


@pytest.mark.parametrize(
    "columns",
    [
        [("task_index", [0, None]), ("task", ["a", "b"])],
        [("task_index", ["x", "y"]), ("task", ["a", "b"])],
        [("task_index", [0, 1])],
        [("task_index", [0, 1]), ("task", [["a", "b"], ["c"]])],
        [("task_index", [0, 1]), ("task", ["a", "b"]), ("task", ["a", "b"])],
    ],
)
def test_wrong_sentences_raise_one_clear_line(copied: Path, columns: list[tuple[str, list[Any]]]) -> None:
    table = pa.Table.from_arrays([pa.array(values) for _, values in columns], [name for name, _ in columns])
    pq.write_table(table, copied / "meta/tasks.parquet")
    with pytest.raises(DataError, match=r"tasks\.parquet"):
        Dataset(copied)


def test_a_set_without_frobs_settings_is_read(tmp_path: Path) -> None:
    folder = make_set(tmp_path / "set")
    shutil.rmtree(folder / "meta/frobs")
    dataset = Dataset(folder)
    assert dataset.settings is None
    assert dataset.start_state(0) is None


def test_features_that_are_not_read_are_left_alone(copied: Path, tmp_path: Path) -> None:
    path = copied / DATA
    table = pq.read_table(path)
    said = pa.array([[{"role": "user", "content": "Lift."}]] * len(table))
    pq.write_table(table.append_column("language_events", said), path)
    change_info(
        copied,
        lambda info: info["features"].update(
            language_events={"dtype": "language", "shape": [1], "names": None},
            depth={"dtype": "video", "shape": [32, 32, 1], "names": None},
        ),
    )
    read_all(copied)
    assert check(copied) == []
    with pytest.raises(DataError, match=r"language_events, depth cannot be copied.*lerobot-edit-dataset"):
        merge([copied, copied], tmp_path / "merged")


def test_long_texts_that_repeat_share_their_memory(copied: Path) -> None:
    text, repeats = "a" * 100_000, 7_000
    repeated = pa.DictionaryArray.from_arrays(np.zeros(3 * repeats, np.int32), [text])
    change_table(copied / EPISODES, "tasks", pa.ListArray.from_arrays(repeats * np.arange(4, dtype=np.int32), repeated))
    assert (copied / EPISODES).stat().st_size < 500_000
    before = pa.default_memory_pool().max_memory()
    dataset = Dataset(copied)
    assert dataset.episodes[2].tasks == (text,) * repeats
    assert dataset.episodes[2].tasks[0] is dataset.episodes[0].tasks[-1]
    assert pa.default_memory_pool().max_memory() < max(before, 100_000_000)


@pytest.mark.parametrize(
    ("place", "name", "values"),
    [
        (DATA, "task_index", [9] * 18),
        (DATA, "task_index", [-1] * 18),
        (EPISODES, "stats/action/min", ["x", "y", "z"]),
        (EPISODES, "stats/action/min", [[1.0], [1.0, 2.0], None]),
        (EPISODES, "stats/action/count", [[0], [-1], [5]]),
    ],
)
def test_wrong_values_that_are_copied_are_errors_or_left_out(
    copied: Path, tmp_path: Path, place: str, name: str, values: list[Any]
) -> None:
    change_table(copied / place, name, values)
    if place == DATA:
        with pytest.raises(DataError, match="task_index without a sentence"):
            merge([copied, copied], tmp_path / "merged")
    else:
        merge([copied, copied], tmp_path / "merged")
        assert check(tmp_path / "merged") == ["meta/stats.json has no valid min of 'action'"]
