"""Merging, splitting and exporting data sets, and the commands."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from made_sets import CAMERAS, TASKS, episode, make_set
from typer.testing import CliRunner

from frobs_cli.program import program
from frobs_core.util.errors import ConfigurationError
from frobs_data import DataError, Dataset, DatasetWriter, Feature, check, merge, split


def assert_equal(folder: Path, numbers: list[int]) -> None:
    dataset = Dataset(folder)
    assert check(folder) == []
    assert [found.tasks for found in dataset.episodes] == [(TASKS[number % 2],) for number in numbers]
    for index, number in enumerate(numbers):
        given = episode(number, 5 + number % 4, 2)
        np.testing.assert_array_equal(dataset.columns(["action"], [index])["action"], given["action"])
        for key in CAMERAS:
            assert np.abs(dataset.pictures(index, key).astype(int) - given[key]).mean() < 4
        assert (dataset.start_state(index) or {})["time"] == number


def test_merging_keeps_all_episodes(recorded: Path, tmp_path: Path) -> None:
    part = split(recorded, {"part": [1]}, tmp_path)["part"]
    merged = merge([recorded, part.folder, recorded], tmp_path / "merged")
    assert merged.settings == {"environment": "frobs/Test-v0"}
    assert_equal(tmp_path / "merged", [0, 1, 2, 1, 0, 1, 2])


def test_sets_may_list_their_features_in_another_order(recorded: Path, copied: Path, tmp_path: Path) -> None:
    path = copied / "meta/info.json"
    info = json.loads(path.read_text())
    path.write_text(json.dumps({**info, "features": dict(reversed(info["features"].items()))}))
    merge([recorded, copied], tmp_path / "merged")
    assert_equal(tmp_path / "merged", [0, 1, 2, 0, 1, 2])


def test_sets_that_differ_are_not_merged(recorded: Path, tmp_path: Path) -> None:
    other = make_set(tmp_path / "other", cameras=1)
    with pytest.raises(DataError, match="other features"):
        merge([recorded, other], tmp_path / "merged")
    with pytest.raises(DataError, match="not empty"):
        merge([recorded], other)
    (tmp_path / "file").touch()
    with pytest.raises(DataError, match="not a folder"):
        merge([recorded], tmp_path / "file")
    with pytest.raises(DataError, match=r"cannot be written: Not a directory\.$"):
        split(recorded, {"a": [0]}, tmp_path / "file")


def test_a_damaged_source_leaves_nothing_behind(recorded: Path, copied: Path, tmp_path: Path) -> None:
    data = next((copied / "data").rglob("*.parquet"))
    data.write_bytes(data.read_bytes()[:100])
    with pytest.raises(DataError):
        merge([recorded, copied], tmp_path / "merged")
    assert not (tmp_path / "merged").exists()
    merge([recorded], tmp_path / "merged")


def test_splitting_takes_fractions_or_episodes(recorded: Path, tmp_path: Path) -> None:
    split(recorded, {"a": 0.67, "b": 0.33}, tmp_path / "fractions")
    assert_equal(tmp_path / "fractions/a", [0, 1])
    assert_equal(tmp_path / "fractions/b", [2])
    split(recorded, {"a": [2, 0]}, tmp_path / "episodes")
    assert_equal(tmp_path / "episodes/a", [2, 0])


@pytest.mark.parametrize("parts", [{"a": 0.7, "b": 0.7}, {"a": [3]}, {"a": 0.0}, {"../a": [0]}, {"a": float("nan")}])
def test_a_wrong_split_raises(recorded: Path, tmp_path: Path, parts: dict[str, float]) -> None:
    with pytest.raises(ConfigurationError, match="parts"):
        split(recorded, parts, tmp_path)


@pytest.mark.needs("minari", "h5py")
def test_minari_loads_an_exported_set(recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import minari

    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    result = CliRunner().invoke(
        program(), ["data", "export", str(recorded), "--to", "minari", "--name", "frobs/test-v0"]
    )
    assert result.exit_code == 0, result.output
    loaded = minari.load_dataset("frobs/test-v0")
    assert (loaded.total_episodes, loaded.total_steps) == (3, 18)
    for number, found in enumerate(loaded.iterate_episodes()):
        given = episode(number, 5 + number % 4)
        np.testing.assert_array_equal(found.actions, given["action"])
        np.testing.assert_array_equal(found.observations[:-1], given["observation.state"])
        np.testing.assert_allclose(found.rewards, given["next.reward"])


@pytest.mark.needs("minari", "h5py")
def test_minari_receives_actions_of_one_element(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import minari

    from frobs_data.edit import export_minari

    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    features = {"observation.state": Feature("float32", (2,)), "action": Feature("int64", (1,))}
    with DatasetWriter(tmp_path / "set", 25, features) as writer:
        writer.add({"observation.state": np.zeros((4, 2)), "action": np.arange(4)}, "")
    export_minari(tmp_path / "set", "frobs/one-v0")
    (found,) = minari.load_dataset("frobs/one-v0").iterate_episodes()
    np.testing.assert_array_equal(found.actions, np.arange(4.0)[:, None])
    with DatasetWriter(tmp_path / "blind", 25, {"action": Feature("float32", (2,))}) as writer:
        writer.add({"action": np.zeros((4, 2))}, "")
    with pytest.raises(DataError, match="Minari needs episodes with"):
        export_minari(tmp_path / "blind", "frobs/blind-v0")


def test_numbers_that_are_not_finite_are_shown(copied: Path, tmp_path: Path) -> None:
    path = next((copied / "data").rglob("*.parquet"))
    table = pq.read_table(path)
    actions = pa.array([[np.nan, 1.0]] * len(table), pa.list_(pa.float32()))
    pq.write_table(table.set_column(table.schema.get_field_index("action"), "action", actions), path)
    picture = tmp_path / "a.png"
    result = CliRunner().invoke(program(), ["data", "show", str(copied), "--picture", str(picture)])
    assert result.exit_code == 0, result.output
    assert picture.is_file()


def test_show_prints_a_summary_and_draws(recorded: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(program(), ["data", "show", str(recorded), "--picture", str(tmp_path / "a.png")])
    assert result.exit_code == 0, result.output
    for part in ("shortest", "100.0 %", "32 × 32 × 3", "Lift the cube."):
        assert part in result.output
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    shown = json.loads(CliRunner().invoke(program(), ["data", "show", str(recorded), "--json"]).output)
    assert shown["features"][1]["name"] == "action"
    assert shown["success_rate"] == 1.0
    assert shown["frames"] == 18


def test_commands_edit_sets(recorded: Path, tmp_path: Path) -> None:
    def run(*arguments: str | Path) -> str:
        result = CliRunner().invoke(program(), ["data", *map(str, arguments)])
        assert result.exit_code == 0, result.output
        return result.output

    parts = tmp_path / "parts"
    assert "2 episodes, 11 frames" in run("split", recorded, "--part", "a=0-1", "--part", "b=2", "--out", parts)
    assert "3 episodes, 18 frames" in run("merge", parts / "b", parts / "a", "--out", tmp_path / "merged")
    assert "no problems" in run("check", tmp_path / "merged")
    (tmp_path / "merged/meta/stats.json").write_text("{}")
    result = CliRunner().invoke(program(), ["data", "check", str(tmp_path / "merged"), "--json"])
    assert result.exit_code == 1
    assert "no valid min of 'action'" in str(json.loads(result.stdout)["problems"])


@pytest.mark.parametrize("part", ["a", "a=", "a=x", "a=1-x", "a=3-2", f"a={'9' * 5000}", "a=0.x"])
def test_a_wrong_part_is_an_error(recorded: Path, tmp_path: Path, part: str) -> None:
    result = CliRunner().invoke(program(), ["data", "split", str(recorded), "--part", part, "--out", str(tmp_path)])
    assert result.exit_code != 0
    assert isinstance(result.exception, SystemExit | ConfigurationError)


def test_parts_with_the_same_name_are_an_error(recorded: Path, tmp_path: Path) -> None:
    parts = ["--part", "a=0.3", "--part", "a=0.7"]
    result = CliRunner().invoke(program(), ["data", "split", str(recorded), *parts, "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert "each part must have a name of its own" in result.output
    assert not (tmp_path / "out").exists()
