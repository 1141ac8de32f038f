"""Recordings contain what the policy saw and did, whole and reproducible."""

from __future__ import annotations

import dataclasses
import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_core.util.errors import FrobsError
from frobs_data import DataError, Dataset, record

REACH = "frobs/Irb120Reach-v0"
MAZE = "frobs/KobukiMaze-v0"
CUBE = "frobs/PandaPickAndPlace-v0"
STATES = ("observation.state", "observation.environment_state")


def episode_seeds(dataset: Dataset) -> list[int]:
    return [int(dataset.columns(["seed"], [index])["seed"][0]) for index in range(len(dataset.episodes))]


def test_vectors_are_those_that_a_single_environment_returns(tmp_path: Path) -> None:
    dataset = record(REACH, "random", episodes=5, num_envs=3, seed=7, out=tmp_path / "set", max_episode_steps=6)
    assert sorted(episode_seeds(dataset)) == [7, 8, 9, 10, 11]
    env = gym.make(f"frobs_core:{REACH}")
    names = [name for key in STATES for name in dataset.features[key].names]
    terms = env.unwrapped.observations.terms  # type: ignore[attr-defined]
    assert names == [f"{name}_{i}" for name, term in terms.items() for i in range(len(term.low))]
    for index, seed in enumerate(episode_seeds(dataset)):
        columns = dataset.columns([*STATES, "action", "next.reward", "next.done"], [index])
        observation, _ = env.reset(seed=seed)
        for t in range(6):
            recorded = np.concatenate([columns[key][t] for key in STATES])
            np.testing.assert_array_equal(recorded, observation)
            observation, reward, *_ = env.step(columns["action"][t])
            assert columns["next.reward"][t] == np.float32(reward)
        assert columns["next.done"].tolist() == [False] * 5 + [True]
    env.close()


def test_elements_have_names_and_settings_describe_the_environment(tmp_path: Path) -> None:
    dataset = record(CUBE, episodes=1, out=tmp_path / "set", max_episode_steps=5, seed=3)
    assert dataset.features["action"].names == ("x", "y", "z", "gripper")
    assert dataset.features[STATES[0]].names[-1] == "gripper_opening"
    assert "goal_offset_2" in dataset.features[STATES[1]].names
    assert dataset.tasks == ["Pick up the cube and bring it to the goal."]
    assert dataset.robot_type == "panda"
    assert dataset.fps == 25
    assert dataset.columns(["phase"])["phase"].tolist()[0] == 0
    settings = dataset.settings
    assert settings is not None
    assert settings["environment_kwargs"] == {"max_episode_steps": 5}
    assert [entry["seed"] for entry in settings["recordings"]] == [3]
    joints = record(REACH, "random", episodes=1, out=tmp_path / "joints", max_episode_steps=2)
    assert joints.features["action"].names == tuple(f"joint_{i}" for i in range(1, 7))


def test_each_environment_records_its_share_of_short_and_long_episodes(tmp_path: Path) -> None:
    dataset = record(MAZE, "pretrained", episodes=7, num_envs=3, out=tmp_path / "set", max_episode_steps=152)
    assert sorted(episode_seeds(dataset)) == list(range(7))
    lengths = [episode.length for episode in dataset.episodes]
    assert len(set(lengths)) > 1
    ended = dataset.columns(["next.done", "next.terminated"])
    assert ended["next.done"].sum() == 7
    assert ended["next.terminated"].sum() == sum(length < 152 for length in lengths)


def test_only_successful_episodes_can_be_kept(tmp_path: Path) -> None:
    attempts: list[tuple[int, int]] = []
    dataset = record(
        CUBE,
        episodes=2,
        num_envs=2,
        out=tmp_path / "set",
        success_only=True,
        max_episode_steps=42,
        on_progress=lambda kept, tried: attempts.append((kept, tried)),
    )
    columns = dataset.columns(["next.done", "next.success"])
    assert columns["next.success"][columns["next.done"]].tolist() == [True, True]
    assert attempts[-1][0] == 2
    assert attempts[-1][1] > 2


def test_a_policy_that_never_succeeds_ends_with_an_error(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"only 0 of 1[0-9]+ episodes were successful"):
        record(REACH, "random", episodes=1, out=tmp_path / "set", success_only=True, max_episode_steps=1)


def test_append_continues_the_seeds(tmp_path: Path) -> None:
    record(REACH, "random", episodes=2, out=tmp_path / "set", max_episode_steps=3, seed=5)
    with pytest.raises(DataError, match="not empty"):
        record(REACH, "random", episodes=1, out=tmp_path / "set", max_episode_steps=3)
    with pytest.raises(DataError, match="environment_kwargs"):
        record(REACH, "random", episodes=1, out=tmp_path / "set", max_episode_steps=4, append=True)
    dataset = record(REACH, "random", episodes=2, out=tmp_path / "set", max_episode_steps=3, append=True)
    assert episode_seeds(dataset) == [5, 6, 7, 8]
    actions = dataset.columns(["action"])["action"].reshape(4, 3, 6)
    assert len(np.unique(actions[:, 0], axis=0)) == 4
    assert dataset.settings is not None
    assert len(dataset.settings["recordings"]) == 2


def test_other_environments_are_rejected(tmp_path: Path) -> None:
    with pytest.raises(FrobsError, match="only FRobs environments"):
        record("CartPole-v1", "random", episodes=1, out=tmp_path / "set")


@pytest.mark.parametrize(
    ("camera", "size", "message"), [("nowhere", (48, 64), "named 'nowhere'"), ("overview", (0, 64), "size is")]
)
def test_a_camera_that_cannot_be_recorded_leaves_no_folder(
    tmp_path: Path, camera: str, size: tuple[int, int], message: str
) -> None:
    options: dict[str, Any] = {"cameras": [camera], "size": size, "simulator": "pybullet"}
    with pytest.raises(FrobsError, match=message):
        record(REACH, "random", episodes=1, out=tmp_path / "set", **options)
    assert not (tmp_path / "set").exists()


@pytest.mark.filterwarnings("ignore:.*precision lowered")
def test_actions_that_a_wrapper_changes_are_not_recorded(tmp_path: Path) -> None:
    wrapper = "{name: 'gymnasium.wrappers.vector:RescaleAction', min_action: -0.1, max_action: 0.1}"
    with pytest.raises(FrobsError, match="a wrapper changes the actions"):
        record(REACH, "random", episodes=1, out=tmp_path / "set", settings=[f"wrappers=[{wrapper}]"])


@pytest.mark.needs("rendering")
def test_cameras_are_recorded_beside_the_observation(tmp_path: Path) -> None:
    wrist = {"link": "panda_link8", "pos": [0, 0.05, 0], "target": [0, 0, 0.2], "fov_y": 60, "size": [32, 48]}
    cameras: dict[str, Any] = {"front": {"camera": "overview", "markers": True}, "wrist": wrist}
    dataset = record(
        CUBE, episodes=3, num_envs=2, out=tmp_path / "set", cameras=cameras, size=(48, 64), max_episode_steps=4
    )
    seen = {"front": {"camera": "overview", "markers": True, "size": [48, 64]}}
    env: Any = gym.make(f"frobs_core:{CUBE}").unwrapped
    for index, seed in enumerate(episode_seeds(dataset)):
        env.reset(seed=seed)
        pictures = dataset.pictures(index, "observation.images.front")
        assert dataset.pictures(index, "observation.images.wrist").shape == (4, 32, 48, 3)
        for picture, action in zip(pictures, dataset.columns(["action"], [index])["action"], strict=True):
            difference = picture.astype(float) - env.read_terms(seen)["front"]
            assert np.abs(difference).mean() < 8.0  # the videos are compressed
            env.step(action)
    env.close()


@pytest.mark.needs("rendering")
def test_added_cameras_do_not_replace_those_of_the_id(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reach, eye = gym.spec(REACH), {"pos": [1.0, 0.0, 1.0], "target": [0.0, 0.0, 0.3]}
    seen = {"eye": {"type": "camera", "camera": "eye", "size": [32, 32]}}
    kwargs = {**reach.kwargs, "cameras": {"eye": eye}, "observations": seen}
    changed = dataclasses.replace(reach, id="frobs/Seen-v0", kwargs=kwargs)
    monkeypatch.setitem(gym.registry, "frobs/Seen-v0", changed)
    dataset = record(
        "frobs/Seen-v0", "random", episodes=1, out=tmp_path / "set", cameras={"other": eye}, max_episode_steps=2
    )
    assert dataset.info.cameras == ["observation.images.eye", "observation.images.other"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_recording_keeps_whole_episodes(number: signal.Signals, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "frobs_cli", "record", REACH, "--policy", "random", "--episodes", "100000"]
    process = subprocess.Popen(
        [*command, "--num-envs", "2", "--out", str(tmp_path / "set")], stderr=subprocess.PIPE, text=True
    )
    info = tmp_path / "set" / "meta" / "info.json"
    while not info.exists() or json.loads(info.read_text())["total_episodes"] == 0:
        assert process.poll() is None
        time.sleep(0.05)
    process.send_signal(number)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    dataset = Dataset(tmp_path / "set")
    assert f"keeps {len(dataset.episodes):,} whole episodes" in errors
    assert {episode.length for episode in dataset.episodes} == {50}
