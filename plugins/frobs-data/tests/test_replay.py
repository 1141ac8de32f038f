"""Recorded episodes can be repeated exactly, and compared with another simulator."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from frobs_cli.program import program
from frobs_core.util.errors import UntrustedFileError
from frobs_data import DataError, Dataset, record, replay
from frobs_data.layout import SETTINGS_PATH, START_PATH


@pytest.fixture(scope="module")
def maze(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording in which the episodes end at different steps."""
    folder = tmp_path_factory.mktemp("maze") / "set"
    record("frobs/KobukiMaze-v0", "pretrained", episodes=6, num_envs=4, out=folder, max_episode_steps=152)
    return folder


@pytest.fixture
def copied(maze: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(maze, tmp_path / "set"))


def test_a_vector_recording_is_repeated_bit_for_bit(maze: Path) -> None:
    results = replay(maze)
    assert [result.frames for result in results] == [episode.length for episode in Dataset(maze).episodes]
    assert len({result.frames for result in results}) > 1
    assert [(result.difference, result.identical) for result in results] == [(0.0, True)] * 6
    assert [result.success for result in results] == [result.recorded_success for result in results]


@pytest.mark.parametrize("id", ["frobs/PandaPickAndPlace-v0", "frobs/PandaPushGoal-v0", "frobs/Irb120ReachDynamic-v0"])
def test_contacts_goals_and_moving_goals_are_repeated_bit_for_bit(id: str, tmp_path: Path) -> None:
    policy = "random" if "Reach" in id else "expert"
    record(id, policy, episodes=2, num_envs=2, out=tmp_path / "set", max_episode_steps=40)
    assert all(result.identical for result in replay(tmp_path / "set"))


def test_changed_numbers_are_found(copied: Path) -> None:
    path = copied / START_PATH.format(2)
    state = np.load(path)
    state["simulation/state"] += 1e-6
    np.save(path, state)
    [result] = replay(copied, [2])
    assert not result.identical
    assert result.difference > 0.0


@pytest.mark.needs("pybullet")
def test_another_simulator_begins_at_the_same_positions(tmp_path: Path) -> None:
    record("frobs/PandaPickAndPlace-v0", episodes=1, out=tmp_path / "set")
    [result] = replay(tmp_path / "set", simulator="pybullet")
    assert result.drift is not None
    assert result.drift.keys() == {"tool", "cube"}
    assert result.frames == 100
    assert 0.0 < result.drift["tool"].largest < 0.02
    assert not result.identical


def test_sets_of_other_programs_say_what_is_missing(copied: Path) -> None:
    shutil.rmtree(copied / "meta" / "frobs")
    with pytest.raises(DataError, match=r"settings\.json is missing"):
        replay(copied)


def test_a_missing_or_foreign_start_state_is_one_line(copied: Path) -> None:
    (copied / START_PATH.format(0)).unlink()
    with pytest.raises(DataError, match="the start state of episode 0 is missing"):
        replay(copied, [0])
    np.save(copied / START_PATH.format(1), np.zeros(1, [("other", float)]))
    with pytest.raises(DataError, match="start state of episode 1 does not fit"):
        replay(copied, [1])
    with pytest.raises(DataError, match="there is no episode 9"):
        replay(copied, [9])


def test_settings_of_strangers_name_no_files_or_modules(copied: Path) -> None:
    path = copied / SETTINGS_PATH
    settings = json.loads(path.read_text())
    path.write_text(json.dumps({**settings, "environment_kwargs": {"robot": "/etc/passwd"}}))
    with pytest.raises(UntrustedFileError, match="trust"):
        replay(copied)
    path.write_text(json.dumps({**settings, "environment": "os:Env-v0"}))
    with pytest.raises(UntrustedFileError, match="imports the module 'os'"):
        replay(copied)
    path.write_text(json.dumps({**settings, "environment": 3}))
    with pytest.raises(DataError, match="must be an ID"):
        replay(copied)


def test_the_command_reports_each_episode(maze: Path) -> None:
    done = CliRunner().invoke(program(), ["data", "replay", str(maze), "--episode", "1", "--json"])
    assert done.exit_code == 0
    [result] = json.loads(done.stdout)
    assert result["episode"] == 1
    assert result["identical"]
