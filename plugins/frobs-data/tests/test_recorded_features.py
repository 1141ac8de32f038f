"""Tasks say what to do, and their terms say who can measure them."""

from __future__ import annotations

import gymnasium as gym
import pytest

from frobs_core import plugins
from frobs_core.plugins.records import TaskRecord
from frobs_core.util.errors import ConfigurationError
from frobs_data.recorded_features import STATE, Vectors, action_names, read_cameras

TASKS = [
    record
    for record in plugins.records("task").values()
    if record.entry_point.partition(".")[0]
    in ("frobs_tasks_manipulation", "frobs_tasks_navigation", "frobs_tasks_reach")
]


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.name)
def test_every_task_has_an_instruction(task: TaskRecord) -> None:
    instruction = task.load().instruction
    assert instruction[0].isupper()
    assert instruction.endswith(".")


@pytest.mark.parametrize(
    ("id", "measured"),
    [
        ("frobs/PandaPickAndPlace-v0", {"tcp_position", "tcp_velocity", "gripper_opening"}),
        ("frobs/Irb120Reach-v0", {"joint_positions", "tcp_position"}),
        ("frobs/KobukiMaze-v0", {"nearness"}),
    ],
)
def test_the_state_consists_of_what_the_robot_measures(id: str, measured: set[str]) -> None:
    env = gym.make(f"frobs_core:{id}", observations={"last": {"type": "previous_action"}})
    names = Vectors(env.unwrapped.observations).features[STATE].names  # type: ignore[attr-defined]
    env.close()
    assert {name.rstrip("0123456789").rstrip("_") for name in names} == {*measured, "last"}


def test_elements_of_two_arms_have_different_names() -> None:
    arms = {"left": "irb120", "right": {"robot": "irb120", "pose": {"pos": [1.0, 0.0, 0.0]}}}
    env = gym.make("frobs_core:frobs/Env-v0", task="reach_together", robots=arms, controller="joint_position")
    names = action_names(env.unwrapped.control)  # type: ignore[attr-defined]
    env.close()
    assert len(set(names)) == 12
    assert names[0] == "left/all/joint_1"


def test_settings_of_cameras_are_split() -> None:
    wrist = {"link": "hand", "fov_y": 60, "size": [10, 20]}
    views, added = read_cameras({"a": None, "b": {"camera": "overview"}, "wrist": wrist}, (96, 64))
    assert views["a"] == {"camera": "a", "size": [96, 64]}
    assert views["b"] == {"camera": "overview", "size": [96, 64]}
    assert views["wrist"] == {"camera": "wrist", "size": [10, 20]}
    assert added == {"wrist": {"link": "hand", "fov_y": 60}}
    for wrong in ({"../x": None}, {"a": 3}):
        with pytest.raises(ConfigurationError):
            read_cameras(wrong, (96, 64))  # type: ignore[arg-type]
