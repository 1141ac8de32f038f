"""ROS bags become episodes of data sets."""

from __future__ import annotations

import json
import sqlite3
import struct
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_bags import Message, forward, goal, image, joint_state, serialized_by, trajectory, write_bag
from ros2_wheels import ros2_variables
from typer.testing import CliRunner

from frobs_cli.program import program
from frobs_core.util.errors import RunError, UnknownParameterError
from frobs_data import DataError, check, import_bags, replay
from frobs_train import resolve_config, train

REACH, STEP, STEPS = "frobs/Irb120Reach-v0", 0.04, 40
OBSERVED = ("observation.state", "observation.environment_state", "next.reward", "next.success")


class Motion:
    """A motion of the simulated arm, and its messages."""

    def __init__(self, env: Any) -> None:
        observation, _ = env.reset(seed=1)
        self.names = env.robot.joint_names
        self.messages = [goal(0.0, env.task.goal[0])]
        self.actions: list[Any] = []
        self.observations: list[Any] = []
        self.rewards: list[float] = []
        self.positions = [env.robot.joint_positions[0].copy()]
        for k in range(STEPS):
            time = 0.1 + k * STEP
            self.messages.append(self.joints(time, env))
            self.actions.append(0.4 * np.sin(0.2 * k + np.arange(6)).astype(np.float32))
            self.observations.append(observation)
            observation, reward, *_ = env.step(self.actions[-1])
            self.rewards.append(reward)
            self.positions.append(env.robot.joint_positions[0].copy())
            self.messages.append(forward(time + 0.002, env.step_context.commands["robot"][0]))
        self.messages.append(self.joints(0.1 + STEPS * STEP, env))

    def joints(self, time: float, env: Any) -> Message:
        velocities = env.robot.joint_velocities[0, ::-1].copy()  # the order of drivers is arbitrary
        return joint_state(time, self.names[::-1], env.robot.joint_positions[0, ::-1], velocity=velocities)

    def without(self, *topics: str) -> list[Message]:
        return [message for message in self.messages if message[0] not in topics]


@pytest.fixture(scope="module")
def motion() -> Motion:
    import gymnasium as gym

    env = gym.make(f"frobs_core:{REACH}")
    moved = Motion(env.unwrapped)
    env.close()
    return moved


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_bag_is_imported_as_it_was_simulated_and_replayed(motion: Motion, tmp_path: Path, storage: str) -> None:
    bag = write_bag(tmp_path / "bag", motion.messages, storage)
    imported = import_bags([bag, bag], REACH, tmp_path / "data")
    dataset = imported.dataset
    assert [episode.length for episode in dataset.episodes] == [STEPS, STEPS]
    assert imported.unreachable == 0
    assert check(tmp_path / "data") == []
    columns = dataset.columns(["action", *OBSERVED], [1])
    observed = np.concatenate([columns[name] for name in OBSERVED[:2]], axis=1)
    np.testing.assert_allclose(observed, motion.observations, atol=1e-6)
    np.testing.assert_allclose(columns["next.reward"], motion.rewards, atol=1e-6)
    np.testing.assert_allclose(columns["action"], motion.actions, atol=1e-5)
    assert replay(tmp_path / "data", [0])[0].difference < 1e-4


def test_an_imported_bag_is_learned_from(motion: Motion, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", motion.messages)
    arguments = ["data", "import", bag, "--env", REACH, "--to", tmp_path / "data", "--json"]
    result = CliRunner().invoke(program(), [str(word) for word in arguments], catch_exceptions=False)
    assert json.loads(result.stdout)["episodes"] == 1
    settings = [f"algorithm_config.demonstrations={tmp_path / 'data'}", "algorithm_config.net_arch=[8]", "steps=3"]
    config = resolve_config(REACH, flags={"algorithm": "bc", "seed": 0, "num_envs": 1}, settings=settings)
    assert train(config, tmp_path / "run").newest_checkpoint()[0].steps == 3


@pytest.mark.needs("ros2")
def test_messages_of_plain_rclpy_are_imported(motion: Motion, tmp_path: Path) -> None:
    variables = ros2_variables()
    assert variables is not None
    messages = serialized_by(Path(__file__).parent / "nodes" / "serialize.py", variables, motion.messages)
    dataset = import_bags([write_bag(tmp_path / "bag", messages)], REACH, tmp_path / "data").dataset
    assert len(dataset) == STEPS
    np.testing.assert_allclose(dataset.columns(["action"])["action"], motion.actions, atol=1e-5)


def test_trajectories_and_measured_positions_are_commands(motion: Motion, tmp_path: Path) -> None:
    others = motion.without("/forward_position_controller/commands", "/goal")
    settings = ["environment_kwargs.controller=joint_position"]
    start, end = motion.positions[0], motion.positions[0] + [0.3, -0.2, 0.1, 0.0, 0.2, 0.1]
    points = trajectory(0.1, motion.names, [(1.0, end)])
    planned = write_bag(tmp_path / "planned", [*others, points])
    options: dict[str, Any] = {"goal": [0.4, 0.0, 0.5], "settings": settings}
    dataset = import_bags([planned], REACH, tmp_path / "a", **options).dataset
    lower, upper = _limits()
    targets = lower + (dataset.columns(["action"])["action"] + 1.0) * (upper - lower) / 2.0
    times = np.clip((np.arange(len(targets)) + 0.5) * STEP, 0.0, 1.0)[:, None]
    np.testing.assert_allclose(targets, start + times * (end - start), atol=1e-4)
    by_hand = write_bag(tmp_path / "hand", others)
    dataset = import_bags([by_hand], REACH, tmp_path / "b", commands="measured", **options).dataset
    targets = lower + (dataset.columns(["action"])["action"] + 1.0) * (upper - lower) / 2.0
    np.testing.assert_allclose(targets, motion.positions[1:], atol=1e-4)


def _limits() -> tuple[Any, Any]:
    import gymnasium as gym

    env: Any = gym.make(f"frobs_core:{REACH}").unwrapped
    limits = env.robot.position_lower[0].copy(), env.robot.position_upper[0].copy()
    env.close()
    return limits


def test_the_topic_observation_separates_episodes_and_reports_terms(motion: Motion, tmp_path: Path) -> None:
    messages = [
        joint_state(
            0.1 + k * STEP,
            ["episode", "success", *(f"goal/{i}" for i in (2, 0, 1))],
            [k // 20, k == 19, 0.5, 0.4, 0.0],
            "/robot/observation",
        )
        for k in range(STEPS + 1)
    ]
    messages += [(f"/robot{each[0]}", *each[1:]) for each in motion.without("/goal")]
    bag = write_bag(tmp_path / "bag", messages)
    dataset = import_bags([bag], REACH, tmp_path / "data", namespace="robot").dataset
    assert [episode.length for episode in dataset.episodes] == [19, 19]  # the third has no commands
    columns = dataset.columns(["next.success", "observation.environment_state"])
    assert np.flatnonzero(columns["next.success"]).tolist() == [18]
    np.testing.assert_allclose(columns["observation.environment_state"][:, :3], [[0.4, 0.0, 0.5]] * 38, atol=1e-6)


@pytest.mark.needs("rendering")
def test_images_are_resized_and_stored(motion: Motion, tmp_path: Path) -> None:
    pictures = [image(0.1 + k * STEP, "front", np.full((64, 48, 3), 5 * k, np.uint8)) for k in range(STEPS + 1)]
    settings = ["environment_kwargs.observations.front={type: camera, camera: overview, size: [32, 32]}"]
    bag = write_bag(tmp_path / "bag", [*motion.messages, *pictures])
    dataset = import_bags([bag], REACH, tmp_path / "data", settings=settings).dataset
    found = dataset.pictures(0, "observation.images.front")
    np.testing.assert_allclose(found.mean(axis=(1, 2, 3)), 5 * np.arange(STEPS), atol=4)


@pytest.mark.needs("rendering")
def test_an_image_that_cannot_be_read_leaves_nothing_behind(motion: Motion, tmp_path: Path) -> None:
    pictures = [image(0.1 + k * STEP, "front", np.zeros((64, 48, 3), np.uint8)) for k in range(STEPS + 1)]
    pictures[20][3]["encoding"] = "bayer_rggb8"
    settings = ["environment_kwargs.observations.front={type: camera, camera: overview, size: [32, 32]}"]
    bag = write_bag(tmp_path / "bag", [*motion.messages, *pictures])
    with pytest.raises(DataError, match="the encoding 'bayer_rggb8' is not supported"):
        import_bags([bag], REACH, tmp_path / "data", settings=settings)
    assert not (tmp_path / "data").exists()


@pytest.mark.parametrize("velocity", [[], [np.nan] * 6])
def test_velocities_that_are_observed_must_be_measured(motion: Motion, tmp_path: Path, velocity: list[float]) -> None:
    messages = [
        (*each[:3], {**each[3], "velocity": np.array(velocity)}) if each[0] == "/joint_states" else each
        for each in motion.messages
    ]
    bag = write_bag(tmp_path / "bag", messages)
    settings = ["environment_kwargs.observations.joint_velocities={type: joint_velocities}"]
    assert len(import_bags([bag], REACH, tmp_path / "without").dataset) == STEPS
    with pytest.raises(DataError, match="does not contain the observation terms joint_velocities"):
        import_bags([bag], REACH, tmp_path / "data", settings=settings)


def _later(message: Message, seconds: float) -> Message:
    return (message[0], message[1] + seconds, *message[2:])


PROBLEMS: dict[str, tuple[Callable[[Motion], list[Message]], str]] = {
    "no joint states": (
        lambda m: m.without("/joint_states"),
        "--remap joint_states:=TOPIC; the bag contains '/forward",
    ),
    "no commands": (lambda m: m.without(forward(0, [0])[0]), "--commands measured"),
    "no goal": (lambda m: m.without("/goal"), "terms goal, goal_offset, goal_from_shoulder; add the topic 'goal', or"),
    "other joints": (
        lambda m: [*m.without("/joint_states"), joint_state(0.1, ["elbow"], [0.0])],
        "names the joints joint_1, ",
    ),
    "a gap": (
        lambda m: [_later(message, 1.0 if message[1] > 1.0 else 0.0) for message in m.messages],
        "joint_states has a gap: at 1.",
    ),
    "not finite": (
        lambda m: [*m.messages, joint_state(1.0, m.names, [np.nan] * 6)],
        "'/joint_states' at 1.000 s cannot be used: it contains a number that is not finite",
    ),
    "wrong size": (lambda m: [*m.messages, forward(1.0, [0.0] * 7)], "it has 7 numbers instead of 6"),
    "wrong type": (
        lambda m: [*m.without("/goal"), forward(0.5, [0.0], "/goal")],
        "the topic '/goal' has the type std_msgs/msg/Float64MultiArray",
    ),
    "not at the same time": (
        lambda m: [_later(each, 9.0) if each[0] == "/joint_states" else each for each in m.messages],
        "record them at the same time",
    ),
    "two sources": (
        lambda m: [*m.messages, trajectory(0.2, m.names, [(1.0, m.positions[0])])],
        "choose one with --commands",
    ),
    "a far goal": (lambda m: [*m.without("/goal"), goal(0.0, [9.0, 0.0, 0.0])], "does not fit the environment: .*goal"),
}


@pytest.mark.parametrize("problem", PROBLEMS)
def test_a_bag_that_does_not_fit_is_one_clear_error(motion: Motion, tmp_path: Path, problem: str) -> None:
    messages, text = PROBLEMS[problem]
    bag = write_bag(tmp_path / "bag", messages(motion))
    with pytest.raises(DataError, match=text.replace("(", r"\(")) as caught:
        import_bags([bag], REACH, tmp_path / "data")
    assert str(bag) in str(caught.value)
    assert not (tmp_path / "data").exists()


def test_a_rule_for_an_unknown_topic_is_an_error(motion: Motion, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", motion.messages)
    with pytest.raises(UnknownParameterError, match=r"remap.*'joint_stats'.*Did you mean 'joint_states'"):
        import_bags([bag], REACH, tmp_path / "data", remappings=["joint_stats:=/arm/joint_states"])


def test_a_controller_of_the_tool_is_refused(motion: Motion, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", motion.messages)
    settings = ["environment_kwargs.controller=tcp_delta_position"]
    with pytest.raises(RunError, match="choose joint_position, joint_delta_position"):
        import_bags([bag], REACH, tmp_path / "data", settings=settings)


def _cut(bag: Path) -> Path:
    (file,) = bag.glob("*.mcap")
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    return bag


def _without_metadata(bag: Path) -> Path:
    (bag / "metadata.yaml").unlink()
    return bag


def _compressed(bag: Path) -> Path:
    lines = (bag / "metadata.yaml").read_text().splitlines()
    changed = [line.partition(":")[0] + ": file" if "compression_mode" in line else line for line in lines]
    assert changed != lines
    (bag / "metadata.yaml").write_text("\n".join(changed))
    return bag


def _view(bag: Path) -> Path:
    (file,) = bag.glob("*.db3")
    with closing(sqlite3.connect(file)) as database:
        database.execute(
            "CREATE VIEW v AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) SELECT x FROM c"
        )
    return bag


def _bomb(bag: Path) -> Path:
    """Replace the file by one with a chunk that is larger than it claims."""
    from rosbags.rosbag2 import storage_mcap

    (file,) = bag.glob("*.mcap")
    head = b"\x89MCAP0\r\n" + _record(1, struct.pack("<I", 4) + b"ros2" + struct.pack("<I", 0))
    zeros = vars(storage_mcap)["zstd"].compress(bytes(2**26))
    body = struct.pack("<QQQI", 0, 1, 2**20, 0) + struct.pack("<I", 4) + b"zstd" + struct.pack("<Q", len(zeros))
    end = _record(2, struct.pack("<QQI", 0, 0, 0)) + b"\x89MCAP0\r\n"
    file.write_bytes(head + _record(6, body + zeros) + end)
    return file


def _record(kind: int, data: bytes) -> bytes:
    return bytes([kind]) + len(data).to_bytes(8, "little") + data


@pytest.mark.parametrize(
    ("harm", "storage", "text"),
    [
        (_cut, "mcap", "damaged or incomplete: .*ros2 bag reindex"),
        (_without_metadata, "mcap", "its recording did not end; .*reindex.*or import the file"),
        (_compressed, "mcap", "compressed as a whole"),
        (_view, "sqlite3", "not a plain table"),
        (_bomb, "mcap", "damaged or incomplete"),
        (lambda bag: bag / "nothing.mcap", "mcap", "nothing.mcap: the file cannot be read"),
        (lambda bag: bag / "metadata.yaml", "mcap", "is not a bag"),
    ],
)
def test_damaged_and_hostile_bags_are_refused(
    motion: Motion, tmp_path: Path, harm: Callable[[Path], Path], storage: str, text: str
) -> None:
    bag = harm(write_bag(tmp_path / "bag", motion.messages, storage))
    with pytest.raises(DataError, match=text):
        import_bags([bag], REACH, tmp_path / "data")
    assert not (tmp_path / "data").exists()
