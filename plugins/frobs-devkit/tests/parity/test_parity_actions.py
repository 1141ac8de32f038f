from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import frobs_core  # noqa: F401 - registers the IDs
from frobs_core.util.errors import ConfigurationError
from frobs_devkit.parity import ActionFile, read_actions
from frobs_devkit.parity.actions import check_actions, smooth_actions

ID = "frobs/Irb120Reach-v0"


@pytest.mark.parametrize("suffix", [".json", ".npz"])
def test_a_file_is_read_as_it_was_written(suffix: str, tmp_path: Path) -> None:
    file = ActionFile(
        id=ID, seed=7, actions=np.random.default_rng(0).uniform(-1, 1, (5, 6)), controller="joint_position"
    )
    path = tmp_path / f"actions{suffix}"
    file.write(path)
    again = read_actions(path)
    assert (again.id, again.seed, again.controller) == (file.id, file.seed, file.controller)
    assert (again.actions == file.actions).all()
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_another_ending_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"suffix \.json or \.npz"):
        read_actions(tmp_path / "actions.csv")
    with pytest.raises(ConfigurationError, match=r"suffix \.json or \.npz"):
        ActionFile(id=ID, seed=0, actions=np.zeros((1, 6))).write(tmp_path / "actions.csv")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[0, 0]]", "missing from the file: id, seed, actions;"),
        ('{"id": "x", "actions": []}', "missing from the file: seed;"),
        ('{"id": "x", "seed": "one", "actions": [[0]]}', "not numbers"),
        ('{"id": "x", "seed": 0, "actions": [[0], [0, 1]]}', "not numbers"),
        ('{"id": "x", "seed": 0, "actions": [["a"]]}', "not numbers"),
        ("{", "not a valid action file"),
    ],
)
def test_a_damaged_file_is_refused(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "actions.json"
    path.write_text(text)
    with pytest.raises(ConfigurationError, match=message):
        read_actions(path)


def test_a_pickle_is_not_opened(tmp_path: Path) -> None:
    path = tmp_path / "actions.npz"
    np.savez(path, id=ID, seed=0, actions=np.array([object()], dtype=object))
    with pytest.raises(ConfigurationError, match="not a valid action file"):
        read_actions(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="the file does not exist"):
        read_actions(tmp_path / "none.json")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"actions": np.zeros((4, 5))}, r"shape \(4, 5\).*requires \('steps', 6\)"),
        ({"actions": np.zeros(6)}, r"shape \(6,\)"),
        ({"actions": np.zeros((0, 6))}, r"shape \(0, 6\)"),
        ({"actions": np.array([[0.0] * 6, [np.nan] * 6])}, "step 1 contains NaN"),
        ({"id": "frobs/Irb120ReachGoal-v0"}, "the actions are for 'frobs/Irb120ReachGoal-v0', not for"),
        ({"controller": "joint_velocity"}, "--controller joint_velocity"),
        ({"seed": -1}, "the seed must be at least 0, but it is -1"),
    ],
)
def test_actions_for_something_else_are_refused(changes: dict[str, Any], message: str) -> None:
    file = ActionFile(**{"id": ID, "seed": 0, "actions": np.zeros((4, 6)), **changes})
    env = gym.make(ID)
    try:
        with pytest.raises(ConfigurationError, match=message):
            check_actions(file, env.unwrapped, ID, "joint_delta_position", "a.json")  # type: ignore[arg-type]
    finally:
        env.close()


def test_smooth_actions_stay_inside_and_repeat() -> None:
    box = gym.spaces.Box(-1.0, 1.0, (6,))
    actions = smooth_actions(box, 50, 0)
    assert actions.shape == (50, 6)
    assert (np.abs(actions) <= 0.5).all()
    assert (actions == smooth_actions(box, 50, 0)).all()
    assert len({tuple(column) for column in actions.T.tolist()}) == 6
    discrete = gym.spaces.Discrete(5)
    assert all(discrete.contains(action) for action in smooth_actions(discrete, 20, 0))


def test_json_keeps_every_bit(tmp_path: Path) -> None:
    ActionFile(id=ID, seed=0, actions=np.array([[1.0 / 3.0]])).write(tmp_path / "a.json")
    assert json.loads((tmp_path / "a.json").read_text())["actions"] == [[1.0 / 3.0]]
