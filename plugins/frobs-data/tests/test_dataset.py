"""Writing data sets and reading them."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_sets import CAMERAS, FPS, TASKS, add_episodes, episode, features, make_set

from frobs_core.util.errors import ConfigurationError
from frobs_data import DataError, Dataset, DatasetWriter, Feature, check


def assert_content(folder: Path, numbers: list[int], cameras: int = 0) -> None:
    dataset = Dataset(folder)
    assert len(dataset.episodes) == len(numbers)
    names = ["observation.state", "action", "next.reward", "next.success"]
    for index, number in enumerate(numbers):
        columns = dataset.columns(names, [index])
        given = episode(number, 5 + number % 4, cameras)
        for name, values in columns.items():
            np.testing.assert_array_equal(values, given[name])
            assert values.dtype == given[name].dtype
        for key in CAMERAS[:cameras]:
            difference = dataset.pictures(index, key).astype(int) - given[key]
            assert np.abs(difference).mean() < 4
        assert dataset.episodes[index].tasks == (TASKS[number % 2],)
        assert (dataset.start_state(index) or {})["time"] == number


def test_what_is_written_is_read(recorded: Path) -> None:
    assert_content(recorded, [0, 1, 2], cameras=2)
    dataset = Dataset(recorded)
    assert (dataset.fps, dataset.robot_type, dataset.settings) == (FPS, "arm", {"environment": "frobs/Test-v0"})
    assert dataset.features["observation.state"] == features()["observation.state"]
    assert dataset.columns(["frame_index"], [2, 0])["frame_index"].tolist() == [*range(7), *range(5)]
    assert check(recorded) == []


def test_closing_joins_the_files(recorded: Path) -> None:
    names = sorted(path.relative_to(recorded).as_posix() for path in recorded.rglob("*.*") if path.is_file())
    assert names == [
        "data/chunk-000/file-000.parquet",
        "meta/episodes/chunk-000/file-000.parquet",
        "meta/frobs/settings.json",
        *(f"meta/frobs/start/episode-00000{index}.npy" for index in range(3)),
        "meta/info.json",
        "meta/stats.json",
        "meta/tasks.parquet",
        *(f"videos/{camera}/chunk-000/file-000.mp4" for camera in CAMERAS),
    ]


def test_lerobot_doctor_finds_nothing_wrong(recorded: Path) -> None:
    done = subprocess.run(
        [Path(sys.executable).with_name("lerobot-doctor"), "check", recorded], text=True, capture_output=True
    )
    assert "PASS" in done.stdout
    assert "FAIL" not in done.stdout


def test_the_set_is_complete_after_each_episode(tmp_path: Path) -> None:
    folder = tmp_path / "set"
    with DatasetWriter(folder, FPS, features(1), "arm", codec="libx264") as writer:
        for number in range(3):
            add_episodes(writer, [number], 1)
            wait_for_episodes(folder, number + 1)
            assert_content(folder, list(range(number + 1)), cameras=1)
            assert check(folder) == []
    assert_content(folder, [0, 1, 2], cameras=1)


def wait_for_episodes(folder: Path, count: int) -> None:
    end = time.monotonic() + 60
    while json.loads((folder / "meta/info.json").read_text())["total_episodes"] < count:
        assert time.monotonic() < end
        time.sleep(0.01)


def test_size_limits_begin_new_files(tmp_path: Path) -> None:
    folder = make_set(tmp_path / "set", 6, cameras=2, data_mb=0.001, video_mb=0.002)
    dataset = Dataset(folder)
    assert len({episode.place for episode in dataset.episodes}) > 1
    for key in CAMERAS:
        places = [episode.videos[key].place for episode in dataset.episodes]
        assert 1 < len(set(places)) < 6
        assert places == sorted(places)
    assert_content(folder, list(range(6)), cameras=2)
    assert check(folder) == []


def test_appending_continues_the_set(tmp_path: Path) -> None:
    folder = make_set(tmp_path / "set", 2, cameras=1)
    for numbers in ([2], [3, 4]):
        with DatasetWriter(folder, FPS, features(1), "arm", codec="libx264", append=True) as writer:
            add_episodes(writer, numbers, 1)
    assert_content(folder, [0, 1, 2, 3, 4], cameras=1)
    assert check(folder) == []
    assert Dataset(folder).settings == {"environment": "frobs/Test-v0"}


def test_many_waiting_episodes_share_files(tmp_path: Path) -> None:
    folder = make_set(tmp_path / "set", 150)
    assert_content(folder, list(range(150)))
    assert check(folder) == []


def test_pictures_may_come_one_by_one(tmp_path: Path) -> None:
    folder = tmp_path / "set"
    with DatasetWriter(folder, FPS, features(1), "arm", codec="libx264") as writer:
        given = episode(1, 6, 1)
        forgotten, clip = writer.clip(CAMERAS[0]), writer.clip(CAMERAS[0])
        for picture in given[CAMERAS[0]]:
            forgotten.append(picture[::-1])
            clip.append(picture)
        forgotten.discard()
        writer.add({**given, CAMERAS[0]: clip}, TASKS[1], {"time": np.array([1.0])})
        writer.add({**given, CAMERAS[0]: iter(given[CAMERAS[0]])}, TASKS[1], {"time": np.array([1.0])})
    assert_content(folder, [1, 1], cameras=1)


def test_av1_is_the_usual_codec(tmp_path: Path) -> None:
    shape = (64, 64, 3)  # SVT-AV1 encodes no smaller pictures
    with DatasetWriter(tmp_path / "set", FPS, {"observation.images.a": Feature("video", shape)}) as writer:
        writer.add({"observation.images.a": np.full((4, *shape), 90, np.uint8)}, "")
    dataset = Dataset(tmp_path / "set")
    assert dataset.info.codecs == {"observation.images.a": "av1"}
    assert np.abs(dataset.pictures(0, "observation.images.a").astype(int) - 90).max() < 4


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"action": np.zeros((4, 2))}, "action is"),
        ({"action": np.zeros((5, 3))}, "action is"),
        ({"action": np.full((5, 2), np.nan)}, "not finite"),
        ({"other": np.zeros(5)}, "no parameter 'other'"),
    ],
)
def test_an_episode_must_fit_the_features(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    with DatasetWriter(tmp_path / "set", FPS, features()) as writer:
        with pytest.raises(ConfigurationError, match=message):
            writer.add({**episode(0, 5), **change}, "")
        with pytest.raises(ConfigurationError, match="start_state"):
            writer.add(episode(0, 5), "", {"object": np.array([object()])})
    assert len(Dataset(tmp_path / "set").episodes) == 0


@pytest.mark.parametrize(
    "feature", [Feature("video", (31, 32, 3)), Feature("video", (32, 32, 1)), Feature("string", (1,))]
)
def test_a_feature_that_cannot_be_stored_raises(tmp_path: Path, feature: Feature) -> None:
    with pytest.raises(ConfigurationError, match="bad"):
        DatasetWriter(tmp_path / "set", FPS, {"bad": feature})


def test_a_used_folder_is_not_overwritten(recorded: Path, tmp_path: Path) -> None:
    with pytest.raises(DataError, match="not empty"):
        DatasetWriter(recorded, FPS, features(2))
    with pytest.raises(DataError, match="other features"):
        DatasetWriter(recorded, FPS, features(1), "arm", append=True)
    with pytest.raises(DataError, match="other robot_type"):
        DatasetWriter(recorded, FPS, features(2), "leg", append=True)


def test_a_full_disk_keeps_the_whole_episodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "set"
    writer = DatasetWriter(folder, FPS, features(), "arm")
    add_episodes(writer, [0])
    wait_for_episodes(folder, 1)

    def fail(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("frobs_data.writer.write_table", fail)
    add_episodes(writer, [1])
    with pytest.raises(DataError, match=r"No space left on device; the data set keeps 1 whole episodes"):
        writer.close()
    with pytest.raises(DataError, match="No space left"):
        add_episodes(writer, [2])
    assert_content(folder, [0])


def test_pictures_may_be_listed_with_their_channels_first(copied: Path) -> None:
    path = copied / "meta/info.json"
    info = json.loads(path.read_text())
    info["features"][CAMERAS[0]] |= {"shape": [3, 32, 64], "names": ["channels", "height", "width"]}
    path.write_text(json.dumps(info))
    feature = Dataset(copied).features[CAMERAS[0]]
    assert (feature.shape, feature.names) == ((32, 64, 3), ("height", "width", "channels"))
    info["features"][CAMERAS[0]]["shape"] = [3, 32, 32]
    path.write_text(json.dumps(info))
    assert_content(copied, [0, 1, 2], cameras=2)


def test_a_relative_folder_may_contain_a_colon(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    make_set(Path("14:30"), 2, cameras=1)
    assert_content(Path("14:30"), [0, 1], cameras=1)


def test_one_writer_at_a_time_writes_a_set(tmp_path: Path) -> None:
    folder = tmp_path / "set"
    with DatasetWriter(folder, FPS, features(), "arm") as writer:
        add_episodes(writer, [0])
        with pytest.raises(DataError, match="another writer has it open"):
            DatasetWriter(folder, FPS, features(), "arm", append=True)
        add_episodes(writer, [1])
    with DatasetWriter(folder, FPS, features(), "arm", append=True) as writer:
        add_episodes(writer, [2])
    assert_content(folder, [0, 1, 2])
